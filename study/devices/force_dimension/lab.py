"""The laboratory's settings of its device (masses, accelerometer, onset pulse): reads and writes a TOML file whose keys
and tables are all optional at the top level.

Read at every opening of a real device; `hapteq doctor` writes the result of a sensor calibration into it. The keys are
described in docs/hardware.md.
"""

import json
import os
import re
import tomllib
from pathlib import Path
from typing import Self

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError, model_validator
from pydantic.dataclasses import dataclass

from equalizer.signals.listed_problems import format_validation_problems
from protocols.definition.staircase_rule import STRICT
from study.devices.accelerometer.calibration import Calibration
from study.devices.accelerometer.sensor import Accelerometer
from study.devices.accelerometer.sources import open_source
from study.devices.onset_line import PulseSettings
from study.errors import DeviceError
from study.regular_file import MAX_DOCUMENT_BYTES, read_regular

Triple = tuple[float, float, float]
"""Three numbers, for three channels or three axes."""

TABLE_HEADER = re.compile(r"\s*\[\[?[\w.\"-]+\]\]?\s*(#.*)?")
"""Line that is the header of a table in TOML, with or without a comment; an array of numbers with commas does not
match."""

LAB_FILE_VARIABLE = "HAPTEQ_DEVICE_FILE"
"""Environment variable with the path of the lab's file, in place of the default one."""


@dataclass(frozen=True, config=STRICT)
class SensorSettings:
    """The [accelerometer] table: connection and calibration of an accelerometer."""

    port: str
    """Port by its name in the operating system (/dev/ttyACM0, COM3), or a data-acquisition device as in
    `accelerometer.sources`."""
    bias: Triple
    """Raw value of each channel at zero acceleration."""
    sensitivity: tuple[Triple, Triple, Triple]
    """Change of the raw value per m/s²; row = channel, column = axis of the device."""
    raw_range: tuple[float, float]
    """Lowest and highest raw value; a sample at or beyond either counts as clipped."""
    baud: int = Field(default=2_000_000, gt=0)
    """Rate of the serial line, bit/s; not used by a data-acquisition device."""

    @model_validator(mode="after")
    def _require_usable_values(self) -> Self:
        """Raise ValueError for a sensitivity that gives no acceleration, and a range in which every sample clips."""
        if np.linalg.matrix_rank(np.array(self.sensitivity)) < 3:
            raise ValueError(
                "sensitivity has a row or column that follows from the others: no acceleration can be told"
            )
        if not self.raw_range[0] < self.raw_range[1]:
            raise ValueError("raw_range must be the lowest and then the highest raw value")
        return self

    def open_sensor(self) -> Accelerometer:
        """Open the sensor and take its present reading as zero; the handle must be at rest. Raises `DeviceError`."""
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
    """Content of the lab's settings file; every key of this class is optional."""

    effector_mass_kg: float | None = Field(default=None, gt=0, le=2)
    """Mass for the gravity compensation (kg): handle and sensor. None: that of `DeviceModel.effector_mass_kg`."""
    effective_mass_kg: float | None = Field(default=None, ge=0.01, le=5)
    """Effective mass at the handle, from which the stiffness of the centring spring is computed (kg). None: that of
    `DeviceModel.effective_mass_kg`."""
    accelerometer: SensorSettings | None = None
    """None: no acceleration is measured."""
    pulse: PulseSettings | None = None
    """Output line that gets a pulse at the onset of each trial's force. None: no pulse."""


def locate_lab_file() -> Path:
    """Return the path of the settings file: from the environment variable HAPTEQ_DEVICE_FILE, else
    ~/.config/hapteq/device.toml. The file need not exist."""
    environment_path = os.environ.get(LAB_FILE_VARIABLE)
    return Path(environment_path) if environment_path else Path.home() / ".config" / "hapteq" / "device.toml"


