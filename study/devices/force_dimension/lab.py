"""A lab's settings of its device, such as its accelerometer: a small TOML file, in which every key is optional."""

import os
import re
import tomllib
from pathlib import Path

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from protocols.definition.staircase_rule import STRICT
from study.devices.accelerometer.calibration import Calibration
from study.devices.accelerometer.sensor import Accelerometer
from study.devices.accelerometer.sources import open_source
from study.devices.onset_line import PulseSettings
from study.errors import DeviceError

Triple = tuple[float, float, float]

HEADER = re.compile(r"\s*\[\[?[\w.\"-]+\]\]?\s*(#.*)?")
"""Header of a table in TOML; a row of numbers in brackets does not match."""

FILE_VARIABLE = "HAPTEQ_DEVICE_FILE"
"""Environment variable that names the lab's file, in place of the default one."""


@dataclass(frozen=True, config=STRICT)
class SensorSettings:
    """An accelerometer, with what its calibration found."""

    port: str
    """As the system calls it: /dev/ttyACM0, COM3; or a data-acquisition device, as `sources` says."""
    bias: Triple
    """Raw value of each channel at no acceleration."""
    sensitivity: tuple[Triple, Triple, Triple]
    """Raw per m/s²; a row is a channel, a column an axis of the device."""
    raw_range: tuple[float, float]
    """Lowest and highest raw value that are no clipping."""
    baud: int = Field(default=2_000_000, gt=0)

    def open_sensor(self) -> Accelerometer:
        """Zeroed, so at rest. Raises `DeviceError`."""
        calibration = Calibration(np.array(self.bias), np.array(self.sensitivity), np.zeros(3), 0.0)
        sensor = Accelerometer(open_source(self.port, self.baud), calibration, self.raw_range)
        try:
            sensor.zero()
        except BaseException:
            sensor.close()
            raise
        return sensor


@dataclass(frozen=True, config=STRICT)
class LabSettings:
    """Content of the lab's settings file; every key is optional."""

    effector_mass_kg: float | None = Field(default=None, gt=0, le=2)
    """Mass that the gravity compensation carries: handle and sensor. None: the model's own."""
    effective_mass_kg: float | None = Field(default=None, ge=0.01, le=5)
    """Mass that the centring spring moves, at the handle. None: the assumption in the table of models."""
    accelerometer: SensorSettings | None = None
    pulse: PulseSettings | None = None
    """A line that gets a pulse at the onset of each trial's force."""


def lab_file() -> Path:
    """Path of the settings file: from the environment variable HAPTEQ_DEVICE_FILE, else ~/.config/hapteq/device.toml.
    The file need not exist."""
    named = os.environ.get(FILE_VARIABLE)
    return Path(named) if named else Path.home() / ".config" / "hapteq" / "device.toml"


def read_lab() -> LabSettings:
    """Read the laboratory's settings. Raises `DeviceError` for a file that cannot be read. Without one, nothing is
    known."""
    path = lab_file()
    try:
        text = path.read_text("utf-8")
    except FileNotFoundError:
        return LabSettings()
    except (OSError, UnicodeDecodeError) as error:
        raise _lab_file_error(path, str(error)) from error
    try:
        return TypeAdapter(LabSettings).validate_python(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise _lab_file_error(path, str(error)) from error
    except ValidationError as error:
        first = error.errors()[0]
        raise _lab_file_error(path, f"{'.'.join(map(str, first['loc']))}: {first['msg']}") from error


def keep_sensor(table: str) -> Path:
    """Put an [accelerometer] table into the lab's file, in the place of an older one. What the file said before stays
    beside it. Raises `DeviceError`; then nothing was changed."""
    read_lab()
    path = lab_file()
    try:
        before = path.read_text("utf-8") if path.exists() else ""
        text = _with_sensor(before, table)
        TypeAdapter(LabSettings).validate_python(tomllib.loads(text))
        path.parent.mkdir(parents=True, exist_ok=True)
        written = path.with_name(f"{path.name}.new")
        written.write_text(text, "utf-8")
        if before:
            path.replace(path.with_name(f"{path.name}.before"))
        written.replace(path)
    except (OSError, ValueError) as error:
        raise DeviceError(
            "The calibration was not kept",
            f"{path} could not be written: {error}.",
            "Put the table into that file by hand (docs/hardware.md).",
        ) from error
    return path


def _with_sensor(text: str, table: str) -> str:
    lines, kept, skipping = text.splitlines(), [], False
    for line in lines:
        if HEADER.fullmatch(line):
            skipping = line.split("#")[0].strip() == "[accelerometer]"
        if not skipping:
            kept.append(line)
    above = "\n".join(kept).rstrip()
    return f"{above}\n\n{table.rstrip()}\n" if above else f"{table.rstrip()}\n"


def _lab_file_error(path: Path, happened: str) -> DeviceError:
    return DeviceError(
        "The settings of the device cannot be used",
        f"{path}: {happened}.",
        "Correct it; docs/hardware.md lists its keys.",
    )
