"""Text files with extreme nesting, numbers, keys or columns: refused by name, at once."""

import io
import json
from pathlib import Path

import pytest

from study.importing.arrays.read_arrays import read_arrays
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError, MapNeededError
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import find_long_key
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.workflows.files.validate import validate_file
from study.workflows.recording.import_recording import read_foreign
from tests.slow_instances import slow

pytestmark = pytest.mark.timeout(60)

FROZEN = Path(__file__).parents[2] / "frozen" / "v0_1"

DEEP = "[" * 100_000 + "]" * 100_000


@pytest.mark.parametrize(
    "text",
    [
        DEEP, DEEP[:50], "[" * 70 + "]" * 70, '{"a": NaN}', '{"a": 1e999}', '{"a": ' + "9" * 5000 + "}",
        '{"a": ' + "9" * 50 + "}", r'["\ud800"]', r'{"\udfff": 1}', "", "{", "\0",
    ],
)  # fmt: skip
def test_json_beyond_the_ordinary_is_refused(text):
    with pytest.raises(ValueError, match="."):
        load_json(text)


def test_ordinary_json_is_read():
    value = {"a": [1, -2.5e-3, None, True, "é\n", {"b": []}], "n": 2**127}
    assert load_json(json.dumps(value)) == value
    assert load_json(json.dumps(value).encode()) == value


@pytest.mark.parametrize("key", ["a", '"a b"', "'a'", "a-1", '"\\""'])
def test_a_key_of_many_parts_is_named_with_its_line(key):
    assert find_long_key("x = 1\n[" + ".".join([key] * 32) + "]\n") == ""
    assert find_long_key("x = 1\n[" + " . ".join([key] * 33) + "]\n") == "line 2 has a key of more than 32 parts"
    assert find_long_key('x = """\n' + ".".join([key] * 33).replace('"', "") + '"""\n') == ""
    assert find_long_key("# " + ".".join([key] * 33)) == ""


@pytest.mark.parametrize(
    "deep",
    [
        pytest.param(DEEP, marks=pytest.mark.slow),
        "[" * 220 + "]" * 220,
        "0x" + "f" * 10_000,
        "9" * 10_000,
        '"' + "x" * 10**5 + '"',
        "{ a = " * 900 + "1",
    ],
)
def test_models_and_protocols_and_maps_of_unlikely_values_are_refused_by_name(tmp_path, deep):
    for name, key in (("twin.toml", "mass"), ("corpus_study.toml", "steps"), ("lever_map.toml", "rate_hz")):
        text = f"{key} = {deep}\n" + (FROZEN / name).read_text()
        nested = (FROZEN / name).read_text() + f"\n[[effect]]\nkind = {deep}\n[tolerance]\nmass_kg = {deep}\n"
        for content in (text, nested):
            (tmp_path / name).write_text(content)
            assert validate_file(tmp_path / name).problems
    with pytest.raises(UnusableFileError):
        read_mechanical_model(tmp_path / "twin.toml")


@pytest.mark.slow
def test_a_table_of_a_hundred_thousand_columns_is_refused_at_once(tmp_path):
    (tmp_path / "a.csv").write_text(",".join(f"c{n}" for n in range(100_000)) + "\n" + ",".join(["1"] * 100_000) + "\n")
    with pytest.raises(ImportRefusedError, match="It has 100000 columns"):
        read_arrays(tmp_path / "a.csv", CsvMap())


@pytest.mark.parametrize("letters", ["[", "()", "(", *slow(" ", "_", " in", " /", "m/", "aB", "1.234")])
def test_a_header_of_two_hundred_thousand_letters_costs_no_square_of_them(letters, tmp_path):
    """Before: 60 s and more for names of spaces, underscores, or `in`."""
    rows = "".join(f"{k / 1000},{k % 7}\n" for k in range(300))
    (tmp_path / "a.csv").write_text(f"a{letters * (200_000 // len(letters))}b,c\n{rows}")
    with pytest.raises(MapNeededError, match="No column is the time"):
        read_foreign((tmp_path / "a.csv",), None)


def test_a_problem_of_a_million_letters_is_cut():
    error = UnusableFileError(Path("a"), "file", ("x" * 10**6, *["y"] * 1000))
    assert len(error.happened) < 1000
    assert error.problems[-1] == "and 961 more problems"
    assert io.StringIO(str(error))
