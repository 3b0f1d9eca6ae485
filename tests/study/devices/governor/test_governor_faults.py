"""Faults that release the handle: positions, missing signs of life, the longest hold, the emergency stop."""

import math
from dataclasses import replace

import numpy as np
import pytest

from study.devices.device import Fault
from study.devices.governor import cells
from tests.study.devices.governor.bench import Bench


def test_the_faults_have_the_numbers_that_the_compiled_tick_gives_them():
    numbers = [getattr(cells, fault.name if fault is not Fault.NONE else "NO_FAULT") for fault in Fault]
    assert numbers == list(range(len(Fault)))


BEYOND = {
    "OUTSIDE": lambda tick: 0.001 * tick,
    "JUMPED": lambda tick: 0.004 * (tick > 0),
    "SHAKEN": lambda tick: 0.0005 * (-1) ** tick,
}


@pytest.mark.parametrize("fault", BEYOND)
@pytest.mark.parametrize("played", [False, True])
def test_an_impossible_position_releases_the_handle_for_good(bench, rigs, fault, played):
    """Within `release_s` of the reading that shows it, for a held stimulus and for commands."""
    if played:
        bench.governor.begin_play(rigs.force(np.tile(rigs.sine(2.0).loop.samples, (10, 1))))
        bench.go_on(700)
    else:
        bench.hold(rigs.sine(2.0), 700)
    for tick in range(400):
        bench.lean(BEYOND[fault](tick), 0.0, 0.0)
        bench.governor.restart_watchdog()
        bench.runner.run(1)
    assert bench.health().fault is Fault[fault]
    assert not bench.governor.moving
    assert not bench.forces()[-1].any()
    assert rigs.violations(bench.forces(), rigs.LIMITS) == []


def test_a_frozen_position_lets_go_soon_where_the_stimulus_must_move_it(bench, rigs):
    bench.hold(rigs.sine(2.0), 410)
    bench.rig.parameters[0] = 1e9
    bench.rig.state[3:6] = 0.0
    forces = bench.go_on(600)
    assert bench.health().fault is Fault.STALE
    assert len(forces) < 410 + 100 + 200 + 50


def test_a_frozen_position_lets_go_within_a_second_where_the_spring_pulls(bench, rigs):
    bench.rig.parameters[0] = 1e9
    bench.lean(0.0, 0.02, 0.0)
    forces = bench.hold(rigs.sine(0.2), 2000)
    assert bench.health().fault is Fault.STALE
    assert len(forces) <= 1000 + 51
    assert np.linalg.norm(forces, axis=1).max() <= 1.5 + 0.2


def test_the_spring_gives_way_to_a_position_that_stands_still_before_it_is_stale(bench, rigs):
    """Slowly, and never the other way: a hand at rest would give way with it."""
    bench.rig.parameters[0] = 1e9
    bench.lean(0.0, 0.02, 0.0)
    norms = np.linalg.norm(bench.hold(rigs.sine(0.0), 2000), axis=1)
    assert bench.health().fault is Fault.STALE
    told = int(np.flatnonzero(np.diff(norms) < -0.01)[0])
    assert norms[told] < 1.5 - 0.5
    assert (np.diff(norms)[400:told] <= 0.0).all()


@pytest.mark.parametrize(("amplitude_n", "x"), [(0.0, 0.0), (0.3, 0.0), (0.4, 0.003), (0.0, -0.003)])
def test_a_hand_at_rest_is_not_taken_for_frozen_encoders(rigs, amplitude_n, x):
    """Tiny forces, with a pull that friction holds: encoders may say the same for a minute."""
    bench = Bench(rigs, replace(rigs.SETTINGS, limits=replace(rigs.LIMITS, longest_hold_s=120.0)))
    bench.rig.parameters[0] = 1e12
    bench.lean(x, 0.0, 0.0)
    bench.hold(rigs.sine(amplitude_n), 60_000)
    assert bench.health().fault is Fault.NONE


def test_an_encoder_fault_is_cleared_by_the_next_stimulus(bench, rigs):
    bench.hold(rigs.sine(1.0), 300)
    bench.lean(0.02, 0.0, 0.0)
    bench.go_on(100)
    assert bench.health().fault is Fault.JUMPED
    bench.hold(rigs.sine(1.0), 300)
    assert bench.health().fault is Fault.NONE


