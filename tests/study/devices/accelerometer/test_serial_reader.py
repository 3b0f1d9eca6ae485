"""The reader over a pseudo-terminal, at the rates that a board sends, with bytes lost on the way."""

import contextlib
import os
import time
import tomllib
import tty

import numpy as np
import pytest
from pydantic import TypeAdapter

from study.devices.accelerometer.calibration import GRAVITY_MPS2, POSITIONS, UP_DIRECTIONS
from study.devices.accelerometer.newest_sample import IS_CLIPPED, MAX_AGE_S, SAMPLE_COUNT
from study.devices.accelerometer.parser import PACKET_SIZE
from study.devices.accelerometer.samples import PacketCounts, Samples
from study.devices.accelerometer.sensor import Accelerometer
from study.devices.accelerometer.serial_reader import open_serial
from study.devices.accelerometer.six_positions import calibrate_in_six_positions
from study.devices.force_dimension.lab import SensorSettings
from study.errors import DeviceError
from tests.study.devices.accelerometer.pty_board import AT_REST, IDEAL, RAW_RANGE, SCALE, Board, table_of, within

# The board is a thread of this process behind a pseudo-terminal: with all cores full it may send late.
pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]


@pytest.fixture
def board():
    with contextlib.closing(Board(2000.0)) as one:
        yield one


@pytest.fixture
def sensor(board):
    with contextlib.closing(Accelerometer(open_serial(board.path, 115_200), IDEAL, RAW_RANGE)) as one:
        one.zero(0.2)
        yield one


def test_at_rest_it_reads_nothing_and_moved_it_reads_the_motion(board, sensor):
    assert within(5.0, lambda: np.allclose(sensor.read_latest()[0], 0.0, atol=0.01))
    board.acceleration = AT_REST + [3.0, -2.0, 1.0]
    assert within(5.0, lambda: np.allclose(sensor.read_latest()[0], [3.0, -2.0, 1.0], atol=0.01))
    assert sensor.read_latest()[1] is False


def test_a_channel_at_its_limit_is_reported(board, sensor):
    board.acceleration = np.array([100.0, 0.0, 0.0])
    assert within(5.0, lambda: sensor.read_latest()[1])


def test_a_board_that_falls_silent_reads_nothing(board, sensor):
    board.on = False
    assert within(MAX_AGE_S + 5.0, lambda: bool(np.isnan(sensor.read_latest()[0]).all()))


@pytest.mark.parametrize("rate_hz", [1000.0, pytest.param(4000.0, marks=pytest.mark.slow), 10_000.0])
def test_every_rate_is_followed_and_what_is_lost_is_counted(rate_hz):
    with contextlib.closing(Board(rate_hz)) as board:
        random = np.random.default_rng(1)

        def losing(block: bytes) -> bytes:
            """Now and then a byte in the middle, so one packet of the block."""
            at = int(random.integers(0, len(block))) if random.random() < 0.3 else None
            return block if at is None else block[:at] + block[at + 1 :]

        board.spoil = losing
        with contextlib.closing(Accelerometer(open_serial(board.path, 115_200), IDEAL, RAW_RANGE)) as sensor:
            assert within(20.0, lambda: sensor.counts.packets > rate_hz / 2)
            counts = sensor.counts
        assert 0 < counts.lost < 0.2 * counts.packets
        assert counts.restarts == 0
        assert counts.spoiled_bytes >= (PACKET_SIZE - 1) * (counts.lost - 1)


def test_a_silent_serial_line_is_an_error():
    master, slave = os.openpty()
    tty.setraw(slave)
    with contextlib.closing(Accelerometer(open_serial(os.ttyname(slave), 115_200), IDEAL, (0, 65_535))) as sensor:
        os.write(master, b"no packet at all")
        with pytest.raises(DeviceError, match="The accelerometer is silent"):
            sensor.zero(0.1)
        assert np.isnan(sensor.read_latest()[0]).all()
    os.close(master)
    os.close(slave)


def test_a_missing_port_is_an_error(tmp_path):
    with pytest.raises(DeviceError, match="cannot be opened.*group dialout"):
        open_serial(str(tmp_path / "ttyACM7"), 115_200)


def test_the_driver_opens_it_as_the_lab_s_file_says(board, stub, rigs, tmp_path, monkeypatch):
    from study.devices.clock import RealClock
    from study.devices.opening import open_device

    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(tmp_path / "device.toml"))
    (tmp_path / "device.toml").write_text(table_of(board))
    with contextlib.closing(open_device("omega3", rigs.SETTINGS, RealClock(), 1)) as device:
        board.acceleration = AT_REST + [1.0, 2.0, 3.0]

        def seen() -> bool:
            acceleration = device.look().acceleration_mps2
            return acceleration is not None and np.allclose(acceleration, [1.0, 2.0, 3.0], atol=0.01)

        assert within(10.0, seen)
    assert stub.safe


@pytest.mark.slow
def test_six_positions_at_the_table_give_the_table_of_the_lab_s_file(board):
    laid: list[str] = []

    def lay_down(position: str, heard: tuple[float, float, float] | None) -> None:
        assert (heard is None) is (not laid)
        board.acceleration = GRAVITY_MPS2 * UP_DIRECTIONS[len(laid)]
        laid.append(position)

    table = tomllib.loads(calibrate_in_six_positions(board.path, 115_200, lay_down, rest_s=0.3))["accelerometer"]
    assert laid == list(POSITIONS)
    assert table["port"] == board.path
    np.testing.assert_allclose(table["bias"], 32_768, atol=2)
    np.testing.assert_allclose(table["sensitivity"], SCALE * np.eye(3), atol=0.5)
    assert 0 < table["raw_range"][0] < 32_768 - 2.9 * SCALE * GRAVITY_MPS2
    TypeAdapter(SensorSettings).validate_python(table)


def test_a_sensor_that_was_never_turned_is_not_calibrated(board):
    with pytest.raises(DeviceError, match="was not calibrated"):
        calibrate_in_six_positions(board.path, 115_200, lambda position, heard: None, rest_s=0.1)


class _Batches:
    """A source of samples (raw, arrival in s), whose last never comes."""

    counts = PacketCounts()

    def __init__(self, *batches: tuple[float, float]) -> None:
        self.batches = list(batches)

    def read(self) -> tuple[Samples, float]:
        if not self.batches:
            time.sleep(0.001)
            return Samples(np.zeros(0, int), np.zeros(0, int), np.zeros((0, 3)), np.zeros(0, int)), 0.0
        raw, arrived_s = self.batches.pop(0)
        zero = np.zeros(1, int)
        return Samples(zero, zero + round(1e6 * arrived_s), np.array([[32_768.0, raw, 32_768.0]]), zero), arrived_s

    def close(self) -> None:
        self.batches.clear()


@pytest.mark.parametrize(("later_s", "is_marked"), [(0.0005, True), (0.0011, True), (0.01, False)])
def test_a_clipped_sample_is_seen_at_the_next_tick_although_another_came_in_between(later_s, is_marked):
    source = _Batches((32_768.0, 1.0), (65_535.0, 1.1), (32_768.0, 1.1 + later_s))
    with contextlib.closing(Accelerometer(source, IDEAL, RAW_RANGE)) as sensor:
        assert within(5.0, lambda: sensor.samples[0, SAMPLE_COUNT] == 3.0)
        assert [bool(sensor.samples[row, IS_CLIPPED]) for row in (1, 2, 3)] == [False, True, is_marked]
