"""The exported C, compiled as strictly as a user may, against Python; and what a user is told."""

import ctypes
import json
import re
from pathlib import Path

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.trajectory import Trajectory
from equalizer.tracking.lqr.changing_direction import play
from equalizer.tracking.realtime.controller_cases import TICKS_AFTER, compute_controller_cases
from equalizer.tracking.realtime.realtime_controller import RealtimeSettings
from study.cli.main import main
from study.store.formats.identified_model_file import write_identified_model
from study.store.formats.trajectory_file import write_trajectory
from study.workflows.equalizer.controller.export_controller import (
    MAX_PREVIEW_S,
    ControllerPlan,
    export_controller,
)
from tests.study.workflows.equalizer.controller.build import CHANNELS, build, compiled_cpp, run, write_model


@pytest.mark.slow
@pytest.mark.parametrize(
    ("band_hz", "order"), [((5.0, 35.0), 26), ((0.5, 499.5), 5)], ids=["three bands, order 26", "a single band"]
)
def test_it_compiles_without_a_warning_and_agrees_with_python(vendor, tmp_path, band_hz, order):
    out = tmp_path / "out"
    export_controller(ControllerPlan(write_model(tmp_path / "model.h5", band_hz, order), out))
    done = run(build(vendor, out, "check_controller.c"))
    assert done.returncode == 0, done.stdout
    transient, stream = map(float, re.findall(r"(?:transient|stream) (\S+) N", done.stdout.splitlines()[0]))
    assert 0 < transient < 3e-12 and 0 < stream < 3e-12
    assert re.search(r"a tick: transient \d+ ns, stream \d+ ns", done.stdout)


@pytest.mark.slow
def test_the_longest_preview_that_is_accepted_is_compared_too(vendor, tmp_path):
    """The first sample of a stream is played after it."""
    settings = RealtimeSettings(preview_s=MAX_PREVIEW_S)
    out = tmp_path / "out"
    exported = export_controller(ControllerPlan(write_model(tmp_path / "model.h5"), out, settings=settings))
    late = len(exported.controller.tracker) - 1
    assert late == 1999
    done = run(build(vendor, out, "check_controller.c"))
    assert done.returncode == 0, done.stdout
    forces = compute_controller_cases(exported.controller).stream_forces
    assert np.count_nonzero(np.abs(forces[late:]).max(axis=1) > 0.01) >= TICKS_AFTER


def test_the_measured_tick_of_the_page_is_below_a_microsecond():
    """A figure with its command, not a timed assertion: a busy machine says nothing about the code."""
    page = (Path(__file__).parents[5] / "docs" / "controller.md").read_text("utf-8")
    assert "python tests/benchmarks/bench_controller.py" in page
    measured = dict(re.findall(r"^\| (transient|stream) \| (\d+) ns \|", page, re.MULTILINE))
    assert sorted(measured) == ["stream", "transient"]
    assert all(0 < int(each) <= 1000 for each in measured.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("table", "share"), [("hapteq_gains", 0.05), ("hapteq_ahead", 0.0), ("hapteq_low_filter", 0.0)]
)
def test_the_check_notices_a_number_that_is_wrong_in_its_seventh_digit(vendor, exported, tmp_path, table, share):
    for path in exported.files:
        (tmp_path / path.name).write_text(path.read_text())
    header = tmp_path / "hapteq_controller.h"
    before, found, after = header.read_text().partition(f"double {table}[")
    values, end, rest = after.partition(";")
    numbers = list(re.finditer(r"-?\d\.\d{12,}(?:e-\d+)?", values))
    number = numbers[round(share * len(numbers))]  # the first gains meet a state at rest
    changed = repr(float(number.group()) * (1 + 1e-6))
    header.write_text(before + found + values[: number.start()] + changed + values[number.end() :] + end + rest)
    done = run(build(vendor, tmp_path, "check_controller.c"))
    assert done.returncode == 1, done.stdout


def test_the_header_is_cpp_too(vendor, exported, tmp_path):
    source = tmp_path / "twice.cpp"
    source.write_text('#include "hapteq_controller.h"\n#include "hapteq_controller.h"\nint main() {}\n')
    assert compiled_cpp(vendor, source, exported.plan.out)[1] == ""


