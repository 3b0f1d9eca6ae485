import numpy as np
import pytest

from study.importing.arrays.arrays import read_arrays
from study.importing.header_map import header_map, header_problems
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError

NAMES = ["time [s]", "force [N]", "travel [mm]"]
ROWS = "0,1,2\n0.1,-3,4.5\n0.2,5,-6\n"
VALUES = [[0, 1, 2], [0.1, -3, 4.5], [0.2, 5, -6]]


def read(tmp_path, data):
    path = tmp_path / "a.csv"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_arrays(path, CsvMap())


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
    found = header_map(
        read(tmp_path, f"time,Kraft (N),angle\nµs,,°\n{ROWS}".replace("Kraft", "force").encode(encoding))
    )
    assert found is not None
    assert found.clock[0].time_unit == "us"
    assert [channel.unit for channel in found.channel] == ["N", "deg"]


def test_a_unit_that_is_not_known_is_named_and_not_taken_for_a_number(tmp_path):
    assert header_problems(read(tmp_path, f"time,force,travel\n[s],[N],[furlong]\n{ROWS}")) == (
        "'travel [furlong]': 'furlong' is not a unit known here",
    )


def test_words_below_the_header_that_are_no_units_do_not_replace_it(tmp_path):
    # The rows of numbers begin in line 4: the header would be line 3, and the two lines above are remarks.
    assert list(read(tmp_path, f"time,force,travel\nmine,yours,theirs\nt,u,v\n{ROWS}").by_name) == ["t", "u", "v"]


def test_a_column_of_whole_numbers_is_not_split_at_its_commas(tmp_path):
    np.testing.assert_array_equal(read(tmp_path, "x\n1,5\n2,25\n").by_name["x"], [1.5, 2.25])
    assert list(read(tmp_path, "x,y\n1,5\n2,25\n").by_name) == ["x", "y"]


@pytest.mark.parametrize("data", [b"t,u\n0,1\n\0\0\1\2\3\4", b"\xff\xfet\0,"])
def test_what_is_no_text_is_refused(tmp_path, data):
    with pytest.raises(ImportRefusedError):
        read(tmp_path, data)
