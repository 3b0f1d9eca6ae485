"""docs/hardware.md keeps to what is there: its tests exist, its files are read, its devices open."""

import re
import tomllib
from pathlib import Path

from pydantic import TypeAdapter

from study.cli.main import main
from study.devices.accelerometer.parser import PACKET_DTYPE, PACKET_SIZE
from study.devices.force_dimension.device_models import MODELS
from study.devices.force_dimension.lab import LabSettings, SensorSettings
from study.devices.force_dimension.usb import UDEV_RULE, UDEV_RULE_FILE

ROOT = Path(__file__).parents[4]
PAGE = (ROOT / "docs" / "hardware.md").read_text("utf-8")


def test_the_tests_named_in_the_hardware_page_exist():
    named = set(re.findall(r"`(?:[\w/]*/)?(test_\w+)(?:\.py)?`", PAGE))
    assert len(named) >= 10
    sources = {path: path.read_text("utf-8") for path in (ROOT / "tests").rglob("test_*.py")}
    missing = [
        name for name in named if not any(path.stem == name or f"def {name}(" in text for path, text in sources.items())
    ]
    assert missing == []


def test_the_examples_of_a_lab_s_file_are_one():
    examples = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    lab = TypeAdapter(LabSettings).validate_python(tomllib.loads("".join(examples)))
    assert lab.pulse is not None
    assert lab.effective_mass_kg == MODELS["omega3"].effective_mass_kg
    assert lab.accelerometer is not None


def test_wiring_and_speed_are_those_of_the_firmware():
    sketch = (ROOT / "docs" / "firmware" / "accelerometer.ino").read_text("utf-8")
    (pins,) = re.findall(r"PINS\[3\] = {(.*)}", sketch)
    assert (
        re.findall(r"^\| [XYZ] \| (A\d) \(pin \d+\) \|", PAGE, re.MULTILINE) == pins.split(", ") == ["A0", "A1", "A2"]
    )
    (baud,) = re.findall(r"Serial\.begin\((\d+)\)", sketch)
    assert int(baud) == SensorSettings.__dataclass_fields__["baud"].default.default


def test_the_commands_of_the_hardware_page_have_the_options_that_it_gives_them(capsys):
    lines = re.findall(r"^(?:```\n)?(hapteq .*?)(?: +#.*)?$", PAGE, re.MULTILINE)
    lines += re.findall(r"`(hapteq [^`]+)`", PAGE)
    assert sum("--protocol" in line for line in lines) == 1
    for line in lines:
        _, command, *words = line.split()
        assert main([command, "--help"]) == 0, line
        helped = capsys.readouterr().out
        assert [word for word in words if word.startswith("--") and f"{word} " not in helped] == [], line


def test_rule_devices_and_packet_are_those_of_the_code():
    assert UDEV_RULE in PAGE and UDEV_RULE_FILE in PAGE
    assert all(f"`{name}`" in PAGE or f"--device {name}`" in PAGE for name in MODELS)
    assert PACKET_DTYPE.itemsize == PACKET_SIZE == 16
    assert (PACKET_DTYPE.fields["time_us"][1], PACKET_DTYPE.fields["raw"][1], PACKET_DTYPE.fields["crc"][1]) == (
        4,
        8,
        14,
    )
