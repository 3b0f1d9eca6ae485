"""The bare C loop beside a device's: compiled and run for real, and a verdict that agrees with the figures."""

import re
import shutil
import subprocess

import pytest

from study.session.views.participant_views import DeviceFinding
from study.workflows.checks import bare_loop
from study.workflows.checks.bare_loop import (
    BareLoopRun,
    BareLoopTiming,
    compare_with_bare_loop,
    run_bare_loop_in_parallel,
)


@pytest.mark.real_time
@pytest.mark.parametrize("raised_priority", [False, True])
def test_it_runs_beside_for_as_long_as_it_is_told(raised_priority):
    with run_bare_loop_in_parallel(0.3, 1000.0, raised_priority) as run:
        assert run.result is None
    assert run.result is not None and run.result.ticks == 300
    assert 0 <= run.result.late_ticks <= 300 and run.result.latest_s > 0
    assert raised_priority or not run.result.raised_priority


def test_its_source_compiles_without_a_warning(vendor, tmp_path):
    strict = [*vendor.compiler(), "-std=c11", "-O2", "-Wall", "-Wextra", "-Werror"]
    subprocess.run([*strict, "-o", str(tmp_path / "loop"), str(bare_loop.SOURCE)], check=True, timeout=120)


def beside(late: int, bare_late: int, ticks: int = 60_000) -> DeviceFinding:
    return compare_with_bare_loop(late, ticks, BareLoopRun(BareLoopTiming(60_000, bare_late, 0.0042, True)))


@pytest.mark.parametrize(("late", "bare_late"), [(0, 0), (3, 0), (150, 100), (170, 100), (1500, 1000), (10, 500)])
def test_as_many_late_ticks_as_a_bare_loop_times_one_and_a_half_are_fine(late, bare_late):
    found = beside(late, bare_late)
    assert found.fine and not found.advice
    assert re.search(rf"^{bare_late} of 60000 late .* this loop: {late} of 60000", found.value)


@pytest.mark.parametrize(("late", "bare_late"), [(12, 0), (250, 100), (1800, 1000), (60_000, 1000)])
def test_more_than_that_is_a_warning_with_what_to_do(late, bare_late):
    found = beside(late, bare_late)
    assert (found.fine, found.warning) == (False, True)
    assert found.advice


@pytest.mark.parametrize(("granted", "said"), [(True, "with"), (False, "without")])
def test_the_priority_that_the_bare_loop_got_is_told(granted, said):
    found = compare_with_bare_loop(5, 1000, BareLoopRun(BareLoopTiming(1000, 4, 0.0042, granted)))
    assert f" {said} real-time priority" in found.value


@pytest.mark.parametrize("bare_late", [0, 1, 17, 400])
def test_the_verdict_changes_at_the_number_that_it_names(bare_late):
    most = int(re.search(r"up to (\d+) are fine", beside(0, bare_late).value)[1])
    assert beside(most, bare_late).fine and not beside(most + 1, bare_late).fine
    assert most - 1.5 * bare_late == pytest.approx(3 * (most + 1.5**2 * bare_late) ** 0.5, abs=2.0)


def test_loops_of_different_lengths_are_compared_by_their_shares():
    assert beside(15, 300, ticks=3000).fine and not beside(150, 300, ticks=3000).fine


def test_without_a_compiler_it_is_said_that_nothing_was_compared(monkeypatch):
    monkeypatch.setattr(bare_loop, "_find_compiler", lambda: None)
    with run_bare_loop_in_parallel(1.0, 1000.0, True) as run:
        pass
    found = compare_with_bare_loop(5, 1000, run)
    assert found.fine and "not compared: no C compiler" in found.value


@pytest.mark.parametrize("tool", ["false", "true"])
def test_a_compiler_that_fails_or_makes_nothing_is_told(monkeypatch, tool):
    monkeypatch.setattr(bare_loop, "_find_compiler", lambda: [shutil.which(tool)])
    with run_bare_loop_in_parallel(1.0, 1000.0, True) as run:
        pass
    assert run.result is None and "not compared" in compare_with_bare_loop(5, 1000, run).value


def test_a_measurement_that_breaks_off_leaves_no_loop_behind():
    started = []

    class Noted(bare_loop.subprocess.Popen):
        def __init__(self, *arguments, **named) -> None:
            super().__init__(*arguments, **named)
            started.append(self)

    with pytest.MonkeyPatch().context() as patch, pytest.raises(ValueError, match="lost"):
        patch.setattr(bare_loop.subprocess, "Popen", Noted)
        with run_bare_loop_in_parallel(60.0, 1000.0, False):
            raise ValueError("lost")
    assert started[-1].poll() is not None
