"""Sheets of a workbook are read as tables."""

import zipfile
from datetime import datetime, timedelta

import numpy as np
import pytest
from openpyxl import Workbook, load_workbook

from study.importing.arrays.read_arrays import read_arrays
from study.importing.build_recording import build_recording
from study.importing.header_map import describe_header_choices, find_header_problems, make_header_map
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError
from tests.whole_arrays import read_whole

NAMES = ["time [s]", "force [N]", "travel [mm]"]
NOON = datetime(2026, 5, 4, 12)  # noqa: DTZ001 cells of a workbook have no time zone
ROWS = [(k / 10, k % 3 - 1.5, 7 * k) for k in range(20)]


@pytest.fixture
def book(tmp_path):
    def write(**sheets):
        whole = Workbook()
        whole.remove(whole.active)
        for name, rows in sheets.items():
            sheet = whole.create_sheet(name)
            for row in rows:
                sheet.append(row)
        whole.save(tmp_path / "a.xlsx")
        return tmp_path / "a.xlsx"

    return write


@pytest.mark.parametrize(
    "above",
    [
        [NAMES],
        [["time", "force", "travel"], ["s", "N", "mm"]],
        [["Rig 3"], ["date", NOON], ["rate", 10], [], NAMES],
        [["Rig 3, by hand", None, None], ["time", "force", "travel"], ["[s]", "[N]", "[mm]"], []],
    ],
)
def test_the_header_of_a_sheet_may_be_anywhere(book, above):
    found = read_arrays(book(Sheet1=[*above, *ROWS]), CsvMap()).by_name
    assert list(found) == NAMES
    np.testing.assert_array_equal(np.stack(list(found.values()), axis=1), ROWS)


def test_a_sheet_that_begins_further_in_and_misses_cells_is_read(book):
    rows = [[None, *row] for row in ROWS]
    rows[4][2] = rows[7][3] = None
    found = read_arrays(book(Data=[[], [], [None, *NAMES], *rows]), CsvMap()).by_name
    values = [found[name] for name in NAMES]
    assert np.argwhere(np.isnan(values)).tolist() == [[1, 4], [2, 7]]
    wanted = np.array(ROWS).T
    np.testing.assert_array_equal(np.where(np.isnan(values), wanted, values), wanted)


def test_sheets_that_are_alike_are_parts_and_one_without_numbers_is_left_out(book):
    second = [(time, force, travel + 1) for time, force, travel in ROWS]
    arrays = read_arrays(book(About=[["made", "by hand"]], Run1=[NAMES, *ROWS], Run2=[NAMES, *second]), CsvMap())
    wanted = make_header_map(arrays)
    assert wanted is not None
    made = build_recording(wanted, [arrays.path])
    assert arrays.notes == ("Left out: the sheet 'About' holds no rows of numbers.",)
    assert [part["prefix"] for part in made.recording.meta["parts"]] == ["Run1/", "Run2/"]
    expected = [row[2] / 1000 for row in (*ROWS, *second)]
    np.testing.assert_allclose(made.recording.response.samples[:, 0], expected)


@pytest.mark.parametrize(("names", "joined"), [(("Run1", "Run2"), True), (("Raw", "Filtered"), False)])
def test_only_numbered_sheets_are_put_one_after_another_and_it_is_said(book, names, joined):
    arrays = read_arrays(book(**{name: [NAMES, *ROWS] for name in names}), CsvMap())
    wanted = make_header_map(arrays)
    assert (wanted is not None) == joined
    if wanted is None:
        assert "2 parts are alike ('Raw' and 'Filtered')" in find_header_problems(arrays)[0]
    else:
        assert "Put one after another, as parts of one recording: 'Run1', 'Run2'." in describe_header_choices(
            arrays, wanted
        )


def test_a_hidden_sheet_is_left_out_with_a_note(book):
    path = book(Run1=[NAMES, *ROWS], Run2=[NAMES, *ROWS])
    whole = load_workbook(path)
    whole["Run2"].sheet_state = "hidden"
    whole.save(path)
    found = read_arrays(path, CsvMap())
    assert list(found.by_name) == NAMES
    assert found.notes == ("Left out: the sheet 'Run2' is hidden.",)
    assert list(read_arrays(path, CsvMap(sheet="Run2")).by_name) == NAMES


def test_the_map_may_name_the_only_sheet(book):
    path = book(Run1=[NAMES, *ROWS], Other=[["t", "u"], (0, 5), (1, 6)])
    assert list(read_arrays(path, CsvMap(sheet="Run1")).by_name) == NAMES
    assert list(read_arrays(path, CsvMap()).by_name) == [f"Run1/{name}" for name in NAMES] + ["Other/t", "Other/u"]
    with pytest.raises(ImportRefusedError, match="no sheet 'Run9'; there are Run1, Other"):
        read_arrays(path, CsvMap(sheet="Run9"))


