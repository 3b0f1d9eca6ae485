import h5py
import numpy as np
import pytest
from scipy.io import savemat

from study.importing.arrays.read_arrays import READABLE_ENDINGS, find_unread_reason, read_arrays
from study.importing.header_map import find_header_problems
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError
from study.store.disk.file_errors import CannotReadError
from tests.whole_arrays import read_whole

U = np.array([0.5, np.nan, -2.0])


def read(path, **csv):
    return read_whole(path, CsvMap(**csv)).by_name


def written(tmp_path, text, name="a.csv"):
    path = tmp_path / name
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "settings"),
    [
        ("t,u\n0,0.5\n1,\n2,-2\n", {}),
        ("t;u\n0;0,5\n1;NaN\n2;-2,0\n", {"decimal": ","}),
        ("t\tu\n0\t0.5\n1\tnan\n2\t-2\n", {}),
        ("  t   u\n  0  0.5\n\n  1  nan\n  2  -2\n", {}),
        ("# made by a logger\n# t, u\n0, 0.5\n1, nan\n2, -2\n", {}),
        ("Logger 3\nstarted today\nt,u\n0,0.5\n1,\n2,-2\n", {"skip_lines": 2}),
        ("0,0.5\n1,\n2,-2\n", {"names": ("t", "u")}),
        ("\ufefft,u\r\n0,0.5\r\n1,\r\n2,-2\r\n", {}),
        ('"t","u"\n"0","0.5"\n"1",""\n"2","-2"\n', {}),
    ],
)
def test_tables_are_read_however_they_are_written(tmp_path, text, settings):
    found = read(written(tmp_path, text), **settings)
    assert list(found) == ["t", "u"]
    np.testing.assert_array_equal(found["t"], [0, 1, 2])
    np.testing.assert_array_equal(found["u"], U)


def test_columns_without_a_header_are_numbered(tmp_path):
    assert list(read(written(tmp_path, "0 1\n2 3\n", "a.txt"))) == ["column1", "column2"]


_THOUSANDS = "write numbers without signs between thousands"
_CORRECT = "correct it, or leave it empty where the sample is missing"
_COMMA = (
    "Line 3, column 'u': '0,25' is not a number; where the decimal sign is a comma, the map says decimal = \",\" under "
    "[csv]."
)


@pytest.mark.parametrize(
    ("text", "settings", "sentence"),
    [
        ("", {}, "It holds no lines."),
        ("t,u\n", {}, "It has a header, but no rows below it."),
        ("t,u\n0,1\n1,OK\n", {}, f"Line 3, column 'u': 'OK' is not a number; {_CORRECT}."),
        ("t;u\n0;1.5\n1;0,25\n", {}, _COMMA),
        ("t;u\n0;1\n1;0,25\n", {"decimal": "."}, _COMMA),
        (
            "# c\nt,u\n0,1\n1,2,3\n",
            {},
            "Line 4 has 3 fields, but there are 2 columns; remove that line, or complete it.",
        ),
        ("t,t\n0,1\n", {}, "Its header names 't' twice; give the columns names of their own in [csv] names."),
        ("t [s],u [V]\ns,N\n0,1\n", {}, "Its header says V in 'u [V]', and its row of units says N."),
        ("t_s,travel_mm\ns,m\n0,1\n", {}, "Its header says mm in 'travel_mm', and its row of units says m."),
        ("t;u\n0;1.234,5\n1;2,5\n", {}, f"Line 2, column 'u': '1.234,5' is not a number; {_THOUSANDS}."),
        ("t,u\nabc,def\n0,x\n", {}, f"Line 2, column 't': 'abc' is not a number; {_CORRECT}."),
    ],
)
def test_what_is_wrong_with_a_table_is_reported_with_its_line(tmp_path, text, settings, sentence):
    with pytest.raises(ImportRefusedError) as refused:
        read(written(tmp_path, text), **settings)
    assert refused.value.happened == sentence
    assert refused.value.saved == "Nothing was written."


def test_npz_is_read_without_running_anything_in_it(tmp_path):
    np.savez(tmp_path / "a.npz", u=U[:, None], fs=1000.0, names=np.array(["a"]), bad=np.array([{}], dtype=object))
    found = read(tmp_path / "a.npz")
    assert {name: array.shape for name, array in found.items()} == {"u": (3,), "fs": (), "names": ()}


