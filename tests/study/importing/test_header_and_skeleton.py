import numpy as np
import pytest

from study.importing.arrays import Arrays, read_arrays
from study.importing.header_map import header_map
from study.importing.header_units import unit_in
from study.importing.import_map import CsvMap
from study.importing.map_skeleton import map_skeleton
from study.importing.map_toml import parse_map
from study.store.file_errors import UnusableFileError


def arrays(tmp_path, header):
    path = tmp_path / "a.csv"
    rows = np.column_stack([np.arange(20) / 100, *[np.ones(20)] * (header.count(","))])
    path.write_text(header + "\n" + "\n".join(",".join(f"{x:g}" for x in row) for row in rows) + "\n")
    return read_arrays(path, CsvMap())


@pytest.mark.parametrize(
    ("header", "expected"),
    [("fx [N]", ("fx", "N")), ("time (s)", ("time", "s")), ("a_x[m/s^2]", ("a_x", "m/s^2")), ("fx", ("fx", "")),
     ("[N]", ("[N]", ""))],
)  # fmt: skip
def test_a_header_is_a_name_and_a_unit(header, expected):
    assert unit_in(header) == expected


@pytest.mark.parametrize(
    ("header", "roles"),
    [
        ("time [s],fx [N],ax [m/s^2]", ["command", "response"]),
        ("t (ms),fx (N),x (mm),ax (g)", ["command", "position", "response"]),
        ("time_s [s],torque [N m],angle [deg]", ["command", "response"]),
    ],
)
def test_a_header_with_units_needs_no_map(tmp_path, header, roles):
    found = header_map(arrays(tmp_path, header))
    assert found is not None
    assert [channel.role for channel in found.channel] == roles


@pytest.mark.parametrize(
    "header",
    ["time [s],fx,ax [m/s^2]", "fx [N],ax [m/s^2]", "time [s],u [V],y [V]", "time [s],fx [N],temp [K],ax [g]",
     "time [s],fx [N],fy [N]", "time [furlong],fx [N],ax [g]"],
)  # fmt: skip
def test_a_header_that_leaves_something_open_is_not_guessed_at(tmp_path, header):
    assert header_map(arrays(tmp_path, header)) is None


def test_a_skeleton_names_every_array_and_is_refused_until_it_is_complete(tmp_path):
    held = Arrays(
        tmp_path / "a.npz",
        {"drive_t_ms": np.arange(99.0), "speed": np.ones(99), "daq_time": np.arange(120.0), "y": np.ones((3, 120)),
         "force [N]": np.ones(120), "gain": np.array(3.0), "note": np.array("x"), "cube": np.ones((3, 3, 3))},
    )  # fmt: skip
    text = map_skeleton(held)
    for words in (
        'time = "drive_t_ms"',
        'time_unit = "ms"',
        'value = "y[2]"',
        "# gain: one number, a constant",
        'unit = "N"',
        "# note holds no numbers",
        'clock = "daq_time"',
        "# cube: 3 x 3 x 3 samples; a channel is one row",
    ):
        assert words in text
    with pytest.raises(UnusableFileError) as refused:
        parse_map(text, tmp_path / "m.toml")
    assert any(problem.startswith('device is ""') for problem in refused.value.problems)
    assert any(problem.startswith('channel[1].role is ""') for problem in refused.value.problems)


def test_a_completed_skeleton_is_a_map(tmp_path):
    held = Arrays(tmp_path / "a.npz", {"fs": np.array(100.0), "u": np.ones(50), "y": np.ones(50)})
    first, _, second = map_skeleton(held).partition('name = "y"')
    complete = (
        first.replace('device = ""', 'device = "rig"').replace('role = "" ', 'role = "command" ', 1)
        .replace('role = "" ', 'role = "response" ', 1) + 'name = "y"' + second
    )  # fmt: skip
    found = parse_map(complete, tmp_path / "m.toml")
    assert found.clock[0].rate == "fs"
    assert [(channel.role, channel.name) for channel in found.channel] == [("command", "u"), ("response", "y")]
