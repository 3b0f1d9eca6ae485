"""Tables as loggers really write them: delimiters at line ends, words beside numbers, cells that say "nothing"."""

import re

import numpy as np
import pytest

from study.importing.arrays.csv_arrays import convert_times
from study.importing.header_map import find_header_problems, make_header_map
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError
from tests.whole_arrays import read_whole

VALUES = [[0.0, 1.5], [1.0, 2.5], [2.0, -3.5]]


def read(tmp_path, text, settings=CsvMap()):  # noqa: B008
    (tmp_path / "a.csv").write_text(text)
    return read_whole(tmp_path / "a.csv", settings)


def table(delimiter, end, head_end="", decimal="."):
    rows = [delimiter.join(str(value).replace(".", decimal) for value in row) + end for row in VALUES]
    return "\n".join([delimiter.join(("t", "u")) + head_end, *rows]) + "\n"


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|"])
@pytest.mark.parametrize("ends", [("{}", ""), ("{}", "{}"), ("{}{}{}", "{}{}{}"), ("{} ", "{} "), ("{}{}", "{}")])
def test_delimiters_at_the_end_of_lines_are_no_columns(tmp_path, delimiter, ends):
    body, head = (end.replace("{}", delimiter) for end in ends)
    found = read(tmp_path, table(delimiter, body, head)).by_name
    assert list(found) == ["t", "u"]
    np.testing.assert_array_equal(np.stack(list(found.values()), axis=1), VALUES)


def test_decimal_commas_with_a_delimiter_at_line_ends(tmp_path):
    found = read(tmp_path, table(";", ";", decimal=",")).by_name
    np.testing.assert_array_equal(np.stack(list(found.values()), axis=1), VALUES)


def test_a_last_column_that_is_named_but_empty_stays(tmp_path):
    found = read(tmp_path, "t,u,v\n0,1.5,\n1,2.5,\n2,-3.5,\n").by_name
    assert list(found) == ["t", "u", "v"]
    assert np.isnan(found["v"]).all()


@pytest.mark.parametrize(
    "empty", ["", "NaN", "-nan", "N/A", "#N/A", "n.a.", "null", "None", "--", "1.#QNAN", "-1.#IND"]
)
def test_a_cell_that_says_nothing_is_a_missing_sample(tmp_path, empty):
    found = read(tmp_path, f"t,u\n0,1.5\n1,{empty}\n2,-3.5\n").by_name
    np.testing.assert_array_equal(found["u"], [1.5, np.nan, -3.5])


@pytest.mark.parametrize("words", [("ok", "ok", "late"), ("Rig 3", "Rig 3", "Rig 3"), ("3a", "3b", "3c")])
def test_a_column_of_words_is_left_out_with_a_note(tmp_path, words):
    rows = "\n".join(f"{t},{word},{u}" for (t, u), word in zip(VALUES, words, strict=True))
    found = read(tmp_path, f"t,state,u\n{rows}\n")
    assert list(found.by_name) == ["t", "u"]
    assert found.notes == ("Left out: 'state' holds words, not numbers.",)


@pytest.mark.parametrize("cell", ["1.234,5", "12:3", "3 mm", "1 2", "5%"])
def test_a_number_that_is_not_understood_is_no_word(tmp_path, cell):
    rows = "\n".join(f"{t},{u},{cell}" for t, u in VALUES).replace("1.234,5", '"1.234,5"')
    with pytest.raises(ImportRefusedError, match="is not a number"):
        read(tmp_path, f"t,u,v\n{rows}\n")


def test_a_number_in_a_column_of_words_is_refused(tmp_path):
    with pytest.raises(ImportRefusedError, match="Line 3: column 'state' holds words elsewhere"):
        read(tmp_path, "t,state,u\n0,ok,1\n1,5,2\n2,ok,3\n3,ok,4\n4,ok,5\n5,ok,6\n")


@pytest.mark.parametrize("text", ["t;u\n0;1.234,5\n1;2,5\n", "t;u\n0;1'234.5\n1;2.5\n", "t\tu\n0\t1 234.5\n1\t2.5\n"])
def test_signs_between_thousands_are_refused_with_what_mends_them(tmp_path, text):
    with pytest.raises(ImportRefusedError, match="write numbers without signs between thousands"):
        read(tmp_path, text)


