"""A column with a wrong field matters only where it is used: by the map, or by its name."""

import numpy as np
import pytest

from study.importing.map_format.map_errors import ImportRefusedError, MapNeededError
from study.workflows.recording.import_recording import read_foreign
from tests.recording_maps import built, map_text, refusal

N = 40
WRONG = "line 5, column 'column5': 'steady state error' is not a number"
CLOCK = 'time = "t"\ntime_unit = "s"'


def table(tmp_path, header, remark="steady state error"):
    """Far to the right stands a remark, and a number below it."""
    beside = {3: f";;{remark}", 4: ";;0,597"}
    rows = [f"{k / 50};{k % 7};{k % 5}{beside.get(k, ';;')}".replace(".", ",") for k in range(N)]
    path = tmp_path / "run.csv"
    path.write_text("\n".join((header, *rows)) + "\n")
    return path


def test_a_remark_beside_the_columns_of_a_map_is_left_out_and_said(tmp_path):
    path = table(tmp_path, "t;u;y;;")
    made = built(map_text(clock=CLOCK), path)
    np.testing.assert_array_equal(made.recording.command.samples[:, 0], [k % 7 for k in range(N)])
    assert any(note.startswith(f"Left out: {WRONG}") for note in made.notes)


@pytest.mark.parametrize("value", ["column5", "2 * column5", "array('column5')"])
def test_a_column_that_the_map_takes_is_refused_with_its_wrong_field(tmp_path, value):
    path = table(tmp_path, "t;u;y;;")
    text = map_text(clock=CLOCK).replace('value = "u"', f'value = "{value}"')
    assert WRONG in refusal(text, path).replace("Line", "line")


@pytest.mark.parametrize("name", ["", "remarks"])
def test_a_header_that_says_all_else_suffices(tmp_path, name):
    found = read_foreign((table(tmp_path, f"time [s];force [N];travel [mm];;{name}"),), None)
    assert len(found.recording) == N
    assert sum("'steady state error' is not a number" in note for note in found.notes) == 1
    assert not any("is no column" in note for note in found.notes)


@pytest.mark.parametrize("name", ["stroke [mm]", "temperature", "cmd", "current [A]"])
def test_a_signal_by_its_name_is_not_left_out(tmp_path, name):
    with pytest.raises(ImportRefusedError, match="'steady state error' is not a number"):
        read_foreign((table(tmp_path, f"time [s];force [N];travel [mm];;{name}"),), None)


@pytest.mark.parametrize("written", ["1,234,5", "1 234,5", "12:30", "3 mm"])
def test_a_number_in_another_notation_is_no_remark(tmp_path, written):
    path = table(tmp_path, "t;u;y;;enc", written)
    assert f"Line 5, column 'enc': '{written}' is not a number" in refusal(map_text(clock=CLOCK), path)


def test_a_wrong_field_does_not_decide_what_is_open(tmp_path):
    with pytest.raises(ImportRefusedError, match="'steady state error' is not a number"):
        read_foreign((table(tmp_path, "time [s];voltage [V];travel [mm];;current [A]"),), None)


def test_a_proposed_map_has_the_others_and_says_what_is_wrong(tmp_path):
    with pytest.raises(MapNeededError) as needed:
        read_foreign((table(tmp_path, "t;u;y;;"),), None)
    assert needed.value.skeleton.count("[[channel]]") == 2
    assert f"# Left out: {WRONG}" in needed.value.skeleton


def test_a_long_field_is_shortened_in_the_remark(tmp_path):
    path = table(tmp_path, "t;u;y;;", "x1" * 500)
    made = built(map_text(clock=CLOCK), path)
    assert max(map(len, made.notes)) < 300


def test_a_column_of_words_is_named_where_without_it_a_map_is_needed(tmp_path):
    rows = "".join(f"{k / 100},{k % 7},- {k % 5}.5\n" for k in range(40))
    (tmp_path / "a.csv").write_text(f"time [s],force [N],position [mm]\n{rows}")
    with pytest.raises(MapNeededError, match=r"; left out: 'position \[mm\]' holds words, not numbers\."):
        read_foreign((tmp_path / "a.csv",), None)


@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_column_of_words_and_a_line_of_words_below_the_rows_are_both_left_out(tmp_path, mark):
    rows = [f"{k / 50:.2f};{k % 7};{k % 5},5;{'warm' if k % 3 else 'ok'}".replace(".", ",") for k in range(N)]
    lines = ("time [s];force [N];position [mm];state", *rows, "End of file")
    (tmp_path / "a.csv").write_text("\n".join(lines).replace(";", mark))
    found = read_foreign((tmp_path / "a.csv",), None)
    np.testing.assert_allclose(found.recording.response.samples[:, 0], [(k % 5 + 0.5) / 1000 for k in range(N)])
    assert "Left out: 'state' holds words, not numbers." in found.notes
    assert f"Left out: line {N + 2}, 'End of file'." in found.notes