def test_a_single_npy_is_data(tmp_path):
    np.save(tmp_path / "a.npy", U)
    np.testing.assert_array_equal(read(tmp_path / "a.npy")["data"], U)


def test_structures_of_matlab_are_named_with_a_dot(tmp_path):
    savemat(tmp_path / "a.mat", {"data": {"u": U[:, None], "run": {"fs": 1000.0}}, "note": "hello"})
    found = read(tmp_path / "a.mat")
    assert set(found) == {"data.u", "data.run.fs", "note"}
    np.testing.assert_array_equal(found["data.u"], U)


def test_matlab_files_that_are_hdf5_are_turned_the_right_way(tmp_path):
    with h5py.File(tmp_path / "a.mat", "w") as file:
        file["data/y"] = np.arange(6.0).reshape(3, 2)
        file["#refs#/x"] = 1.0
    found = read(tmp_path / "a.mat")
    assert {name: array.shape for name, array in found.items()} == {"data.y": (2, 3)}


def test_datasets_of_hdf5_are_named_by_their_path(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run1/force"] = U
    np.testing.assert_array_equal(read(tmp_path / "a.h5")["run1/force"], U)


def test_a_scale_that_is_stated_beside_a_dataset_is_reported(tmp_path):
    """Such as of netCDF; counts were taken for newtons without a word."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in ("force [N]", "plain"):
            file[name] = np.arange(40, dtype="i2")
            file[name].attrs.update({"scale_factor": np.array([1.0]), "add_offset": 0})
        file["force [N]"].attrs.update({"scale_factor": 0.001, "add_offset": 5})
    arrays = read_arrays(tmp_path / "a.h5", CsvMap())
    assert arrays.notes == (
        "force [N]: its attribute scale_factor = 0.001 and add_offset = 5 was not applied; a map can state it in "
        "`value`.",
    )
    assert arrays.by_name["force [N]"][-1] == 39
    with h5py.File(tmp_path / "a.h5", "r+") as file:  # of the wrong kind, and as long as an attribute may be
        file["force [N]"].attrs["scale_factor"] = np.arange(8000.0)
    (note,) = read_arrays(tmp_path / "a.h5", CsvMap()).notes
    assert note.startswith("force [N]: its attribute scale_factor = 0.0, 1.0, ") and len(note) < 200


@pytest.mark.parametrize("name", ["a.npz", "a.npy", "a.mat", "a.h5"])
@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 cut off", b"\x93NUMPY\x01\x00", bytes(range(256)) * 4])
def test_a_damaged_file_is_a_named_error(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ImportRefusedError, match=name):
        read(tmp_path / name)


def test_a_file_of_no_known_kind_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(ImportRefusedError) as refused:
        read(written(tmp_path, "x", "a.docx"))
    assert f"known are {READABLE_ENDINGS}" in refused.value.happened


def test_a_file_with_no_arrays_is_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w"):
        pass
    with pytest.raises(ImportRefusedError, match="It holds no arrays"):
        read(tmp_path / "a.h5")


def test_a_file_that_is_not_there_is_reported(tmp_path):
    with pytest.raises(CannotReadError, match="There is no file"):
        read(tmp_path / "a.npz")


def test_empty_arrays_and_texts_of_matlab_7_3_are_not_read_as_numbers(tmp_path):
    """Matlab stores the dimensions of an empty array, and the codes of the letters of a text."""
    with h5py.File(tmp_path / "a.mat", "w") as file:
        file["bias"], file["note"] = np.zeros(2, "u8"), np.arange(40, dtype="u2")[:, None]
        file["bias"].attrs.update({"MATLAB_class": np.bytes_("double"), "MATLAB_empty": np.uint8(1)})
        file["note"].attrs["MATLAB_class"] = np.bytes_("char")
    found = read(tmp_path / "a.mat")
    assert found["bias"].shape == (0,)
    assert find_unread_reason(found["note"]) == "a text"


def test_a_dataset_of_rows_of_several_columns_is_named(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["table"] = np.zeros(40, dtype=[("t_s", "f8"), ("force_N", "f8")])
    problems = find_header_problems(read_arrays(tmp_path / "a.h5", CsvMap()))
    assert "'table' is of a type that is not read, such as rows of several columns" in problems[0]
