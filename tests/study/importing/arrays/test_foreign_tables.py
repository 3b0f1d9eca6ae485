import numpy as np
import pytest

from study.importing.header_map import find_header_problems, make_header_map
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError
from tests.whole_arrays import read_whole

NAMES = ["time [s]", "force [N]", "travel [mm]"]
ROWS = "0,1,2\n0.1,-3,4.5\n0.2,5,-6\n"
VALUES = [[0, 1, 2], [0.1, -3, 4.5], [0.2, 5, -6]]


def read(tmp_path, data, settings=CsvMap()):  # noqa: B008
    path = tmp_path / "a.csv"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_whole(path, settings)


@pytest.mark.parametrize(
    "text",
    [
        f"time,force,travel\ns,N,mm\n{ROWS}",
        f"time,force,travel\n[s],[N],[mm]\n{ROWS}",
        f"time,force,travel\n(s), (N), (mm)\n{ROWS}",
        f"time [s],force,travel [mm]\ns,N,mm\n{ROWS}",
        f"time [s],force [N],travel\n-,,mm\n{ROWS}",
        f"# rig 3\n# time, force, travel\n# s, N, mm\n{ROWS}",
        f"Rig 3\nstarted 12:03, by hand\n\ntime,force,travel\ns,N,mm\n{ROWS}",
        "time;force;travel\ns;N;mm\n" + ROWS.replace(",", ";").replace(".", ","),
        "time\tforce\ttravel\ns\tN\tmm\n" + ROWS.replace(",", "\t").replace(".", ","),
        "time [s]  force [N]  travel [mm]\n" + ROWS.replace(",", "  "),
    ],
)
def test_units_stand_below_the_header_or_in_it_and_decimal_signs_are_seen(tmp_path, text):
    found = read(tmp_path, text).by_name
    assert list(found) == NAMES
    np.testing.assert_array_equal(np.stack(list(found.values()), axis=1), VALUES)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252", "latin-1"])
def test_letters_beyond_ascii_are_read_in_the_usual_encodings(tmp_path, encoding):
    found = make_header_map(
        read(tmp_path, f"time,Kraft (N),angle\nµs,,°\n{ROWS}".replace("Kraft", "force").encode(encoding))
    )
    assert found is not None
    assert found.clock[0].time_unit == "us"
    assert [channel.unit for channel in found.channel] == ["N", "deg"]


def test_a_unit_that_is_not_known_is_named_and_not_taken_for_a_number(tmp_path):
    assert find_header_problems(read(tmp_path, f"time,force,travel\n[s],[N],[furlong]\n{ROWS}")) == (
        "'travel [furlong]': 'furlong' is not a unit known here",
    )


def test_words_below_the_header_that_are_no_units_do_not_replace_it(tmp_path):
    # The rows of numbers begin in line 4: the header would be line 3, and the two lines above are remarks.
    assert list(read(tmp_path, f"time,force,travel\nmine,yours,theirs\nt,u,v\n{ROWS}").by_name) == ["t", "u", "v"]


def test_a_column_of_whole_numbers_is_not_split_at_its_commas(tmp_path):
    np.testing.assert_array_equal(read(tmp_path, "x\n1,5\n2,25\n").by_name["x"], [1.5, 2.25])
    assert list(read(tmp_path, "x,y\n1,5\n2,25\n").by_name) == ["x", "y"]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("Rig 3\ntime,force\n0,1\n1,2\n2,4", ["time", "force"]),
        ("t,u,\n0,1\n1,2\n2,4", ["t", "u"]),
        ("Rig 3\n0,1\n1,2\n2,4", ["column1", "column2"]),
        ("Rig three, by hand\n0,1\n1,2\n2,4", ["Rig three", "by hand"]),
        ("t [ms],u [counts, raw]\n0,1\n1,2\n2,4", ["t [ms]", "u [counts, raw]"]),
        ("t,u,v\n0,1\n1,2\n2,4", None),
    ],
)
def test_two_columns_of_whole_numbers_are_not_read_as_decimals(tmp_path, text, names):
    found = read(tmp_path, text, CsvMap(names=("t", "u"))).by_name
    np.testing.assert_array_equal([found["t"], found["u"]], [[0, 1, 2], [1, 2, 4]])
    if names:
        assert list(read(tmp_path, text).by_name) == names
    else:
        with pytest.raises(ImportRefusedError, match="2 fields, but there are 3 columns"):
            read(tmp_path, text)


