"""The verdict on a computer's timing: it follows from the figures, and never says fine beside too late."""

import random

import numpy as np
import pytest

from study.session.stimulus.timing_verdict import (
    judge_late_ticks,
    judge_lateness,
    judge_load,
    judge_missed_ticks,
    summarize_lateness,
)


def finding(late_ms, simulated: bool, rate_hz: float = 1000.0):
    return judge_lateness(summarize_lateness(np.asarray(late_ms) / 1000.0, rate_hz), simulated)


def test_the_figures_are_those_of_the_measurement():
    lateness = summarize_lateness(np.arange(101) / 1000.0 / 100.0, 1000.0)
    assert (lateness.median_ms, lateness.p99_ms, lateness.longest_ms) == pytest.approx((0.5, 0.99, 1.0))
    assert lateness.missed_fraction == 0.0
    assert not lateness.too_late
    with pytest.raises(ValueError, match="no wake-up"):
        summarize_lateness(np.array([]), 1000.0)


def test_99_of_100_wake_ups_must_come_within_a_tick():
    assert finding([0.1] * 995 + [60.0] * 5, simulated=False).fine
    late = finding([0.1] * 985 + [60.0] * 15, simulated=False)
    assert late.wrong and late.advice.startswith("Close other programs")
    assert finding([1.5] * 100, simulated=False, rate_hz=500.0).fine
    assert finding([2.5] * 100, simulated=False, rate_hz=500.0).wrong


@pytest.mark.parametrize("seed", range(60))
def test_no_verdict_says_fine_of_what_is_too_late(seed):
    draw = random.Random(seed)
    scale_ms = 10 ** draw.uniform(-2, 2.5)
    late_ms = [draw.choice((0.0, draw.expovariate(1 / scale_ms))) for _ in range(draw.randint(1, 300))]
    for simulated in (True, False):
        said = finding(late_ms, simulated)
        too_late = bool(np.percentile(late_ms, 99) >= 1.0)
        assert said.fine is not too_late, f"seed {seed}"
        assert ("too late" in said.value) is too_late
        assert said.warning is (too_late and simulated)
        assert bool(said.advice) is too_late
        assert said.verdict == (("warn" if simulated else "look") if too_late else "ok")


def test_a_measurement_that_is_no_number_is_not_fine():
    assert not finding([float("nan")] * 5, simulated=True).fine
    assert not judge_load(float("nan")).fine


def test_load_is_a_warning_and_never_more():
    assert judge_load(0.75).fine
    assert judge_load(None).fine
    busy = judge_load(3.36)
    assert (busy.fine, busy.warning) == (False, True)
    assert busy.value == "336% of what its processors can do, over the last minute; above 75% trials may be cut short"


@pytest.mark.parametrize("load", [None, 0.3, 1.0, 3.0])
@pytest.mark.parametrize("missed", [0, 19, 20, 21, 99, 100, 101])
def test_missed_ticks_are_late_ticks_and_judged_as_these(missed, load):
    """Else one line said fine of what the other calls wrong."""
    found = judge_missed_ticks(missed, 10_000, simulated=False, load_per_processor=load)
    assert found.fine is judge_late_ticks(missed, 2.0, 10_000, load).fine
    assert ("at most" in found.value) is not found.fine


@pytest.mark.parametrize("load", [None, 0.0, 0.99, float("nan")])
@pytest.mark.parametrize(("late", "fine"), [(0, True), (20, True), (21, False), (10_000, False)])
def test_late_ticks_of_a_real_loop_are_judged_by_their_share(late, fine, load):
    finding = judge_late_ticks(late, 3.21, 10_000, load)
    assert (finding.fine, finding.warning) == (fine, False)
    assert f"{late} of 10000" in finding.value and "the latest 3.2 ms after its time" in finding.value
    assert finding.value.endswith("at most 0.2% are fine") != fine


@pytest.mark.parametrize(("late", "fine", "told"), [(20, True, False), (100, True, True), (101, False, True)])
def test_with_all_cores_busy_more_late_ticks_are_fine_and_it_is_said(late, fine, told):
    finding = judge_late_ticks(late, 3.21, 10_000, 1.0)
    assert (finding.fine, finding.warning) == (fine, False)
    assert finding.value.endswith("at most 1.0% are fine with all cores busy (0.2% else)") == told
