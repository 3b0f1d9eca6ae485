"""Files that are one call each: what they add to the pure readers and writers is the disk and its errors."""

from dataclasses import fields

import numpy as np
import pytest

from analysis.diagnosis.document import diagnosis_from_json
from equalizer.plant.mechanical_model import ActuatorLimits, SensorLimits, Tolerance
from equalizer.plant.mechanical_model_toml import MATRIX_KEYS, parse_mechanical_model
from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.trajectory import Trajectory
from study.store.disk.file_errors import AlreadyExistsError, CannotReadError, UnusableFileError
from study.store.disk.provenance import gather_provenance
from study.store.disk.text_file import read_text, write_text
from study.store.formats.diagnosis_file import read_diagnosis, write_diagnosis
from study.store.formats.mechanical_model_file import LAYOUT, read_mechanical_model, write_mechanical_model
from study.store.formats.trajectory_file import read_trajectory, write_trajectory

ERRORS = {"before": 0.1, "retuned": 0.1, "after": 0.1, "noise": 0.1}
NOTHING = {
    "verdict": "no_mismatch", "mismatch": [], "effects": [], "retuned": {}, "remainder": [],
    "fit": {"fit": ERRORS, "test": ERRORS}, "error": "free simulation", "next_experiment": None,
}  # fmt: skip
MODEL = """[model]
name = "lever"
quantity = "angle"
rotational = true
mass = [[5.8e-4]]
damping = [[1e-3]]
stiffness = [[0]]
input = [[1]]
output = [[1]]
"""


def test_text_is_written_as_it_is_and_read_without_its_mark(tmp_path):
    write_text(tmp_path / "a.txt", "µ\n")
    assert (tmp_path / "a.txt").read_bytes() == b"\xc2\xb5\n"
    (tmp_path / "b.txt").write_bytes(b"\xef\xbb\xbfone")
    assert read_text(tmp_path / "b.txt") == "one"


def test_what_cannot_be_read_is_named(tmp_path):
    (tmp_path / "a.txt").write_bytes(b"ab\xff")
    with pytest.raises(
        CannotReadError, match=r"a\.txt cannot be read. It is neither HDF5 nor text in UTF-8 \(byte 2\)"
    ):
        read_text(tmp_path / "a.txt")
    for user_block in (b"", b"seal".ljust(512, b"\0")):
        (tmp_path / "a.h5").write_bytes(user_block + b"\x89HDF\r\n\x1a\n")
        with pytest.raises(CannotReadError, match=r"It is an HDF5 file, and text is expected here"):
            read_text(tmp_path / "a.h5")
    with pytest.raises(CannotReadError, match=r"There is no file .*none. Check the name and the folder"):
        read_text(tmp_path / "none")
    with pytest.raises(CannotReadError, match=r".* is a folder"):
        read_text(tmp_path)


def test_rights_and_other_trouble_are_reported(tmp_path):
    assert CannotReadError(tmp_path, PermissionError()).happened == f"You have no right to read {tmp_path}."
    assert (
        CannotReadError(tmp_path, OSError(5, "Input/output error")).happened == "The system says: Input/output error."
    )


def test_a_mechanical_model_goes_to_disk_and_back(tmp_path):
    model = parse_mechanical_model(MODEL)
    write_mechanical_model(tmp_path / "m.toml", model)
    assert read_mechanical_model(tmp_path / "m.toml").mass == model.mass
    with pytest.raises(AlreadyExistsError):
        write_mechanical_model(tmp_path / "m.toml", model)


def test_a_faulty_mechanical_model_is_an_error_of_the_study(tmp_path):
    (tmp_path / "m.toml").write_text(MODEL.replace("mass", "maas"))
    with pytest.raises(UnusableFileError, match=r"m\.toml is not a usable mechanical model. Unknown key 'model.maas'"):
        read_mechanical_model(tmp_path / "m.toml")


def test_the_documented_keys_of_a_mechanical_model_are_those_that_are_read():
    tables = {"model": None, "sensor": SensorLimits, "actuator": ActuatorLimits, "tolerance": Tolerance}
    read = {f"{table}.{part.name}" for table, kind in tables.items() if kind for part in fields(kind)}
    read |= {f"model.{name}" for name in ("name", "quantity", "rotational", *MATRIX_KEYS)}
    assert {entry.name for entry in LAYOUT if entry.name.split(".")[0] in tables} == read


def test_a_trajectory_goes_to_disk_and_back(tmp_path):
    wanted = Trajectory(Signal(np.eye(3), 1000.0, "acceleration", "m/s^2", ("ax", "ay", "az")), 2.0)
    write_trajectory(tmp_path / "t.csv", wanted)
    read = read_trajectory(tmp_path / "t.csv")
    assert np.array_equal(read.signal.samples, wanted.signal.samples)
    (tmp_path / "t.csv").write_text("t,x\n")
    with pytest.raises(UnusableFileError, match="Line 1 reads 't,x'; allowed is time_s,ax,ay,az or time_s,fx,fy,fz"):
        read_trajectory(tmp_path / "t.csv")


def test_a_diagnosis_goes_to_disk_and_back_with_its_provenance(tmp_path):
    diagnosis = diagnosis_from_json(NOTHING)
    write_diagnosis(tmp_path / "d.json", diagnosis, gather_provenance())
    assert '"provenance"' in (tmp_path / "d.json").read_text()
    assert read_diagnosis(tmp_path / "d.json") == diagnosis
    (tmp_path / "d.json").write_text('{"format": "hapteq-diagnosis", "version": 1}')
    with pytest.raises(UnusableFileError, match=r"d\.json is not a usable diagnosis. verdict: this is missing"):
        read_diagnosis(tmp_path / "d.json")