@pytest.mark.parametrize("text", ["t\tu\tv\n0\t1,250\t1\n1\t2,500\t3", "t;u\n0;1,250", "0;1,250", "x\n-1,250\n2,500"])
def test_commas_that_may_separate_thousands_are_refused_until_the_map_states_the_decimal_sign(tmp_path, text):
    with pytest.raises(ImportRefusedError, match='1,250.* the map says decimal = ","'):
        read(tmp_path, text)
    assert 1.25 in np.abs(np.hstack(list(read(tmp_path, text, CsvMap(decimal=",")).by_name.values())))


@pytest.mark.parametrize("row", ["0,250;1,250", "1,250;1,25", "1250,125;1,250"])
def test_a_comma_that_cannot_separate_thousands_is_a_decimal_sign(tmp_path, row):
    values = [float(field.replace(",", ".")) for field in row.split(";")]
    assert list(read(tmp_path, f"t;u\n{row}").by_name.values()) == values


@pytest.mark.parametrize("field", [".5", "5.", "-.5", "1.5"])
def test_a_point_beside_decimal_commas_is_no_blank(tmp_path, field):
    with pytest.raises(ImportRefusedError, match=f"Line 3, column 'u': '{field}' is not a number"):
        read(tmp_path, f"t;u\n0,1;1,5\n0,2;{field}\n0,3;2,5", CsvMap(decimal=","))


def test_a_missing_sample_with_points_is_missing_also_beside_decimal_commas(tmp_path):
    found = read(tmp_path, "t;u\n0,1;1,5\n0,2; N.a. \n0,3;2,5", CsvMap(decimal=",")).by_name["u"]
    np.testing.assert_array_equal(found, [1.5, np.nan, 2.5])


@pytest.mark.parametrize("mark", ["#", "%"])
def test_a_comment_below_the_header_does_not_replace_it_but_may_hold_its_units(tmp_path, mark):
    header = ",".join(NAMES)
    assert list(read(tmp_path, f"{header}\n{mark} run 2, by hand, slow\n{ROWS}").by_name) == NAMES
    assert list(read(tmp_path, f"time,force,travel\n{mark} s, N, mm\n{mark} by hand\n{ROWS}").by_name) == NAMES


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("force [N],travel [mm]\n,\n1,2\n2,3", ["force [N]", "travel [mm]"]),
        ("force,travel\nN,mm\nnan,\n1,2\n2,3", ["force [N]", "travel [mm]"]),
        ("u\nnan\n1\n2", ["u"]),
        ("t,u\nnan,nan\n1,2\n2,3", ["t", "u"]),
        ("nan,nan\n1,2\n2,3", ["column1", "column2"]),
    ],
)
def test_a_first_row_without_a_number_is_a_row_of_missing_samples(tmp_path, text, names):
    found = read(tmp_path, text).by_name
    assert list(found) == names
    expected = [[np.nan, 1, 2], [np.nan, 2, 3]][: len(names)]
    np.testing.assert_array_equal(list(found.values()), expected)
    said = read(tmp_path, text, CsvMap(names=("a", "b")[: len(names)])).by_name
    np.testing.assert_array_equal(list(said.values()), expected)


def test_a_row_of_units_does_not_become_the_header(tmp_path):
    with pytest.raises(ImportRefusedError, match="Line 2, column 't': 's' is not a number"):
        read(tmp_path, "t,1\ns,N\n0,5")


@pytest.mark.parametrize("data", [b"t,u\n0,1\n\0\0\1\2\3\4", b"\xff\xfet\0,"])
def test_what_is_no_text_is_refused(tmp_path, data):
    with pytest.raises(ImportRefusedError):
        read(tmp_path, data)
