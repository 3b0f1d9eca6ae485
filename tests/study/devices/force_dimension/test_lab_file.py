"""A calibration put into the lab's file: nothing else of it changes, and nothing at all where it cannot be."""

import os
from pathlib import Path

import pytest

from study.devices.accelerometer.calibration import Calibration
from study.devices.accelerometer.six_positions import format_calibration_toml
from study.devices.force_dimension.lab import read_lab_settings, write_sensor_table
from study.errors import DeviceError
from tests.study.devices.accelerometer.pty_board import IDEAL

TABLE = format_calibration_toml(IDEAL, "/dev/ttyACM3", 115_200)

OLD = """# the lab's own words
effector_mass_kg = 0.153     # with the sensor

[accelerometer]              # of last year
port = "/dev/ttyACM0"
bias = [1.0, 2.0, 3.0]
sensitivity = [
  [607.0, 3.0, -5.0],
  [-4.0, 611.0, 2.0],
  [6.0, 1.0, 598.0],
]
raw_range = [13800, 51200]

[pulse]
kind = "serial-byte"
port = "/dev/ttyUSB0"
"""


@pytest.fixture
def file(tmp_path, monkeypatch):
    path = tmp_path / "config" / "device.toml"
    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(path))
    return path


def test_a_first_calibration_makes_the_file(file):
    assert write_sensor_table(TABLE) == file
    lab = read_lab_settings()
    assert lab.accelerometer is not None and lab.accelerometer.port == "/dev/ttyACM3"
    assert [path.name for path in file.parent.iterdir()] == ["device.toml"]


def test_a_new_calibration_takes_the_place_of_the_old_one_alone(file):
    file.parent.mkdir()
    file.write_text(OLD)
    write_sensor_table(TABLE)
    text, lab = file.read_text(), read_lab_settings()
    assert text.startswith("# the lab's own words\neffector_mass_kg = 0.153     # with the sensor\n")
    assert "of last year" not in text and text.count("[accelerometer]") == 1
    assert lab.effector_mass_kg == 0.153 and lab.pulse is not None and lab.pulse.port == "/dev/ttyUSB0"
    assert lab.accelerometer is not None and lab.accelerometer.baud == 115_200
    assert lab.accelerometer.sensitivity == tuple(map(tuple, IDEAL.sensitivity.tolist()))
    assert file.with_name("device.toml.before").read_text() == OLD
    assert sorted(path.name for path in file.parent.iterdir()) == ["device.toml", "device.toml.before"]


def test_the_file_stays_in_place_where_the_disk_fails_as_it_is_replaced(file, monkeypatch):
    """Without it, the next session would run with the default masses and no sensor."""
    file.parent.mkdir()
    file.write_text(OLD)
    replace = Path.replace

    def fail(path, target):
        if target == file:
            raise OSError(28, "No space left on device")
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(DeviceError, match="was not kept.*could not be written: .*No space left on device"):
        write_sensor_table(TABLE)
    assert file.read_text() == OLD


def test_a_pipe_in_the_place_of_the_file_is_refused_at_once(file):
    file.parent.mkdir()
    os.mkfifo(file)
    with pytest.raises(DeviceError, match="cannot be used.*it is a pipe"):
        read_lab_settings()


def test_comments_above_the_next_table_are_not_those_of_the_old_calibration(file):
    file.parent.mkdir()
    file.write_text(OLD.replace("bias =", "# of May\nbias =").replace("[pulse]", "# The line of the EEG:\n[pulse]"))
    write_sensor_table(TABLE)
    assert "\n# The line of the EEG:\n[pulse]\n" in file.read_text() and "of May" not in file.read_text()


def test_nothing_changes_where_the_file_cannot_be_used_or_the_table_is_none(file):
    file.parent.mkdir()
    file.write_text("effector_mass_kg = ")
    with pytest.raises(DeviceError, match="was not kept.*cannot be used") as refused:
        write_sensor_table(TABLE)
    assert TABLE in refused.value.do_now  # it was six positions' work
    file.write_text(OLD)
    with pytest.raises(DeviceError, match="was not kept"):
        write_sensor_table(TABLE.replace("bias", "bais"))
    assert file.read_text() == OLD


def test_all_that_is_wrong_in_the_file_is_told_at_once(file):
    file.parent.mkdir()
    file.write_text('effector_mass_kg = -1.0\n[accelerometer]\nport = "COM3"\nbais = [0.0, 0.0, 0.0]\n')
    with pytest.raises(DeviceError, match="effector_mass_kg: .*; accelerometer.bias: .*; accelerometer.bais: "):
        read_lab_settings()


def test_a_range_at_the_ends_of_16_bits_is_written_as_whole_numbers():
    wide = Calibration(IDEAL.bias, 10 * IDEAL.sensitivity, IDEAL.noise_mps2, 0.0)
    assert "raw_range = [0, 65535]" in format_calibration_toml(wide, "COM3", 9600)


SENSOR = OLD[OLD.index("[accelerometer]") : OLD.index("[pulse]")]
UNUSABLE = {
    "effector_mass_kg: Input should be a valid number": "effector_mass_kg = true",
    "effective_mass_kg: Input should be a valid number": 'effective_mass_kg = "0.28"',
    "effective_mass_kg: Input should be a valid .*number": "effective_mass_kg = 2026-11-30",
    "effective_mass_kg: Input should be a finite number": "effective_mass_kg = nan",
    "Exceeds the limit": f"effective_mass_kg = {'9' * 5000}",
    "recursion": f"effective_mass_kg = {'[' * 5000}{']' * 5000}",
    "accelerometer.baud: Input should be a valid integer": f"{SENSOR}baud = true",
    "accelerometer.port: Input should be a valid string": SENSOR.replace('"/dev/ttyACM0"', "12:00:00"),
    "sensitivity has a row or column that follows": SENSOR.replace("[6.0, 1.0, 598.0]", "[1214.0, 6.0, -10.0]"),
    "raw_range must be the lowest": SENSOR.replace("[13800, 51200]", "[51200, 13800]"),
}


@pytest.mark.parametrize("why", UNUSABLE)
def test_a_value_that_is_no_number_or_gives_no_acceleration_is_refused_by_name(file, why):
    file.parent.mkdir()
    file.write_text(UNUSABLE[why])
    with pytest.raises(DeviceError, match=f"settings of the device cannot be used.*{why}"):
        read_lab_settings()


@pytest.mark.parametrize("port", [r"\\.\COM10", 'serial "left"', "/dev/serial/by-id/Gerät-1"])
def test_a_port_of_any_name_is_written_so_that_it_is_read_again(file, port):
    write_sensor_table(format_calibration_toml(IDEAL, port, 115_200))
    lab = read_lab_settings()
    assert lab.accelerometer is not None and lab.accelerometer.port == port


@pytest.mark.parametrize(("text", "mass_kg"), [("1", 1.0), ("15_3e-2", 1.53), ("0x1", 1.0)])
def test_a_number_in_any_notation_of_toml_is_read(file, text, mass_kg):
    file.parent.mkdir()
    file.write_text(f"effector_mass_kg = {text}")
    assert read_lab_settings().effector_mass_kg == mass_kg


def test_a_byte_order_mark_of_an_editor_is_no_error(file):
    file.parent.mkdir()
    file.write_text("effector_mass_kg = 0.1\n", "utf-8-sig")
    assert read_lab_settings().effector_mass_kg == 0.1
    write_sensor_table(TABLE)
    assert read_lab_settings().effector_mass_kg == 0.1
