"""Calibrations are read as they were written; what was damaged or cannot be is refused in words."""

import h5py
import numpy as np
import pytest

from study.store.disk.file_errors import UnusableFileError
from study.store.disk.hdf5_file import USER_BLOCK_BYTES, add_seal
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


@pytest.fixture
def no_library(monkeypatch):
    """The HDF5 library, which may hang on a damaged file, must not see it."""

    def opened(*arguments, **named):
        raise AssertionError("the library was asked")

    monkeypatch.setattr(h5py, "File", opened)


def test_a_changed_byte_is_noticed_by_the_array_s_own_check_sum_too(path):
    with h5py.File(path) as file:
        offset = USER_BLOCK_BYTES + file["inertia_kg"].id.get_chunk_info(0).byte_offset
    content = bytearray(path.read_bytes())
    content[offset + 100] ^= 1
    path.write_bytes(add_seal(bytes(content)))
    with pytest.raises(UnusableFileError, match="can be read"):
        read_calibration(path)


@pytest.mark.parametrize("seed", range(8))
def test_mutated_files_are_refused_at_once_and_never_reach_the_hdf5_library(path, no_library, seed):
    random, sound = np.random.default_rng(seed), path.read_bytes()
    for _ in range(40):
        mutated = bytearray(sound)
        for place in random.integers(
            USER_BLOCK_BYTES if random.random() < 0.9 else 0, len(sound), random.choice([1, 1, 4, 30])
        ):
            mutated[place] ^= 1 << int(random.integers(8))
        del mutated[int(random.choice([len(sound), random.integers(USER_BLOCK_BYTES, len(sound))])) :]
        path.write_bytes(mutated)
        if bytes(mutated) != sound:
            with pytest.raises(UnusableFileError, match="damaged, cut off, or changed"):
                read_calibration(path)


def test_a_file_without_its_seal_s_first_byte_is_no_file_without_a_seal(path, no_library):
    path.write_bytes(b"x" + path.read_bytes()[1:])
    with pytest.raises(UnusableFileError, match="damaged, cut off, or changed"):
        read_calibration(path)


def test_validate_says_that_a_mutated_file_is_damaged(path):
    content = bytearray(path.read_bytes())
    content[2000] ^= 8
    path.write_bytes(content)
    assert "damaged, cut off, or changed" in validate_file(path).problems[0]


def test_a_calibration_that_another_program_wrote_needs_no_seal(path):
    path.write_bytes(path.read_bytes()[USER_BLOCK_BYTES:])
    assert read_calibration(path).device == "invented"


def test_other_readers_of_hdf5_read_past_the_seal(path):
    with h5py.File(path) as file:
        assert file.userblock_size == USER_BLOCK_BYTES
        assert file.attrs["format"] == "hapteq-calibration"


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("inertia_kg", np.full((185, 3, 3), np.nan), "not a number"),
        ("inertia_kg", np.zeros((3, 3)), "must be"),
        ("jacobian", np.zeros((184, 3, 3)), "one entry for each"),
        ("gravity_n", np.zeros((185, 3), int), "float32 or float64"),
    ],
)
def test_wrong_arrays_are_refused(path, name, value, said):
    with h5py.File(path, "r+") as file:
        del file[name]
        file[name] = value
    path.write_bytes(add_seal(path.read_bytes()))
    with pytest.raises(UnusableFileError, match=said):
        read_calibration(path)


def test_missing_attributes_are_all_named(path):
    with h5py.File(path, "r+") as file:
        del file.attrs["device"], file.attrs["line_deg"]
    path.write_bytes(add_seal(path.read_bytes()))
    with pytest.raises(UnusableFileError, match="'device' is missing.*'line_deg' is missing"):
        read_calibration(path)
