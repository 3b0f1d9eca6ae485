"""What a lab knows of its device beyond the vendor's library: a small TOML file, of which every key may be left out."""

import os
import tomllib
from pathlib import Path

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from protocols.definition.staircase_rule import STRICT
from study.devices.accelerometer.calibration import Calibration
from study.devices.accelerometer.serial_reader import SerialAccelerometer, open_serial
from study.devices.onset_line import PulseSettings
from study.errors import DeviceError

Triple = tuple[float, float, float]

FILE_VARIABLE = "HAPTEQ_DEVICE_FILE"


@dataclass(frozen=True, config=STRICT)
class SensorSettings:
    """An accelerometer on a serial line, with what its calibration found."""

    port: str
    """Port name of the operating system: /dev/ttyACM0, COM3."""
    bias: Triple
    """Raw value of each channel at no acceleration."""
    sensitivity: tuple[Triple, Triple, Triple]
    """Raw per m/s²; a row is a channel, a column an axis of the device."""
    raw_range: tuple[int, int]
    """Lowest and highest raw value that are no clipping."""
    baud: int = Field(default=2_000_000, gt=0)

    def open_sensor(self) -> SerialAccelerometer:
        """Zeroed, so at rest. Raises `DeviceError`."""
        calibration = Calibration(np.array(self.bias), np.array(self.sensitivity), np.zeros(3), 0.0)
        sensor = SerialAccelerometer(open_serial(self.port, self.baud), calibration, self.raw_range)
        try:
            sensor.zero()
        except BaseException:
            sensor.close()
            raise
        return sensor


@dataclass(frozen=True, config=STRICT)
class LabSettings:
    effector_mass_kg: float | None = Field(default=None, gt=0, le=2)
    """Mass that the gravity compensation carries: handle and sensor. None: the model's own."""
    effective_mass_kg: float | None = Field(default=None, ge=0.01, le=5)
    """Mass that the centring spring moves, at the handle. None: the assumption in the table of models."""
    accelerometer: SensorSettings | None = None
    pulse: PulseSettings | None = None
    """A line that gets a pulse at the onset of each trial's force."""


def lab_file() -> Path:
    named = os.environ.get(FILE_VARIABLE)
    return Path(named) if named else Path.home() / ".config" / "hapteq" / "device.toml"


def read_lab() -> LabSettings:
    """Raises `DeviceError` for a file that cannot be read. Without one, nothing is known."""
    path = lab_file()
    try:
        text = path.read_text("utf-8")
    except FileNotFoundError:
        return LabSettings()
    except (OSError, UnicodeDecodeError) as error:
        raise _wrong(path, str(error)) from error
    try:
        return TypeAdapter(LabSettings).validate_python(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise _wrong(path, str(error)) from error
    except ValidationError as error:
        first = error.errors()[0]
        raise _wrong(path, f"{'.'.join(map(str, first['loc']))}: {first['msg']}") from error


def _wrong(path: Path, happened: str) -> DeviceError:
    return DeviceError(
        "The settings of the device cannot be used",
        f"{path}: {happened}.",
        "Correct it; docs/hardware.md lists its keys.",
    )
