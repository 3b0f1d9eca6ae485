"""Signals that carry their own time: tables of [time, value], and what Simulink stores."""

import struct

import numpy as np
import pytest
from scipy.io import savemat

from study.importing.array_groups import find_runs
from study.importing.arrays.read_arrays import read_arrays
from study.importing.build_recording import build_recording
from study.importing.header_map import find_header_problems
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_toml import parse_map
from study.importing.map_skeleton import make_map_skeleton

SLOW, FAST = np.arange(200) / 100, np.arange(400) / 200
FORCE, PLACE = np.sin(7 * SLOW), np.cos(7 * FAST)


def proposed(path):
    return make_map_skeleton(read_arrays(path, CsvMap()))


def imported(path, text):
    """By the proposal, completed with what it leaves open."""
    text = text.replace('device = ""', 'device = "rig"').replace('time_unit = ""', 'time_unit = "s"')
    text = text.replace('value = "force', 'resample = "held"\nvalue = "force').replace('role = "" ', 'role = "helper" ')
    return build_recording(parse_map(text, path), [path]).recording


def signal(time, values):
    return {"time": time[:, None], "signals": {"values": values[:, None], "dimensions": 1.0, "label": "x"}}


def columns(turned=False):
    force, place = np.column_stack([SLOW, FORCE]), np.column_stack([FAST, PLACE])
    return {"force_N": force.T if turned else force, "pos_mm": place.T if turned else place}


@pytest.mark.parametrize("kind", ["pairs", "rows", "npz", "structure"])
def test_each_signal_is_read_on_its_own_clock(tmp_path, kind):
    path = tmp_path / ("a.npz" if kind == "npz" else "a.mat")
    if kind == "structure":
        savemat(path, {"force_N": signal(SLOW, FORCE), "pos_mm": signal(FAST, PLACE), "tout": SLOW})
    elif kind == "npz":
        np.savez(path, **columns())
    else:
        savemat(path, columns(turned=kind == "rows"))
    text = proposed(path)
    assert (text.count("[[clock]]"), text.count("[[channel]]")) == (2, 2)
    found = imported(path, text)
    assert (found.command.channels, found.command.unit) == (("force_N",), "N")
    assert (found.response.channels, found.response.unit) == (("pos_mm",), "m")
    assert found.sample_rate_hz == 200
    np.testing.assert_allclose(found.response.samples[:, 0], PLACE[: len(found)] / 1000)
    np.testing.assert_array_equal(found.command.samples[::2, 0], FORCE)


def test_signals_of_one_time_share_a_clock(tmp_path):
    np.savez(tmp_path / "a.npz", force_N=np.column_stack([SLOW, FORCE]), pos_mm=np.column_stack([SLOW, FORCE**2]))
    text = proposed(tmp_path / "a.npz")
    assert text.count("[[clock]]") == 1
    assert "clock = " not in text


def test_a_table_of_values_has_no_time_and_a_ramp_beside_the_time_is_a_value(tmp_path):
    np.savez(tmp_path / "a.npz", y=np.column_stack([FORCE, FORCE]), pull=np.column_stack([SLOW, SLOW**2]))
    text = proposed(tmp_path / "a.npz")
    assert [line for line in text.splitlines() if line.startswith("value")] == [
        'value = "y[:, 0]"',
        'value = "y[:, 1]"',
        'value = "pull[:, 1]"',
    ]


def test_several_structures_are_numbered(tmp_path):
    several = np.empty((1, 2), dtype=[("values", object), ("label", object)])
    several[0, 0], several[0, 1] = (FORCE[:, None], "force"), (2 * FORCE[:, None], "place")
    savemat(tmp_path / "a.mat", {"scope": {"time": SLOW, "signals": several}})
    found = read_arrays(tmp_path / "a.mat", CsvMap()).by_name
    np.testing.assert_array_equal(found["scope.signals.2.values"], 2 * FORCE)
    assert 'value = "scope.signals.1.values"' in proposed(tmp_path / "a.mat")


@pytest.mark.parametrize(("start_s", "are_runs"), [(34.26, False), (0.0, True), (SLOW[1] - SLOW[0], True)])
def test_scopes_of_one_recording_are_no_runs(tmp_path, start_s, are_runs):
    """Runs may each begin at zero, or a step later; at another time only what was recorded at once begins together."""
    scopes = {f"scope{number}": signal(SLOW + start_s, number * FORCE) for number in (1, 2)}
    savemat(tmp_path / "a.mat", scopes)
    text = proposed(tmp_path / "a.mat")
    assert ("[[part]]" in text) == are_runs
    assert ('value = "scope2.signals.values"' in text) != are_runs


def test_runs_with_the_same_rising_command_are_runs():
    command = 2 + np.arange(40.0)
    arrays = {f"run{run}/{name}": array for run in (1, 2) for name, array in (("u", command), ("y", run * command))}
    assert find_runs(arrays, 16).prefixes == ("run1/", "run2/")


def element(kind, content):
    return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)


def test_an_object_of_matlab_is_named_with_what_to_save_instead(tmp_path):
    words = b"".join(element(1, word) for word in (b"pos", b"MCOS", b"timeseries"))
    inner = element(14, element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 0, 0)) + element(1, b""))
    matrix = element(14, element(6, struct.pack("<II", 17, 0)) + words + inner)
    (tmp_path / "a.mat").write_bytes(b" " * 124 + struct.pack("<H", 0x0100) + b"IM" + matrix)
    arrays = read_arrays(tmp_path / "a.mat", CsvMap())
    mend = "in Matlab: pos = struct('time', pos.Time, 'values', pos.Data)"
    said = f"it holds no arrays of numbers ('pos' is an object of the class timeseries); {mend}"
    assert find_header_problems(arrays) == (said,)
    assert "struct('time', pos.Time, 'values', pos.Data)" in make_map_skeleton(arrays)
