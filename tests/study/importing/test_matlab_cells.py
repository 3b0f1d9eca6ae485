"""Cells of Matlab: a run in each, where their arrays are alike; what else they and objects hold is not offered."""

import struct

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from study.importing.arrays.read_arrays import read_arrays
from study.importing.header_map import find_header_problems
from study.importing.map_format.import_map import CsvMap
from study.importing.map_skeleton import make_map_skeleton
from study.workflows.recording.import_recording import read_foreign
from tests.recording_maps import built, map_text, refusal

N = 60
RUNS = [np.sin(np.arange(N + k) / (k + 3)) for k in range(5)]
OTHERS = {
    "texts": ["a", "b"],
    "numbers and texts": [RUNS[0], "b"],
    "complex numbers": [RUNS[0] * 1j, RUNS[1]],
    "nothing in the second": [RUNS[0], np.zeros((0, 0))],
    "a row and a table": [RUNS[0], np.zeros((N, 3))],
    "tables of two widths": [np.zeros((N, 2)), np.zeros((N, 3))],
}


def cell(arrays):
    found = np.empty((len(arrays), 1), dtype=object)
    for place, array in enumerate(arrays):
        found[place, 0] = array
    return found


def written(tmp_path, **variables):
    savemat(tmp_path / "a.mat", variables)
    return tmp_path / "a.mat"


def test_each_array_of_a_cell_is_a_run_of_its_own(tmp_path):
    path = written(tmp_path, force=cell(RUNS[:3]), place=cell([2 * run for run in RUNS[:3]]), one=cell(RUNS[:1]))
    found = read_arrays(path, CsvMap()).by_name
    assert list(found) == [f"{k}-of-3/{name}" for name in ("force", "place") for k in (1, 2, 3)] + ["one"]
    np.testing.assert_array_equal(found["2-of-3/place"], 2 * RUNS[1])


def test_runs_whose_names_say_all_are_parts(tmp_path):
    cells = {"force_N": RUNS[:3], "stroke_mm": RUNS[:3], "time_s": [np.arange(len(run)) / 50 for run in RUNS[:3]]}
    found = read_foreign((written(tmp_path, **{name: cell(runs) for name, runs in cells.items()}),), None)
    assert [(part["start"], part["stop"]) for part in found.recording.meta["parts"]] == [(0, 60), (60, 121), (121, 183)]
    np.testing.assert_allclose(found.recording.response.samples[121:, 0], RUNS[2] / 1e3)


def test_a_proposed_map_takes_the_longer_cells_and_says_how_to_add_the_others(tmp_path):
    path = written(tmp_path, u=cell(RUNS[:3]), y=cell(RUNS[:3]), u_test=cell(RUNS[3:]), y_test=cell(RUNS[3:]))
    text = make_map_skeleton(read_arrays(path, CsvMap()))
    assert [text.count(mark) for mark in ("[[channel]]", "\n[[part]]", "\n[[clock]]")] == [2, 3, 1]
    assert 'prefix = "2-of-2/" and let = { u = "u_test", y = "y_test" }' in text
    parts = '\n[[part]]\nprefix = "3-of-3/"\n[[part]]\nprefix = "2-of-2/"\nlet = { u = "u_test", y = "y_test" }\n'
    made = built(map_text(end=parts), path).recording
    np.testing.assert_array_equal(made.command.samples[:, 0], np.concatenate([RUNS[2], RUNS[4]]))


def test_cells_of_other_lengths_are_not_taken_for_each_other(tmp_path):
    path = written(tmp_path, u=cell(RUNS[:2]), y=cell(RUNS[:3]), y_ref=cell(RUNS[:2]))
    text = make_map_skeleton(read_arrays(path, CsvMap()))
    assert "in cells of another length: " in text
    assert "let =" not in text


def test_a_cell_of_single_numbers_holds_constants(tmp_path):
    path = written(tmp_path, gains=cell([1.0, 2.0]), u=RUNS[0], y=RUNS[0])
    text = make_map_skeleton(read_arrays(path, CsvMap()))
    assert "# 1-of-2/gains: one number, a constant for expressions" in text
    assert [text.count(mark) for mark in ("[[channel]]", "[[part]]")] == [2, 0]


@pytest.mark.parametrize("held", OTHERS)
def test_a_cell_of_anything_else_is_named_with_what_to_do(tmp_path, held):
    path = written(tmp_path, u=cell(OTHERS[held]), y=RUNS[0])
    said = refusal(map_text(), path)
    assert "the array 'u' in a.mat holds text or objects, not real numbers: it is a cell" in said
    assert "in Matlab: u_1 = u{1}" in said
    assert "# in Matlab: u_1 = u{1}" in make_map_skeleton(read_arrays(path, CsvMap()))


def test_a_cell_that_says_more_than_it_holds_is_refused(tmp_path):
    path = written(tmp_path, u=cell(RUNS[:2]))
    path.write_bytes(path.read_bytes().replace(struct.pack("<ii", 2, 1), struct.pack("<ii", 2**20, 1), 1))
    assert "a cell of 1048576 arrays is longer than the rest of the file" in refusal(map_text(), path).lower()


def element(kind, content):
    return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)


def test_what_objects_hold_is_not_offered_as_a_signal(tmp_path):
    held = element(6, struct.pack("<II", 9, 0)) + element(5, struct.pack("<ii", 1, 99)) + element(1, b"")
    path = written(tmp_path, dt=0.01)
    path.write_bytes(path.read_bytes() + element(14, held + element(2, bytes(99))))
    arrays = read_arrays(path, CsvMap())
    assert list(arrays.by_name) == ["dt"]
    assert find_header_problems(arrays) == ("it holds no arrays of numbers",)


def test_cells_and_objects_of_the_later_format_are_named(tmp_path):
    with h5py.File(tmp_path / "a.mat", "w") as file:
        file["u"], file["y"], file["held"] = np.zeros(4, "u8"), np.zeros((1, 6), "u4"), RUNS[0]
        file["u"].attrs["MATLAB_class"] = np.bytes_("cell")
        file["y"].attrs.update(MATLAB_class=np.bytes_("timeseries"), MATLAB_object_decode=3)
    text = make_map_skeleton(read_arrays(tmp_path / "a.mat", CsvMap()))
    assert "# u holds no numbers: it is a cell, which is read where the file was saved with -v7" in text
    assert "# y holds no numbers: it is an object of the class timeseries\n# in Matlab: y = struct('time'" in text


def test_a_proposed_map_quotes_the_labels_of_a_file(tmp_path):
    """They say what was measured. A line of theirs never becomes a line of the map."""
    label = "Lever angle (rad), a cell\nrole = 'command'"
    savemat(tmp_path / "a.mat", {"y": RUNS[0], "y_label": label, "long": "m" * 200, "micro": "µm"})
    with h5py.File(tmp_path / "b.mat", "w") as file:
        file["y"], file["y_label"] = RUNS[0], np.frombuffer(label.encode("utf-16-le"), "u2")[:, None]
        file["y_label"].attrs["MATLAB_class"] = np.bytes_("char")

    later, earlier = (make_map_skeleton(read_arrays(tmp_path / name, CsvMap())) for name in ("b.mat", "a.mat"))

    for text in (later, earlier):
        assert "# y_label holds no numbers: it is the text 'Lever angle (rad), a cell'\n\n" in text
        assert "\nrole = 'command'" not in text
        assert "in Matlab" not in text
    assert f"it is the text '{'m' * 80} ...'" in earlier
    assert "it is the text 'µm'" in earlier
