"""Calibrations are read as they were written; what was damaged or cannot be is refused in words."""

import h5py
import numpy as np
import pytest

from study.store.disk.file_errors import UnusableFileError
from study.store.formats.calibration_file import LAYOUT, read_calibration, write_calibration
from study.workflows.files.validate import validate_file
from tests.equalizer.linkage.truth import calibration, readings


@pytest.fixture
def path(tmp_path):
    write_calibration(tmp_path / "cal.h5", calibration(readings(), provenance={"command": ["hapteq"]}))
    return tmp_path / "cal.h5"


def test_what_was_written_is_read(path):
    written, read = calibration(readings()), read_calibration(path)
    for name in ("position_m", "joint_angle_rad", "jacobian", "inertia_kg", "gravity_n", "filled", "line_deg"):
        np.testing.assert_array_equal(getattr(read, name), getattr(written, name))
    assert (read.device, read.read_on, read.difference) == ("invented", "2026-11-27", 0.0)
    assert read.provenance == {"command": ["hapteq"]}


def test_the_file_holds_what_its_table_says(path):
    with h5py.File(path) as file:
        assert {entry.name for entry in LAYOUT} == {*file.keys(), *file.attrs.keys()}
        assert all(file[name].fletcher32 for name in file)


def test_it_is_recognised(path):
    found = validate_file(path)
    assert found.problems == () and found.kind.startswith("calibration of the linkage of invented, 185 positions")


def test_a_changed_byte_is_noticed(path):
    with h5py.File(path) as file:
        offset = file["inertia_kg"].id.get_chunk_info(0).byte_offset
    content = bytearray(path.read_bytes())
    content[offset + 100] ^= 1
    path.write_bytes(content)
    with pytest.raises(UnusableFileError):
        read_calibration(path)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("inertia_kg", np.full((185, 3, 3), np.nan), "no number"),
        ("inertia_kg", np.zeros((3, 3)), "must be"),
        ("jacobian", np.zeros((184, 3, 3)), "one entry for each"),
        ("gravity_n", np.zeros((185, 3), int), "float32 or float64"),
    ],
)
def test_wrong_arrays_are_refused(path, name, value, said):
    with h5py.File(path, "r+") as file:
        del file[name]
        file[name] = value
    with pytest.raises(UnusableFileError, match=said):
        read_calibration(path)


def test_missing_attributes_are_all_named(path):
    with h5py.File(path, "r+") as file:
        del file.attrs["device"], file.attrs["line_deg"]
    with pytest.raises(UnusableFileError, match="'device' is missing.*'line_deg' is missing"):
        read_calibration(path)