@pytest.mark.parametrize(("missed_ticks", "fault"), [(90, Fault.JUMPED), (110, Fault.STALLED)])
@pytest.mark.parametrize("x_m", [0.06, 0.2])
def test_after_a_pause_within_a_tick_the_pause_is_the_fault_and_not_the_way_gone_meanwhile(
    bench, rigs, missed_ticks, fault, x_m
):
    """The reading is taken after the pause, the tick began before it."""
    bench.hold(rigs.sine(2.0), 408)
    bench.governor.record_missed_ticks(missed_ticks)
    bench.governor.restart_watchdog()
    bench.lean(x_m, 0.0, 0.0)
    forces = bench.go_on(100)
    assert bench.health().fault is (Fault.OUTSIDE if fault is Fault.JUMPED and x_m > 0.12 else fault)
    assert not forces[-1].any()
    assert rigs.violations(forces, rigs.LIMITS) == []


@pytest.mark.parametrize(
    ("place_m", "fault"),
    [
        *((value, Fault.NOT_A_NUMBER) for value in (math.nan, math.inf, -math.inf, 0.51, -100.0, 1e308)),
        *((value, Fault.OUTSIDE) for value in (0.125, -0.125, 0.49)),
    ],
)
def test_a_position_outside_the_workspace_releases_within_the_release_time(bench, rigs, place_m, fault):
    """What no handle can reach, and what this one does not."""
    bench.hold(rigs.sine(3.0, 45), 408)
    bench.lean(0.0, place_m, 0.0)
    forces = bench.go_on(100)
    assert bench.health().fault is fault
    assert not forces[410 + 50 :].any()
    assert rigs.violations(forces, rigs.LIMITS) == []


@pytest.mark.parametrize("nonsense", [math.nan, math.inf, -1e300])
def test_a_stimulus_that_is_not_finite_releases_the_handle(bench, rigs, nonsense):
    loop = np.tile([1.0, 0.0, 0.0], (300, 1))
    loop[250, 1] = nonsense
    forces = bench.hold(replace(rigs.sine(), loop=rigs.force(loop)), 400)
    assert bench.health().fault is Fault.NOT_A_NUMBER
    assert len(forces) == 300
    assert rigs.violations(forces, rigs.LIMITS) == []


def test_without_a_sign_of_life_the_force_fades_to_zero(bench, rigs):
    bench.hold(rigs.sine(3.0), 100)
    bench.runner.run(1000)
    forces = bench.forces()
    assert bench.health().fault is Fault.STALLED
    assert 390 <= len(forces) <= 100 + 300 + 50 + 1
    assert not forces[-1].any()
    assert rigs.violations(forces, rigs.LIMITS) == []


def test_the_longest_hold_ends_a_stimulus_without_an_answer(rigs):
    limits = replace(rigs.LIMITS, longest_hold_s=1.0)
    bench = Bench(rigs, replace(rigs.SETTINGS, limits=limits))
    forces = bench.hold(rigs.sine(2.0), 2000)
    assert bench.health().fault is Fault.HELD_TOO_LONG
    assert len(forces) == 1050


def test_the_emergency_stop_is_zero_at_the_very_next_tick_and_for_good(bench, rigs):
    bench.hold(rigs.sine(3.0, 5), 450)
    bench.governor.request_stop()
    forces = bench.go_on(10)
    assert np.linalg.norm(forces[449]) > 0.5
    assert len(forces) == 451
    assert not forces[450].any()
    assert bench.health().fault is Fault.STOPPED
    assert not bench.hold(rigs.sine(3.0), 100)[451:].any()


def test_a_safety_release_needs_no_sensor_and_goes_straight_to_zero(bench, rigs):
    bench.hold(rigs.sine(3.0), 450)
    bench.governor.request_let_go()
    bench.lean(math.nan, 0.0, 0.0)
    forces = bench.go_on(100)
    last = forces[449]
    assert np.allclose(forces[450:500], np.outer(1 - np.arange(1, 51) / 50, last), atol=1e-12)
    assert bench.health().fault is Fault.NONE


def test_a_force_delayed_by_the_slew_limit_is_zero_at_the_end_of_the_fade(rigs):
    bench = Bench(rigs, replace(rigs.SETTINGS, limits=replace(rigs.LIMITS, slew_n_per_s=5.0)))
    bench.lean(0.0, 0.3, 0.0)
    bench.hold(rigs.sine(0.0, fade_s=0.05), 1000)
    bench.governor.request_release()
    forces = bench.go_on(200)
    assert len(forces) <= 1000 + 50 + 1 + 50
    assert not forces[-1].any()
