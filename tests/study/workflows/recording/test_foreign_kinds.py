"""Workbooks and JSON of other programs go in wherever a recording is read."""

import json

import numpy as np
import pytest
from openpyxl import Workbook

from study.workflows.recording.import_recording import ImportPlan, import_recording
from study.workflows.recording.read_any_recording import read_any_recording

NAMES = ("time [s]", "force [N]", "speed [mm/sec]")
ROWS = [(k / 100, float(k % 7), float(k % 5)) for k in range(60)]


def _workbook(path):
    book = Workbook()
    for row in (NAMES, *ROWS):
        book.active.append(row)
    book.save(path)


def _records(path):
    path.write_text(json.dumps([dict(zip(NAMES, row, strict=True)) for row in ROWS]))


def _lines(path):
    path.write_text("\n".join(json.dumps(dict(zip(NAMES, row, strict=True))) for row in ROWS))


def _trailing(path):
    path.write_text("\n".join(",".join(map(str, row)) + "," for row in (NAMES, *ROWS, ROWS[-1])))


@pytest.mark.parametrize(
    ("name", "write"), [("a.xlsx", _workbook), ("a.json", _records), ("a.jsonl", _lines), ("a.csv", _trailing)]
)
def test_a_file_of_a_stranger_is_read_and_imported(tmp_path, name, write):
    write(tmp_path / name)
    found, notes = read_any_recording(tmp_path / name)
    imported = import_recording(ImportPlan((tmp_path / name,), None, tmp_path / "r.h5"))
    for recording in (found, imported.recording):
        assert recording.sample_rate_hz == 100
        np.testing.assert_array_equal(recording.command.samples[:, 0], [row[1] for row in ROWS])
        np.testing.assert_allclose(recording.response.samples[:, 0], [row[2] / 1000 for row in ROWS])
    assert any("1 row logged twice" in note for note in notes) == (name == "a.csv")


def test_recordings_that_are_joined_keep_their_parts(tmp_path):
    for number in (1, 2, 3):
        _records(tmp_path / f"run_{number}.json")
    runs = tuple(tmp_path / f"run_{number}.json" for number in (1, 2, 3))
    import_recording(ImportPlan(runs[:2], None, tmp_path / "a.h5"))
    import_recording(ImportPlan(runs[2:], None, tmp_path / "b.h5"))
    joined = import_recording(ImportPlan((tmp_path / "a.h5", tmp_path / "b.h5"), None, tmp_path / "r.h5")).recording
    assert [(part["file"], part["start"], part["stop"]) for part in joined.meta["parts"]] == [
        ("run_1.json", 0, 60), ("run_2.json", 60, 120), ("run_3.json", 120, 180),
    ]  # fmt: skip
