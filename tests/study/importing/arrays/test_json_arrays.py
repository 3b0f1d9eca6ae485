"""Records, columns and lines of JSON become arrays."""

import json

import numpy as np
import pytest

from study.importing.arrays.json_arrays import is_hapteq_document
from study.importing.arrays.read_arrays import read_arrays
from study.importing.header_map import describe_header_choices, make_header_map
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError
from study.importing.map_skeleton import make_map_skeleton

TIME, FORCE = [0.0, 0.1, 0.2], [1, None, 2.5]
RECORDS = [{"t": t, "u": u} for t, u in zip(TIME, FORCE, strict=True)]


def read(tmp_path, content, name="a.json"):
    (tmp_path / name).write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return read_arrays(tmp_path / name, CsvMap())


@pytest.mark.parametrize(
    "content",
    [
        RECORDS,
        {"t": TIME, "u": FORCE},
        {"data": RECORDS},
        {"meta": {"rig": "3", "rate_hz": 10}, "data": {"t": TIME, "u": FORCE}},
        "\n".join(map(json.dumps, RECORDS)),
        "\n".join(map(json.dumps, RECORDS)) + "\n\n",
        "\ufeff" + json.dumps(RECORDS),
        [{"t": 0.0, "u": 1}, {"t": 0.1}, {"t": 0.2, "u": 2.5}],
        [{"t": str(t), "u": "NaN" if u is None else str(u)} for t, u in zip(TIME, FORCE, strict=True)],
        json.dumps(RECORDS).replace("null", "NaN"),
    ],
)
def test_records_columns_and_lines_are_the_same_table(tmp_path, content):
    found = {name: array for name, array in read(tmp_path, content).by_name.items() if array.ndim}
    assert list(found) == ["t", "u"]
    np.testing.assert_array_equal(found["t"], TIME)
    np.testing.assert_array_equal(found["u"], [1, np.nan, 2.5])


@pytest.mark.parametrize("name", ["a.jsonl", "a.ndjson", "a.json"])
def test_lines_may_have_any_of_the_usual_endings(tmp_path, name):
    assert list(read(tmp_path, "\n".join(map(json.dumps, RECORDS)), name).by_name) == ["t", "u"]


def test_objects_inside_are_named_by_their_place(tmp_path):
    assert list(read(tmp_path, [{"t": 0, "imu": {"x": 1, "y": 2}}, {"t": 1, "imu": {"x": 1, "y": 2}}]).by_name) == [
        "t", "imu.x", "imu.y",
    ]  # fmt: skip
    runs = {"run1": {"t": TIME, "u": FORCE}, "run2": {"t": TIME, "u": FORCE}}
    assert list(read(tmp_path, runs).by_name) == ["run1/t", "run1/u", "run2/t", "run2/u"]


def test_units_beside_values_need_no_map(tmp_path):
    values = list(range(20))
    found = read(
        tmp_path,
        {
            "time": {"unit": "ms", "values": values},
            "force": {"unit": "N", "values": values, "name": "of the cell"},
            "speed": {"unit": "rad/sec", "values": values},
        },
    )
    assert [name for name, array in found.by_name.items() if array.ndim] == ["time [ms]", "force [N]", "speed [rad/s]"]
    wanted = make_header_map(found)
    assert wanted is not None
    assert [(channel.role, channel.unit) for channel in wanted.channel] == [("command", "N"), ("response", "rad/s")]
    assert "Left out: 'force/name' is no column." in describe_header_choices(found, wanted)


def test_dates_become_seconds(tmp_path):
    found = read(tmp_path, [{"when": f"2026-05-04T12:00:0{k}Z", "u": k} for k in range(5)])
    assert found.clocks == ("when [s]",)
    np.testing.assert_array_equal(found.by_name["when [s]"], range(5))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "no JSON"),
        ("{", "no JSON"),
        ('{"t": 1}\n{"t": }', "line 2"),
        ('{"t": 1}\n[2]\n', "line 2 is no record in braces"),
        ('{"t": 1e999}', "larger than any"),
        ("[" * 100 + "]" * 100, "nested"),
        ("[]", "no arrays"),
        ("{}", "no arrays"),
        ('{"t": [1, 2], "u": [1, 2], "t": [3, 4]}', "has 't' twice"),
        ('{"t": 1, "t": 2}\n{"t": 3, "t": 4}', "has 't' twice"),
        ({"f": {"unit": "N", "values": TIME, "scale": 2}, "t": TIME}, "'f' has 'scale' next to its values"),
        ({"f": {"unit": "N", "values": TIME, "flags": TIME}, "t": TIME}, "'f' has 'flags' next to its values"),
        ({"f": {"unit": "N", "values": TIME, "gain": "0.5"}, "t": TIME}, "'f' has 'gain' next to its values"),
        ({"f [lbf]": {"unit": "N", "values": TIME}, "t": TIME}, "header says lbf in 'f [lbf]'"),
        ({"format": "hapteq.diagnosis/1"}, "a hapteq document"),
    ],
)
def test_what_cannot_be_read_is_refused_in_words(tmp_path, content, said):
    with pytest.raises(ImportRefusedError) as refused:
        read(tmp_path, content)
    assert said in str(refused.value.happened)


def test_records_that_hold_lists_of_several_lengths_are_runs(tmp_path):
    rollouts = [{"kind": "step", "u": list(range(count)), "y": [0.5] * count} for count in (20, 30)]
    arrays = read(tmp_path, {"config": {"rate_hz": 50}, "data": rollouts})
    assert {name: len(array) for name, array in arrays.by_name.items() if array.ndim} == {
        "data/1/u": 20, "data/1/y": 20, "data/2/u": 30, "data/2/y": 30,
    }  # fmt: skip
    assert [f'prefix = "data/{run}/"' in make_map_skeleton(arrays) for run in (1, 2)] == [True, True]


def test_records_that_hold_vectors_of_one_length_are_a_table(tmp_path):
    found = read(tmp_path, [{"t": t, "imu": [t, 2.0, 3.0]} for t in TIME]).by_name
    assert (found["t"].tolist(), found["imu"].shape) == (TIME, (3, 3))


def test_records_that_hold_short_lists_of_several_lengths_are_a_table(tmp_path):
    found = read(tmp_path, [{"t": 0.1 * k, "u": k, "contacts": list(range(k % 3))} for k in range(40)]).by_name
    assert (found["t"].shape, found["u"].tolist()) == ((40,), list(range(40)))


def test_a_document_of_ours_is_told_from_a_table(tmp_path):
    (tmp_path / "a.json").write_text(json.dumps(RECORDS))
    (tmp_path / "d.json").write_text(json.dumps({"format": "hapteq-diagnosis", "version": 1}))
    assert not is_hapteq_document(tmp_path / "a.json")
    assert is_hapteq_document(tmp_path / "d.json")


def test_records_with_keys_of_their_own_are_refused_at_once(tmp_path):
    with pytest.raises(ImportRefusedError, match="5000 records have 5000 keys"):
        read(tmp_path, [{f"k{k}": 1} for k in range(5000)])
    with pytest.raises(ImportRefusedError, match="more than 2097152 records"):
        read(tmp_path, "[" + "[]," * 2**21 + "[]]")


def test_a_label_of_digits_is_no_number(tmp_path):
    found = read(tmp_path, {"label": ["1_1", "1_2"], "u": ["1", "2"]}).by_name
    assert found["u"].tolist() == [1.0, 2.0]
    assert found["label"].dtype.kind != "f"