BRIDGE = """
#include "hapteq_controller.h"
void transient(long ticks, const double *rotation, double *forces, unsigned long *limited)
{
    static hapteq_transient t;
    hapteq_transient_reset(&t);
    for (long k = 0; k < ticks; k++)
        hapteq_transient_tick(&t, rotation, forces + 3 * k);
    *limited = t.limited;
}
void stream(long ticks, const double *wanted, double *forces, unsigned long *limited)
{
    static hapteq_stream s;
    hapteq_stream_reset(&s);
    for (long k = 0; k < ticks; k++)
        hapteq_stream_tick(&s, wanted + 3 * k, forces + 3 * k);
    *limited = s.limited;
}
void rotation_to(const double *normal, double *rotation) { hapteq_rotation_to(normal, rotation); }
"""


@pytest.fixture(scope="module")
def bridge(vendor, exported):
    (exported.plan.out / "bridge.c").write_text(BRIDGE)
    return ctypes.CDLL(str(build(vendor, exported.plan.out, "bridge.c", "-shared", "-fPIC")))


def called(function, given: np.ndarray, ticks: int) -> tuple[np.ndarray, int]:
    pointer = ctypes.POINTER(ctypes.c_double)
    forces, limited = np.full((ticks, 3), np.nan), ctypes.c_ulong()
    given = np.ascontiguousarray(given)
    function(ctypes.c_long(ticks), given.ctypes.data_as(pointer), forces.ctypes.data_as(pointer), ctypes.byref(limited))
    return forces, limited.value


def test_forces_above_the_cap_are_shortened_and_counted(exported, bridge):
    rows = len(exported.controller.transient)
    free = play(exported.controller.transient, np.tile(np.eye(3), (rows, 1, 1))).forces
    above = 2 * exported.controller.cap_n / np.linalg.norm(free, axis=1).max()
    forces, limited = called(bridge.transient, above * np.eye(3), rows)
    assert limited > 0
    assert np.linalg.norm(forces, axis=1).max() <= exported.controller.cap_n
    assert np.linalg.norm(forces, axis=1).max() == pytest.approx(exported.controller.cap_n, rel=1e-9)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300])
def test_what_is_no_number_moves_nothing_and_does_not_stay(exported, bridge, bad):
    """The direction, direct feedthrough and the model's state: a wrong sample must not come back at every tick."""
    rotation = np.eye(3)
    rotation[0, 1] = bad
    forces, limited = called(bridge.transient, rotation, 50)
    assert not forces.any() and limited == 50
    wanted = np.random.default_rng(2).standard_normal((900, 3)) / 100
    right, _ = called(bridge.stream, np.where(np.arange(900)[:, None] == 3, 0.0, wanted), 900)
    wanted[3, 2] = bad
    forces, limited = called(bridge.stream, wanted, 900)
    assert limited == 1
    np.testing.assert_array_equal(forces, right)


def test_a_force_that_overflows_is_replaced_within_the_cap(exported, bridge):
    forces, limited = called(bridge.transient, 1e99 * np.eye(3), 5)
    assert np.isfinite(forces).all() and np.linalg.norm(forces, axis=1).max() <= exported.controller.cap_n
    assert limited == 5