ROWS = "\n".join(f"{k / 100},{k % 3},{k % 5}" for k in range(20))


@pytest.mark.parametrize(
    ("header", "units"),
    [
        ("time [sec],force [gf],accel [m/sec2]", ("s", "gf", "m/s^2")),
        ("Time (msec),Torque (kgf·cm),Speed (RPM)", ("ms", "kgf cm", "rpm")),
        ("time / s,torque / oz-in,angle / °", ("s", "ozf in", "deg")),
        ('"time, s","force, lbf","speed, in/sec"', ("s", "lbf", "in/s")),
        ("time in s,force in use / N,speed in m / s", ("s", "N", "m/s")),
        ("Elapsed Time (s),Load (N),Displacement (μm)", ("s", "N", "um")),
        ("index,time [s],force [N],angle [deg]", None),
    ],
)
def test_headers_of_strangers_need_no_map(tmp_path, header, units):
    rows = ROWS if units else "\n".join(f"{k},{row}" for k, row in enumerate(ROWS.splitlines()))
    wanted = make_header_map(read(tmp_path, f"{header}\n{rows}\n"))
    assert wanted is not None
    found = (wanted.clock[0].time_unit, *(channel.unit for channel in wanted.channel))
    assert found == (units or ("s", "N", "deg"))


@pytest.mark.parametrize(
    ("column", "said"),
    [
        ("force [Newt]", "'Newt' is not a unit known here (did you mean 'N'?)"),
        ("force [pound]", "'pound' is not a unit known here (did you mean 'lbf'?)"),
        ("force [g]", "grams as a force are written gf"),
        ("force [kg]", "as a force write lbf, ozf or kgf"),
        ("force [furlong]", "'furlong' is not a unit known here"),
    ],
)
def test_a_unit_that_is_unclear_is_refused_by_name(tmp_path, column, said):
    found = find_header_problems(read(tmp_path, f"time [s],{column},angle [deg]\n{ROWS}\n"))
    assert any(said in problem for problem in found)


@pytest.mark.parametrize("below", ["End of file", "*** stopped by hand ***", "end;;", "\n\nSaved\nBye"])
def test_words_below_the_last_row_are_left_out_with_a_note(tmp_path, below):
    found = read(tmp_path, f"{table(';', '')}{below}\n")
    np.testing.assert_array_equal(np.stack(list(found.by_name.values()), axis=1), VALUES)
    assert len(found.notes) == len([line for line in below.splitlines() if line])
    assert all(note.startswith("Left out: line ") for note in found.notes)


@pytest.mark.parametrize("row", ["2;", "3;4;5", "3;x;5"])
def test_a_row_below_that_holds_numbers_is_refused(tmp_path, row):
    with pytest.raises(ImportRefusedError, match=r"Line 5"):
        read(tmp_path, f"{table(';', '')}{row}\n".replace("2;\n", "2\n"))


LOGGED = (
    "Rate: 10\nNo, time [s], force [N], Events\n1, 0, 1.5, started\n2, 0.1, -2\n3, 0.2, 3, paused, stopped\n4, 0.3, 4\n"
)


def test_events_at_the_ends_of_some_rows_are_a_column_of_words(tmp_path):
    found = read(tmp_path, LOGGED)
    assert list(found.by_name) == ["No", "time [s]", "force [N]"]
    np.testing.assert_array_equal(found.by_name["force [N]"], [1.5, -2, 3, 4])
    assert any("'Events' holds words" in note for note in found.notes)