def read_lab_settings() -> LabSettings:
    """Read the laboratory's settings; all are None where the file does not exist. Raises `DeviceError` for a file that
    cannot be read or is not valid."""
    path = locate_lab_file()
    try:
        text = read_regular(path, MAX_DOCUMENT_BYTES).decode("utf-8-sig")
    except FileNotFoundError:
        return LabSettings()
    except (OSError, UnicodeDecodeError) as error:
        raise _make_lab_file_error(path, str(error)) from error
    try:
        return _parse_settings(text)
    except ValidationError as error:
        raise _make_lab_file_error(path, "; ".join(format_validation_problems(error.errors()))) from error
    except (ValueError, RecursionError) as error:
        raise _make_lab_file_error(path, str(error)) from error


def _parse_settings(text: str) -> LabSettings:
    """Parse the text of the settings file. Numbers must be numbers, not text or truth values. Raises ValidationError,
    and ValueError or RecursionError for a text that is not TOML."""
    # Validated as JSON, like a protocol (`protocols.document.loading`): strict, and yet a list may stand for a tuple. A
    # date or time, which JSON lacks, becomes an empty object, which is neither a number nor a text.
    values_json = json.dumps(tomllib.loads(text), default=lambda _date: {})
    return TypeAdapter(LabSettings).validate_json(values_json, strict=True)


def write_sensor_table(sensor_table: str) -> Path:
    """Write an [accelerometer] table (TOML) into the settings file, replacing an older one, and return the path. The
    previous file, if not empty, is copied to `NAME.before`, and stays in place until the new one is complete. Raises
    `DeviceError`, with the table as its remedy, where the file cannot be read or written, or the new content is not
    valid."""
    path = locate_lab_file()
    try:
        read_lab_settings()
        previous_content = path.read_bytes() if path.exists() else b""
        text = _replace_sensor_table(previous_content.decode("utf-8-sig"), sensor_table)
        _parse_settings(text)
        path.parent.mkdir(parents=True, exist_ok=True)
        if previous_content:
            replace_file(path.with_name(f"{path.name}.before"), previous_content)
        replace_file(path, text.encode())
    except (DeviceError, OSError, ValueError) as error:
        cause = (
            f"{error.title}. {error.happened}"
            if isinstance(error, DeviceError)
            else f"{path} could not be written: {error}."
        )
        remedy = f"Put this table into that file by hand (docs/hardware.md):\n{sensor_table}"
        raise DeviceError("The calibration was not kept", cause, remedy) from error
    return path


def replace_file(path: Path, content: bytes) -> None:
    """Write a file anew, complete and synced before it replaces an older one, which else stays. Raises OSError."""
    new_path = path.with_name(f"{path.name}.new")
    try:
        new_path.write_bytes(content)
        with new_path.open("rb+") as file:
            os.fsync(file.fileno())
        new_path.replace(path)
    finally:
        new_path.unlink(missing_ok=True)


def _replace_sensor_table(text: str, sensor_table: str) -> str:
    """Return the text of the file without its [accelerometer] table (up to the next header and the comments above
    that), the new one appended."""
    kept_lines: list[str] = []
    comment_lines: list[str] = []
    in_sensor_table = False
    for line in text.splitlines():
        if TABLE_HEADER.fullmatch(line):
            in_sensor_table = line.split("#")[0].strip() == "[accelerometer]"
            kept_lines += comment_lines
        if not in_sensor_table:
            kept_lines.append(line)
        is_comment = not line.strip() or line.lstrip().startswith("#")
        comment_lines = [*comment_lines, line] if in_sensor_table and is_comment else []
    other_text = "\n".join(kept_lines).rstrip()
    return f"{other_text}\n\n{sensor_table.rstrip()}\n" if other_text else f"{sensor_table.rstrip()}\n"


def _make_lab_file_error(path: Path, reason: str) -> DeviceError:
    """Make the error for a settings file that cannot be read or is not valid. reason: a clause without a full stop."""
    return DeviceError(
        "The settings of the device cannot be used",
        f"{path}: {reason}.",
        "Correct it; docs/hardware.md lists its keys.",
    )
