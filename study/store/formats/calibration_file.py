"""Calibrations of a linkage as HDF5: the format `hapteq-calibration`, version 1.

A calibration is the device's own kinematics and dynamics over a grid of handle positions: joint angles, Jacobian,
inertia and gravity force, in SI units. `LAYOUT` lists the contents with shapes and units.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from equalizer.linkage.calibration import LinkageCalibration
from equalizer.signals.signal import FloatArray
from study.store.disk.file_errors import UnusableFileError, convert_problems
from study.store.disk.hdf5_attributes import read_numbers_attribute, read_provenance_attribute, read_text_attribute
from study.store.disk.hdf5_file import ProblemCollector, open_hdf5, read_float_dataset, write_hdf5
from study.store.disk.layout import Entry

FORMAT, VERSION = "hapteq-calibration", 1
"""Name and version of the format, written into every file."""
KIND = "calibration of a linkage"
"""Name of such a file in messages."""

ABOUT = (
    "Joint angles, Jacobian, inertia and gravity force of a device's linkage over a grid of "
    "positions, as the device reports them (`hapteq calibrate`). Arrays have checksums. The file begins with "
    "a block of 512 bytes, the user block of HDF5, which readers skip. It contains SHA-256 and size of "
    "everything after it. A damaged file is therefore refused before the HDF5 library reads it; the library "
    "may hang on such a file. Files of other programs may lack this block."
)
"""Introduction of the format in docs/formats.md, which is generated."""

LAYOUT = (
    Entry("format", "attribute, text", f"`{FORMAT}`"),
    Entry("version", "attribute, whole number", f"{VERSION}"),
    Entry("device", "attribute, text", "name of the device"),
    Entry("details", "attribute, text", "serial number, firmware and SDK of a real device"),
    Entry("read_on", "attribute, text", "date of the calibration, ISO 8601"),
    Entry("position_m", "(n, 3) float64", "position of the handle: x towards the operator, y right, z up"),
    Entry("joint_angle_rad", "(n, 3) float64", "joint angles, with the device's own zero and order"),
    Entry("jacobian", "(n, 3, 3) float64", "m/rad: handle velocity = J joint speeds, joint torques = J^T handle force"),
    Entry("inertia_kg", "(n, 3, 3) float64", "inertia at the handle, in the axes of position_m"),
    Entry("gravity_n", "(n, 3) float64", "force at the handle that balances gravity; NaN = not known"),
    Entry("filled", "(n,) float64", "1 = mirrored at a mirror line from another position; 0 = read from the device"),
    Entry("line_deg", "attribute, 3 numbers", "azimuth of the mirror lines, from y towards z, in the joints' order"),
    Entry("asymmetry", "attribute, 3 numbers", "largest relative difference from the mirrored inertia, for each line"),
    Entry("difference", "attribute, number", "largest relative difference of J from finite differences"),
    Entry("provenance", "attribute, JSON text", "versions, command", False),
)
"""Contents of the file, as docs/formats.md lists them."""

ARRAY_NAMES = ("position_m", "joint_angle_rad", "jacobian", "inertia_kg", "gravity_n", "filled")
"""Datasets of the file, in the order in which they are written."""
ARRAY_SHAPES = {"jacobian": "(positions, 3, 3)", "inertia_kg": "(positions, 3, 3)", "filled": "(positions)"}
"""Shapes in words, for messages; the other arrays are (positions, 3)."""


def read_calibration(path: Path) -> LinkageCalibration:
    """Read a calibration of a linkage. Raises CannotReadError, or UnusableFileError with the problems of the file."""
    problems = ProblemCollector()
    with open_hdf5(path, KIND, FORMAT, VERSION, sealed=True) as file:
        fields = _read_fields(file, problems)
    if problems.messages:
        raise UnusableFileError(path, KIND, tuple(problems.messages))
    with convert_problems(path, KIND):
        return LinkageCalibration(**fields)


def write_calibration(path: Path, calibration: LinkageCalibration) -> None:
    """Write a calibration of a linkage, sealed and never over an existing file. Raises AlreadyExistsError,
    CannotWriteError."""

    def fill_file(file: Any) -> None:
        """Write attributes and datasets into the open HDF5 file."""
        file.attrs.update({"format": FORMAT, "version": VERSION, "difference": calibration.difference})
        for name in ("device", "details", "read_on", "line_deg", "asymmetry"):
            file.attrs[name] = getattr(calibration, name)
        for name in ARRAY_NAMES:
            file.create_dataset(name, data=getattr(calibration, name), fletcher32=True)
        file.attrs["provenance"] = json.dumps(dict(calibration.provenance), allow_nan=False)

    write_hdf5(path, fill_file, overwrite=False, sealed=True)


def _read_fields(file: Any, problems: ProblemCollector) -> dict[str, Any]:
    """Read the fields of `LinkageCalibration`, with a placeholder where a part is missing or wrong; the problem is
    recorded."""

    def read_array(name: str) -> FloatArray:
        """Read a dataset; an empty array where it is wrong."""
        shape = ARRAY_SHAPES.get(name, "(positions, 3)")
        return problems.attempt(lambda: read_float_dataset(file, name, shape), np.empty(0))

    def read_text(name: str) -> str:
        """Read a text attribute; "" where it is wrong."""
        return problems.attempt(lambda: read_text_attribute(file, name), "")

    def read_numbers(name: str, count: int) -> FloatArray:
        """Read an attribute of `count` numbers; zeros where it is wrong."""
        return np.array(problems.attempt(lambda: read_numbers_attribute(file, name, count), (0.0,) * count))

    provenance: dict[str, Any] = problems.attempt(lambda: read_provenance_attribute(file), {})
    return {
        **{name: read_text(name) for name in ("device", "details", "read_on")},
        **{name: read_array(name) for name in ARRAY_NAMES},
        **{name: read_numbers(name, 3) for name in ("line_deg", "asymmetry")},
        "difference": float(read_numbers("difference", 1)[0]),
        "provenance": provenance,
    }