@pytest.mark.parametrize("step", [timedelta(milliseconds=250), timedelta(seconds=1)])
def test_dates_become_seconds(book, step):
    rows = [(NOON + k * step, force, travel) for k, (_, force, travel) in enumerate(ROWS)]
    found = read_arrays(book(Data=[["when", "force [N]", "travel [mm]"], *rows]), CsvMap())
    assert found.clocks == ("when [s]",)
    np.testing.assert_allclose(found.by_name["when [s]"], np.arange(20) * step.total_seconds(), atol=1e-9)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([["a", "b"], ["only", "words"]], "No sheet of it holds rows of numbers"),
        ([], "No sheet of it holds rows of numbers"),
        ([NAMES, *ROWS[:9], ("0,9", "x", 1), *ROWS[10:]], "heet 'Data', line 11, column"),
        ([["t", "t"], (0, 1), (1, 2)], "its header names 't' twice"),
    ],
)
def test_what_cannot_be_read_is_said_with_its_sheet(book, rows, said):
    with pytest.raises(ImportRefusedError) as refused:
        read_whole(book(Data=rows), CsvMap())
    assert said in refused.value.happened


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 cut off", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", b"t,u\n0,1\n"])
def test_what_is_no_workbook_is_refused(tmp_path, content):
    (tmp_path / "a.xlsx").write_bytes(content)
    with pytest.raises(ImportRefusedError) as refused:
        read_arrays(tmp_path / "a.xlsx", CsvMap())
    assert ("password" in refused.value.happened) == content.startswith(b"\xd0")


@pytest.mark.parametrize("cut", [40, 400, 2000])
def test_a_damaged_workbook_is_a_named_error(book, cut):
    path = book(Data=[NAMES, *ROWS])
    path.write_bytes(path.read_bytes()[:-cut])
    with pytest.raises(ImportRefusedError):
        read_arrays(path, CsvMap())


@pytest.mark.parametrize("member", ["xl/workbook.xml", "xl/worksheets/sheet1.xml", "[Content_Types].xml"])
def test_a_workbook_with_a_broken_member_is_a_named_error(book, tmp_path, member):
    path = book(Data=[NAMES, *ROWS])
    for content in (None, b"<broken", b"<a/>"):
        with zipfile.ZipFile(path) as whole, zipfile.ZipFile(tmp_path / "b.xlsx", "w") as spoiled:
            for name in whole.namelist():
                if name != member:
                    spoiled.writestr(name, whole.read(name))
                elif content is not None:
                    spoiled.writestr(name, content)
        with pytest.raises(ImportRefusedError):
            read_arrays(tmp_path / "b.xlsx", CsvMap())


@pytest.mark.parametrize(("header", "factor"), [("humidity [%]", 100), ("humidity", 1)])
def test_percents_are_read_as_they_are_shown_where_the_header_says_percent(book, header, factor):
    path = book(Data=[[*NAMES, header], *[(*row, 0.07) for row in ROWS]])
    whole = load_workbook(path)
    for cell in whole["Data"]["D"][1:]:
        cell.number_format = "0.0%"
    whole.save(path)
    np.testing.assert_allclose(read_arrays(path, CsvMap()).by_name[header], 0.07 * factor, rtol=1e-15)


def test_formulas_that_nothing_has_computed_are_said(book):
    rows = [(time, force, f"=B{k}*2") for k, (time, force, _) in enumerate(ROWS, start=2)]
    with pytest.raises(ImportRefusedError, match="Formulas of sheet 'Data' have no stored value; open it in"):
        read_arrays(book(Data=[NAMES, *rows]), CsvMap())


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (b'r="B5"', b'r="5B"', "Sheet 'Data' is damaged"),
        (b"</sheetData>", b"", "Sheet 'Data' is damaged"),
        pytest.param(
            b'<row r="21"', b'<row r="99999999999"', "has cells beyond the 1048576 rows", marks=pytest.mark.slow
        ),
        (b"</row>", b"<c/>" * 20 + b"<c >" * 16385 * 21 + b"</row>", "cells in 21 rows; save the sheet as .csv"),
    ],
)
def test_a_sheet_that_is_damaged_or_too_large_is_refused_in_one_sentence(book, tmp_path, old, new, said):
    path = book(Data=[NAMES, *ROWS])
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(tmp_path / "b.xlsx", "w", zipfile.ZIP_DEFLATED) as spoiled:
        for name in whole.namelist():
            content = whole.read(name)
            spoiled.writestr(name, content.replace(old, new, 1) if "sheet1" in name else content)
    with pytest.raises(ImportRefusedError) as refused:
        read_arrays(tmp_path / "b.xlsx", CsvMap())
    assert said in refused.value.happened


def test_numbers_of_a_sheet_need_no_decimal_sign_and_texts_may_be_numbers(book):
    pointed = [(k, (1.125, 946, 2.375)[k % 3]) for k in range(40)]
    assert read_arrays(book(Data=[["t", "u"], *pointed]), CsvMap()).by_name["u"][:3].tolist() == [1.125, 946, 2.375]
    mixed = [[time, str(force).replace(".", ","), travel] for time, force, travel in ROWS]
    found = read_arrays(book(Data=[NAMES, *mixed]), CsvMap(decimal=",")).by_name
    np.testing.assert_array_equal(np.stack(list(found.values()), axis=1), ROWS)
    for mark in ".,":
        texts = [[f"{cell}".replace(".", mark) for cell in row] for row in ROWS]
        found = read_arrays(book(Data=[NAMES, *texts]), CsvMap()).by_name
        np.testing.assert_array_equal(np.stack(list(found.values()), axis=1), ROWS)


def test_a_column_of_remarks_is_left_out_however_few_they_are(book):
    rows = [[*row, "bump here" if k == 5 else None] for k, row in enumerate(ROWS)]
    found = read_arrays(book(Data=[[*NAMES, "remarks"], *rows]), CsvMap())
    assert list(found.by_name) == NAMES
    assert found.notes == ("Left out: 'remarks' holds words, not numbers.",)
