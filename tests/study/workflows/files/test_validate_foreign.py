"""Recordings of others are checked as an import would read them."""

import json

import h5py
import numpy as np
import pytest
from openpyxl import Workbook

from study.workflows.files.validate import validate_file
from study.workflows.recording.read_any_recording import read_any_recording

NAMES = ("time [s]", "force [N]", "speed [mm/s]")
ROWS = [(k / 100, float(k % 7), float(k % 5)) for k in range(50)]
KIND = "recording of others, 0.5 s at 100 Hz, 1 command, 1 response"


def write(path, names=NAMES):
    records = [dict(zip(names, row, strict=True)) for row in ROWS]
    match path.suffix:
        case ".xlsx":
            book = Workbook()
            for row in (names, *ROWS):
                book.active.append(row)
            book.save(path)
        case ".json":
            path.write_text(json.dumps(records))
        case ".npz":
            np.savez(path, **dict(zip(names, np.array(ROWS).T, strict=True)))
        case _:
            path.write_text("\n".join(";".join(map(str, row)) for row in (names, *ROWS)))
    return path


@pytest.mark.parametrize("name", ["a.csv", "a.txt", "a.xlsx", "a.json", "a.npz"])
def test_a_recording_of_others_is_described_with_what_an_import_would_say(tmp_path, name):
    found = validate_file(write(tmp_path / name))
    assert (found.kind, found.problems) == (KIND, ())
    assert found.notes[0] == "Taken from the header: force as command, speed as response."


@pytest.mark.parametrize("name", ["a.csv", "a.xlsx", "a.json", "a.npz"])
def test_an_unknown_unit_is_found(tmp_path, name):
    found = validate_file(write(tmp_path / name, ("time [s]", "force [Newt]", "speed [mm/s]")))
    assert any("'Newt' is not a unit known here (did you mean 'N'?)" in problem for problem in found.problems)
    assert len(found.problems) == (2 if name in ("a.csv", "a.json") else 1)


@pytest.mark.parametrize(("name", "content"), [("a.xlsx", b"PK"), ("a.mat", b""), ("a.csv", b"\0\1"), ("a.json", b"{")])
def test_what_cannot_be_read_has_a_problem_and_no_crash(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    assert validate_file(tmp_path / name).problems


def test_a_document_that_says_a_format_is_not_read_as_a_table(tmp_path):
    (tmp_path / "a.json").write_text(json.dumps({"format": "another", "t": [0, 1], "u": [1, 2]}))
    found = validate_file(tmp_path / "a.json")
    assert found.problems == ("Its format, 'another', is not known here.",)


@pytest.mark.parametrize("encoding", ["cp1252", "utf-16"])
def test_a_table_in_another_encoding_is_read_as_by_an_import(tmp_path, encoding):
    rows = "\n".join(";".join(map(str, row)) for row in (("time [s]", "force [N]", "angle [°]"), *ROWS))
    (tmp_path / "a.csv").write_bytes(rows.encode(encoding))
    assert (found := validate_file(tmp_path / "a.csv")).problems == ()
    assert found.kind == KIND


def test_a_table_of_others_may_begin_with_the_time_of_our_own_tables(tmp_path):
    found = validate_file(write(tmp_path / "a.txt", ("time_s", "force_N", "speed_mm/s")))
    (tmp_path / "b.csv").write_text("time_s,force_N,speed_mm/s\n" + "\n".join(",".join(map(str, r)) for r in ROWS))
    assert [(each.kind, each.problems) for each in (found, validate_file(tmp_path / "b.csv"))] == [(KIND, ())] * 2


@pytest.mark.parametrize("name", ["a.h5", "a.json"])
def test_a_recording_of_others_may_state_a_format(tmp_path, name):
    columns = dict(zip(("t_s", "force_N", "speed_rpm"), np.array(ROWS).T, strict=True))
    if name == "a.json":
        (tmp_path / name).write_text(json.dumps({"format": "lab 2", **{key: list(v) for key, v in columns.items()}}))
    else:
        with h5py.File(tmp_path / name, "w") as file:
            file.attrs["format"] = "lab 2"
            for key, samples in columns.items():
                file[key] = samples
    found = validate_file(tmp_path / name)
    assert (found.kind, found.problems) == (KIND, ())
    assert read_any_recording(tmp_path / name)[0].sample_rate_hz == 100


def test_a_file_in_an_unknown_format_of_hapteq_is_no_recording_of_others(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.attrs["format"] = "hapteq-later"
        for key, samples in zip(("t_s", "force_N", "speed_rpm"), np.array(ROWS).T, strict=True):
            file[key] = samples
    found = validate_file(tmp_path / "a.h5")
    assert (found.kind, len(found.problems)) == ("HDF5 file", 1)
    assert "calls itself 'hapteq-later'" in found.problems[0]