@pytest.mark.parametrize(
    "text",
    [
        LOGGED.replace(", started", "").replace(", paused, stopped", ""),  # the header may name a column too many
        LOGGED.replace(", Events", ""),
        LOGGED.replace("paused", "7"),
        LOGGED.replace("4, 0.3, 4", "4, 0.3"),
        LOGGED + "5, 0.4, 5, stopped, 7\n",
        LOGGED.replace("force [N]", "force, N"),  # without the unit's column, events would give the names
    ],
)
def test_rows_are_not_completed_by_guess(tmp_path, text):
    with pytest.raises(ImportRefusedError, match="Line [0-9]+ has [0-9] fields"):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "delimiter", "expected"),
    [
        ('t,"F, N"\n0,1\n1,"1,5"\n2,2\n3,3\n', "", {"t": [0, 1, 2, 3], "F, N": [1, 1.5, 2, 3]}),
        ('t,u,"note, text"\n0,1,ok\n1,2,"a, b"\n2,2,ok\n3,3,ok\n', "", {"t": [0, 1, 2, 3], "u": [1, 2, 2, 3]}),
        ("t    u   y\n 0   5   3\n 1   -5    3\n 2   2   4\n", " ", {"t": [0, 1, 2], "u": [5, -5, 2], "y": [3, 3, 4]}),
    ],
)
def test_rows_of_more_delimiters_but_no_more_fields_keep_their_fields(tmp_path, text, delimiter, expected):
    found = read(tmp_path, text, CsvMap(delimiter=delimiter)).by_name
    assert {name: column.tolist() for name, column in found.items()} == expected


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|"])
@pytest.mark.parametrize("above", ["", "Rig 3\n", "# Rig 3\n"])
@pytest.mark.parametrize("end", ["", "{}"])
def test_a_mark_of_comments_may_be_the_name_of_a_column(tmp_path, delimiter, above, end):
    end = end.replace("{}", delimiter)
    rows = [delimiter.join(map(str, (k, *row))) + end for k, row in enumerate(VALUES)]
    head = delimiter.join(("#", "t", "u"))
    assert list(read(tmp_path, f"{above}{head}\n" + "\n".join(rows)).by_name) == ["#", "t", "u"]


@pytest.mark.parametrize(("cells", "open_sign"), [(("946", "1.886", "-12.004"), True), (("1.886", "2.004"), False),
                                                  (("946", "0.886"), False), (("946", "1.88"), False)])  # fmt: skip
def test_points_that_may_separate_thousands_are_refused_until_the_map_states_the_decimal_sign(
    tmp_path, cells, open_sign
):
    text = "t;u\n" + "".join(f"{k};{cell}\n" for k, cell in enumerate(cells))
    if open_sign:
        with pytest.raises(ImportRefusedError, match=r"point in '1\.886' may separate thousands"):
            read(tmp_path, text)
    found = read(tmp_path, text, CsvMap(decimal=".")).by_name["u"]
    np.testing.assert_array_equal(found, [float(cell) for cell in cells])


def test_a_first_row_with_a_wrong_cell_does_not_become_the_header(tmp_path):
    with pytest.raises(ImportRefusedError, match="Line 3, column 'u \\[N\\]': '1'234' is not a number"):
        read(tmp_path, "t;u\ns;N\n0;1'234\n1;2'345\n2;300\n")


@pytest.mark.parametrize("error", ["#DIV/0!", "#REF!", "#VALUE!", "#NAME?", "#NUM!", "#NULL!"])
@pytest.mark.parametrize("row", [0, 2])
def test_an_error_of_a_spreadsheet_is_no_comment(tmp_path, error, row):
    rows = [f"{k / 8},{k}" for k in range(40)]
    rows[row] = f"{error},{row}"
    with pytest.raises(ImportRefusedError, match=f"(?i)line {row + 2}, column 'u': '{re.escape(error)}'"):
        read(tmp_path, "\n".join(["u,v", *rows]))


def test_comments_between_rows_are_counted_and_a_row_is_none(tmp_path):
    found = read(tmp_path, "# made by hand\nt,u\n0,1.5\n# restarted,\n# again\n1,2.5\n2,3.5\n")
    np.testing.assert_array_equal(found.by_name["u"], [1.5, 2.5, 3.5])
    assert found.notes == ("Left out: 2 comment lines below the first row (line 4).",)
    for row in (0, 2):
        rows = ["0,1.5", "1,2.5", "2,3.5", "3,3.5"]
        rows[row] = "%" + rows[row]
        with pytest.raises(
            ImportRefusedError, match=f"Line {row + 2} begins with '%' as a comment does, but has the f"
        ):
            read(tmp_path, "\n".join(["t,u", *rows]))


def test_a_quote_that_is_not_closed_swallows_no_rows(tmp_path):
    rows = [f"{k},{k % 3},ok" for k in range(40)]
    rows[10], rows[15] = '10,1,"start', '15,0,end"'
    with pytest.raises(ImportRefusedError, match="Line 12: a quote is opened and not closed"):
        read(tmp_path, "\n".join(["t,u,said", *rows]))