@pytest.mark.parametrize("normal", [(0.0, 0.6, 0.8), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (-0.48, 0.6, -0.64)])
def test_the_last_axis_is_turned_to_the_normal(bridge, normal):
    pointer = ctypes.POINTER(ctypes.c_double)
    rotation, n = np.zeros((3, 3)), np.array(normal)
    bridge.rotation_to(n.ctypes.data_as(pointer), rotation.ctypes.data_as(pointer))
    np.testing.assert_allclose(rotation[:, 2], n)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_the_command_writes_three_files_and_says_what_they_do(tmp_path, capsys):
    model = write_model(tmp_path / "model.h5")
    samples = np.random.default_rng(1).standard_normal((40, 3))
    table = Trajectory(Signal(samples, 1000.0, "acceleration", "m/s^2", ("ax", "ay", "az")))
    write_trajectory(tmp_path / "knock.csv", table)
    out = tmp_path / "out"
    words = ["export-controller", str(model), "--out", str(out), "--transient", str(tmp_path / "knock.csv")]
    assert main([*words, "--preview", "20", "--cap", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert sorted(path.name for path in out.iterdir()) == sorted(Path(line).name for line in lines[:3])
    assert lines[3].startswith("Transient: 340 rows") and lines[4].startswith("Stream: 19 ms late")
    header = (out / "hapteq_controller.h").read_text()
    assert "#define HAPTEQ_CAP_N 2.0\n" in header and "knock.csv" in header and "model.h5 (SHA-256 " in header


@pytest.mark.parametrize(("cap", "warned"), [("3", False), ("3.5", True), ("20", True)])
def test_a_cap_above_what_a_hand_is_given_is_written_with_a_warning(tmp_path, capsys, cap, warned):
    words = ["export-controller", str(write_model(tmp_path / "model.h5")), "--out", str(tmp_path / "out")]
    assert main([*words, "--preview", "20", "--cap", cap, "--json"]) == 0
    said = capsys.readouterr()
    assert ("above the 3 N that hapteq plays with a hand on the handle" in said.err) == warned
    assert json.loads(said.out)["cap_n"] == float(cap)


def test_numbers_are_written_to_their_last_bit(exported):
    header = (exported.plan.out / "hapteq_controller.h").read_text()
    table = header.partition("double hapteq_gain[3][8] = ")[2].partition(";")[0]
    found = np.array([float(number) for number in re.findall(r"[-\d.e]+", table)])
    assert (found.reshape(3, 8) == exported.controller.tracker.K).all()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("there already", "exists already"),
        ("two axes", "not of three forces"),
        ("forces", "The table table.csv has the header time_s,fx,fy,fz; it must be time_s,ax,ay,az."),
        ("one axis", "The table table.csv has the header time_s,a; it must be time_s,ax,ay,az."),
        ("rate", "at 500 Hz"),
        ("long", "5001 rows"),
        ("preview", "2 s is the longest"),
        ("no weight", "no stationary gains"),
        ("silent", "The transient comes to no force"),
        ("strong", "the strongest device gives 20 N"),
        ("no states", "has no states"),
    ],
)
def test_what_cannot_be_exported_is_reported_and_nothing_is_written(tmp_path, capsys, change, says):
    order = 0 if change == "no states" else 8
    model = write_model(tmp_path / "model.h5", order=order, size=2 if change == "two axes" else 3)
    out, words = tmp_path / "out", []
    if change == "there already":
        out.mkdir()
    if change == "one axis":  # a table of `hapteq contact`
        write_trajectory(
            tmp_path / "table.csv", Trajectory(Signal(np.ones((20, 1)), 1000.0, "acceleration", "m/s^2", ("a",)))
        )
        words = ["--transient", str(tmp_path / "table.csv")]
    if change in ("forces", "rate", "long", "silent"):
        kind = ("force", "N", CHANNELS[0]) if change == "forces" else ("acceleration", "m/s^2", CHANNELS[1])
        rate_hz = 500.0 if change == "rate" else 1000.0
        samples = np.full((5001 if change == "long" else 20, 3), 0.0 if change == "silent" else 1.0)
        write_trajectory(tmp_path / "table.csv", Trajectory(Signal(samples, rate_hz, *kind)))
        words = ["--transient", str(tmp_path / "table.csv")]
    if change == "preview":
        words = ["--preview", "3000"]
    if change == "strong":
        words = ["--cap", "20.5"]
    if change == "no weight":
        no_feedthrough(tmp_path / "delayed.h5")
        model, words = tmp_path / "delayed.h5", ["--weight", "0"]
    assert main(["export-controller", str(model), "--out", str(out), *words]) == 1
    said = capsys.readouterr().err
    assert says in said and "Nothing was written." in said
    assert list(out.iterdir()) == [] if change == "there already" else not out.exists()


def no_feedthrough(path: Path) -> None:
    B = np.eye(4, 3)
    model = IdentifiedModel(
        0.5 * np.eye(4), B, np.zeros((3, 4)), np.zeros((3, 3)), 1000.0, (5.0, 35.0), "N", "m/s^2", *CHANNELS
    )
    write_identified_model(path, model)


def test_the_settings_are_those_of_the_plan(exported):
    assert exported.plan.settings == RealtimeSettings() and exported.controller.cap_n == 3.0