@pytest.mark.parametrize(
    ("stamps", "said"),
    [
        (("12:00:00+01:00", "12:00:01"), "some of its clock times have a zone, others none"),
        (("12:75:00", "12:76:00"), "'12:75:00' is no clock time"),
        (("12:00:59.5", "12:00:60.5"), "'12:00:60.5' is no clock time"),
        (("2024-03-01 24:00:00", "2024-03-01 25:00:00"), "'2024-03-01 25:00:00' is no clock time: it has hour 25"),
        (("2024-03-01 23:59:00", "2024-03-01 24:00:01"), "'2024-03-01 24:00:01' is no clock time: it has hour 24"),
        (("11:00:00 PM", "25:00:00 PM"), "'25:00:00 PM' is no clock time: it has hour 25"),
        (("11:00:00 AM", "13:00:00 AM"), "'13:00:00 AM' is no clock time: it has hour 13"),
    ],
)
def test_clock_times_that_cannot_be_are_refused(tmp_path, stamps, said):
    with pytest.raises(ImportRefusedError, match=f"(?i){re.escape(said)}"):
        read(tmp_path, "when,u\n" + "".join(f"{stamp},1.5\n" for stamp in stamps))


@pytest.mark.parametrize("stamps", [("30:00:00", "30:00:01"), ("13:00:00 PM", "13:00:01 PM")])
def test_times_since_a_start_and_hours_of_a_whole_day_are_read(tmp_path, stamps):
    found = read(tmp_path, "when,u\n" + "".join(f"{stamp},1.5\n" for stamp in stamps))
    np.testing.assert_array_equal(found.by_name["when [s]"], [0.0, 1.0])


def test_a_text_that_is_no_table_is_refused_before_it_takes_memory(tmp_path):
    for text, said in (
        ("t,u\n1," + "x" * 2**20, "Line 2 has 1048578 characters"),
        ("t\n" + "\n" * 20_000_001, "lines"),
    ):
        with pytest.raises(ImportRefusedError, match=said):
            read(tmp_path, text)


def test_a_long_field_is_shortened_in_errors(tmp_path):
    with pytest.raises(ImportRefusedError) as refused:
        read(tmp_path, f"t,u\n0,1\n1,{'1x' * 500}\n2,3\n")
    assert f"'{'1x' * 30}…' is not a number" in refused.value.happened
    assert len(refused.value.happened) < 300


def test_a_name_in_quotes_may_hold_a_line_break(tmp_path):
    rows = "".join(f"{t},{u}\n" for t, u in VALUES)
    assert list(read(tmp_path, f'Rig 3\n"time\n[s]","force\n[N]"\n{rows}').by_name) == ["time [s]", "force [N]"]


def test_names_of_digits_with_underscores_are_a_header(tmp_path):
    rows = "".join(f"{t},{u}\n" for t, u in VALUES)
    assert list(read(tmp_path, f"1_0,2_0\n{rows}").by_name) == ["1_0", "2_0"]


def test_times_in_seconds_take_no_name_of_another_column(tmp_path):
    names = ("when stamp [s]", "when [s]", "when [UTC]", "when [local]")
    rows = "".join(f"{7 * row},word,12:00:0{row},13:00:0{2 * row},1.5\n" for row in range(3))
    found = read(tmp_path, ",".join((*names, "u")) + "\n" + rows)
    np.testing.assert_array_equal(found.by_name["when stamp [s]"], [0.0, 7.0, 14.0])
    np.testing.assert_array_equal(found.by_name["when stamp 2 [s]"], [0.0, 1.0, 2.0])
    np.testing.assert_array_equal(found.by_name["when stamp 3 [s]"], [0.0, 2.0, 4.0])
    assert found.clocks == ("when stamp 2 [s]", "when stamp 3 [s]")


def test_stored_times_in_seconds_take_no_name_of_another_array():
    stored = {f"when{mark}": np.array([0.0, 7.0]) for mark in (" [s]", " stamp [s]")}
    found = convert_times({"when": np.array(["12:00:00", "12:00:01"]), **stored})
    assert list(found.by_name) == ["when stamp 2 [s]", "when [s]", "when stamp [s]"]
