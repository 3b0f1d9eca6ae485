"""The governed tick, one rule after the other, as a rig feels it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from study.devices.device import Fault, Health
from study.devices.drive.runner import CompiledRunner
from study.devices.governor import cells, govern
from study.devices.governor.governor import Governor


class Bench:
    """A governor on a mass, with no checks before it: what reaches the tick here may be anything."""

    def __init__(self, rigs, settings=None) -> None:
        self.rigs = rigs
        self.rig = rigs.compiled_rig()
        self.governor = Governor(self.rig.info, settings or rigs.SETTINGS)
        self.runner = CompiledRunner(self.rig, self.governor, 50)

    def hold(self, stimulus, ticks: int):
        self.governor.begin_hold(stimulus)
        return self.go_on(ticks)

    def go_on(self, ticks: int):
        """With signs of life. All forces so far."""
        for _ in range(0, ticks, 10):
            if self.governor.moving:
                self.governor.sign_of_life()
                self.runner.run(10)
        return self.forces()

    def lean(self, x: float, y: float, z: float) -> None:
        self.rig.state[self.rigs.LEAN : self.rigs.LEAN + 3] = x, y, z

    def forces(self):
        return self.rigs.written(self.rig)

    def health(self) -> Health:
        return self.governor.health()

    def gained(self):
        return self.governor.rows()[:, 3:6]


@pytest.fixture
def bench(rigs):
    return Bench(rigs)


def without_spring(rigs):
    return replace(rigs.SETTINGS, spring_frequency_hz=0.0, spring_damping_n_s_per_m=0.0)


def test_the_faults_have_the_numbers_that_the_compiled_tick_gives_them():
    numbers = [getattr(cells, fault.name if fault is not Fault.NONE else "NO_FAULT") for fault in Fault]
    assert numbers == list(range(len(Fault)))


def test_without_spring_the_force_is_the_faded_stimulus_and_nothing_else(rigs):
    bench, stimulus = Bench(rigs, without_spring(rigs)), rigs.sine(2.0, fade_s=0.1)
    forces = bench.hold(stimulus, 400)
    ticks = np.arange(400)
    gain = np.where(ticks < 100, 0.5 - 0.5 * np.cos(np.pi * ticks / 100), 1.0)
    assert np.allclose(forces, gain[:, None] * np.tile(stimulus.loop.samples, (2, 1)), atol=1e-12)
    assert bench.health().slew_limited == bench.health().stimulus_clipped == 0


def test_a_release_fades_as_the_stimulus_says_and_ends_at_zero(rigs):
    bench = Bench(rigs, without_spring(rigs))
    bench.hold(rigs.sine(2.0, fade_s=0.1), 400)
    bench.governor.ask_release()
    forces = bench.go_on(200)
    expected = (
        np.tile(rigs.sine(2.0).loop.samples, (3, 1))[400:501]
        * (0.5 + 0.5 * np.cos(np.pi * np.arange(101) / 100))[:, None]
    )
    assert np.allclose(forces[400:501], expected, atol=1e-12)
    assert not forces[500:].any()
    assert not bench.governor.moving


def test_a_release_during_the_fade_in_starts_from_where_that_was(rigs):
    bench = Bench(rigs, without_spring(rigs))
    bench.hold(rigs.sine(3.0, fade_s=0.5), 250)
    bench.governor.ask_release()
    forces = bench.go_on(600)
    assert rigs.violations(forces, rigs.LIMITS) == []
    assert np.linalg.norm(forces, axis=1).max() <= 1.5 + 1e-9
    assert not forces[-1].any()


def test_a_linear_fade_is_a_straight_line(rigs):
    bench = Bench(rigs, without_spring(rigs))
    ones = replace(rigs.sine(), loop=rigs.force(np.tile([1.0, 0.0, 0.0], (50, 1))), fade_shape="linear")
    assert np.allclose(bench.hold(ones, 100)[:, 0], np.arange(100) / 100)


def test_the_spring_pulls_towards_the_centre_with_its_stiffness(bench, rigs):
    bench.rig.parameters[0] = 1e6  # too heavy to move
    bench.lean(0.003, -0.006, 0.0)
    force = bench.hold(rigs.sine(0.0), 450)[-1]  # later it gives way
    assert np.allclose(force, rigs.MASS_KG * (2 * math.pi * 3.5) ** 2 * np.array([-0.003, 0.006, 0.0]), rtol=1e-4)


def test_the_spring_is_centred_where_the_settings_say(rigs):
    bench = Bench(rigs, replace(rigs.SETTINGS, place_m=(0.0, 0.02, 0.0)))
    bench.rig.parameters[0] = 1e6
    force = bench.hold(rigs.sine(0.0), 450)[-1]  # later it gives way
    assert force[1] > 0
    assert force[0] == force[2] == 0


def test_virtual_damping_works_against_the_speed(rigs):
    bench = Bench(rigs, replace(rigs.SETTINGS, spring_frequency_hz=0.0, spring_damping_n_s_per_m=5.0))
    bench.rig.parameters[:2] = 1e6, 0.0
    bench.rig.state[3] = 0.1
    assert bench.hold(rigs.sine(0.0), 500)[-1, 0] == pytest.approx(-0.5, rel=1e-4)


def test_a_stimulus_above_its_cap_is_shortened_in_its_direction_and_counted(rigs):
    bench = Bench(rigs, without_spring(rigs))
    bench.rig.parameters[1] = 200.0  # slow enough to stay where a handle can be
    steady = rigs.sine()
    forces = bench.hold(replace(steady, loop=rigs.force(np.tile([0.0, 30.0, 40.0], (50, 1)))), 300)
    assert np.allclose(forces[-1], [0.0, 1.8, 2.4], rtol=1e-9)
    assert bench.health().stimulus_clipped == 300


def test_a_stimulus_just_at_its_cap_is_not_counted_as_clipped(bench, rigs):
    bench.hold(rigs.sine(3.0), 400)
    assert bench.health().stimulus_clipped == 0


def test_a_lean_on_the_spring_is_cut_at_the_feedbacks_cap_in_its_direction_and_counted(bench, rigs):
    bench.rig.parameters[0] = 1e6
    bench.lean(0.0, -0.03, -0.04)
    forces = bench.hold(rigs.sine(0.0), 500)
    assert np.linalg.norm(forces[-1]) == pytest.approx(1.5, rel=1e-6)
    assert np.allclose(forces[-1] / 1.5, [0.0, 0.6, 0.8])
    assert bench.health().feedback_clipped > 300
    assert bench.health().total_clipped == 0
    assert rigs.violations(forces, rigs.LIMITS) == []


def test_stimulus_and_lean_together_are_cut_at_the_total_cap_in_their_direction_and_counted(rigs):
    bench = Bench(rigs, replace(rigs.SETTINGS, limits=replace(rigs.LIMITS, total_cap_n=3.5)))
    bench.rig.parameters[:2] = 10.0, 200.0
    bench.lean(0.0, -0.03, -0.04)
    forces = bench.hold(replace(rigs.sine(), loop=rigs.force(np.tile([0.0, 1.8, 2.4], (50, 1)))), 500)
    assert np.linalg.norm(forces[-1]) == pytest.approx(3.5, rel=1e-9)
    assert np.allclose(forces[-1] / 3.5, [0.0, 0.6, 0.8], atol=1e-3)
    assert bench.health().total_clipped > 300
    assert rigs.violations(forces, replace(rigs.LIMITS, total_cap_n=3.5)) == []


def test_a_lean_with_a_large_speed_is_cut_at_the_feedbacks_cap_too(rigs):
    """The damper by itself, and the two together."""
    bench = Bench(rigs, replace(rigs.SETTINGS, spring_damping_n_s_per_m=20.0))
    bench.rig.parameters[:2] = 1e6, 0.0
    bench.lean(-0.05, 0.0, 0.0)
    bench.rig.state[3:5] = 0.1, 0.1
    forces = bench.hold(rigs.sine(0.0), 500)
    assert np.linalg.norm(forces, axis=1).max() == pytest.approx(1.5, rel=1e-9)
    assert bench.health().feedback_clipped > 100


def test_a_lean_does_not_change_what_is_recorded_as_excitation(bench, rigs):
    bench.lean(0.0, 0.05, 0.0)
    bench.hold(rigs.sine(1.0, fade_s=0.1), 500)
    assert np.allclose(bench.gained(), np.roll(np.tile(rigs.sine(1.0).loop.samples, (2, 1)), 100, axis=0), atol=1e-12)


def test_a_quick_handle_is_slowed_down_to_the_slew_limit_and_counted(rigs):
    bench = Bench(rigs, replace(rigs.SETTINGS, limits=replace(rigs.LIMITS, slew_n_per_s=100.0)))
    bench.hold(rigs.sine(0.0), 500)
    for x in np.linspace(0.0, 0.015, 11)[1:]:
        bench.lean(x, 0.0, 0.0)
        bench.runner.run(1)
    steps = np.linalg.norm(np.diff(bench.go_on(50), axis=0), axis=1) * 1000
    assert steps.max() == pytest.approx(100, rel=1e-9)
    assert bench.health().slew_limited > 5


BEYOND = {
    "OUTSIDE": lambda tick: 0.001 * tick,
    "JUMPED": lambda tick: 0.004 * (tick > 0),
    "SHAKEN": lambda tick: 0.0005 * (-1) ** tick,
}


@pytest.mark.parametrize("fault", BEYOND)
@pytest.mark.parametrize("played", [False, True])
def test_a_position_that_no_handle_has_lets_go_and_stays_so(bench, rigs, fault, played):
    """Within `release_s` of the reading that shows it, for a held stimulus and for commands."""
    if played:
        bench.governor.begin_play(rigs.force(np.tile(rigs.sine(2.0).loop.samples, (10, 1))))
        bench.go_on(700)
    else:
        bench.hold(rigs.sine(2.0), 700)
    for tick in range(400):
        bench.lean(BEYOND[fault](tick), 0.0, 0.0)
        bench.governor.sign_of_life()
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
def test_a_hand_at_rest_is_not_stale(rigs, amplitude_n, x):
    """Tiny forces, with a pull that friction holds: encoders may say the same for a minute."""
    bench = Bench(rigs, replace(rigs.SETTINGS, limits=replace(rigs.LIMITS, longest_hold_s=120.0)))
    bench.rig.parameters[0] = 1e12
    bench.lean(x, 0.0, 0.0)
    bench.hold(rigs.sine(amplitude_n), 60_000)
    assert bench.health().fault is Fault.NONE


def test_a_fault_of_the_encoders_is_over_with_the_next_stimulus(bench, rigs):
    bench.hold(rigs.sine(1.0), 300)
    bench.lean(0.02, 0.0, 0.0)
    bench.go_on(100)
    assert bench.health().fault is Fault.JUMPED
    bench.hold(rigs.sine(1.0), 300)
    assert bench.health().fault is Fault.NONE


@pytest.mark.parametrize("nonsense", [math.nan, math.inf, -math.inf, 0.51, -100.0, 1e308])
def test_a_position_where_no_handle_can_be_lets_go_within_the_release(bench, rigs, nonsense):
    bench.hold(rigs.sine(3.0, 45), 408)
    bench.lean(0.0, nonsense, 0.0)
    forces = bench.go_on(100)
    assert bench.health().fault is Fault.NOT_A_NUMBER
    assert not forces[410 + 50 :].any()
    assert rigs.violations(forces, rigs.LIMITS) == []


@pytest.mark.parametrize("nonsense", [math.nan, math.inf, -1e300])
def test_a_stimulus_that_is_no_number_lets_go(bench, rigs, nonsense):
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


def test_the_longest_hold_ends_a_stimulus_that_nobody_answers(rigs):
    limits = replace(rigs.LIMITS, longest_hold_s=1.0)
    bench = Bench(rigs, replace(rigs.SETTINGS, limits=limits))
    forces = bench.hold(rigs.sine(2.0), 2000)
    assert bench.health().fault is Fault.HELD_TOO_LONG
    assert len(forces) == 1050


def test_the_emergency_stop_is_zero_at_the_very_next_tick_and_for_good(bench, rigs):
    bench.hold(rigs.sine(3.0, 5), 450)
    bench.governor.ask_stop()
    forces = bench.go_on(10)
    assert np.linalg.norm(forces[449]) > 0.5
    assert len(forces) == 451
    assert not forces[450].any()
    assert bench.health().fault is Fault.STOPPED
    assert not bench.hold(rigs.sine(3.0), 100)[451:].any()


def test_a_safety_release_needs_no_sensor_and_goes_straight_to_zero(bench, rigs):
    bench.hold(rigs.sine(3.0), 450)
    bench.governor.ask_let_go()
    bench.lean(math.nan, 0.0, 0.0)
    forces = bench.go_on(100)
    last = forces[449]
    assert np.allclose(forces[450:500], np.outer(1 - np.arange(1, 51) / 50, last), atol=1e-12)
    assert bench.health().fault is Fault.NONE


def test_what_a_slow_slew_limit_holds_up_is_let_go_at_the_end_of_the_fade(rigs):
    bench = Bench(rigs, replace(rigs.SETTINGS, limits=replace(rigs.LIMITS, slew_n_per_s=5.0)))
    bench.lean(0.0, 0.3, 0.0)
    bench.hold(rigs.sine(0.0, fade_s=0.05), 1000)
    bench.governor.ask_release()
    forces = bench.go_on(200)
    assert len(forces) <= 1000 + 50 + 1 + 50
    assert not forces[-1].any()


@pytest.mark.parametrize("cap", [math.nan, -1.0, 0.0])
def test_a_cap_that_is_no_cap_means_no_force(bench, rigs, cap):
    bench.governor.settings[govern.TOTAL_CAP] = cap
    assert not bench.hold(rigs.sine(3.0), 300).any()


def test_missed_ticks_are_rows_without_readings_in_which_the_force_was_held(bench, rigs):
    bench.hold(rigs.sine(2.0, fade_s=0.0), 20)
    bench.governor.miss(3)
    bench.go_on(10)
    rows = bench.governor.rows()
    assert len(rows) == 33
    assert (rows[20:23, 0:3] == rows[19, 0:3]).all()
    assert np.isnan(rows[20:23, 6:]).all()
    assert bench.health().missed_ticks == 3
    assert np.allclose(rows[23:33, 3:6], rigs.sine(2.0).loop.samples[23:33])


def test_ticks_missed_at_the_end_of_commands_do_not_shift_what_was_recorded(bench, rigs):
    commands = rigs.force(np.linspace(0.0, 1.0, 301)[:, None] * [1.0, 0.0, 0.0])
    bench.governor.begin_play(commands)
    bench.go_on(790)
    bench.governor.miss(30)  # 500 to settle, 301 to play
    bench.go_on(100)
    assert np.allclose(bench.gained()[:290], commands.samples[:290])
    assert len(bench.governor.rows()) == 301
    assert bench.health().missed_ticks == 30


def test_the_clips_of_the_sensor_are_counted(bench, rigs):
    bench.rig.parameters[2] = -1.0
    bench.hold(rigs.sine(), 50)
    assert bench.health().sensor_clipped == 50


def test_the_peak_is_the_largest_norm_that_was_written(bench, rigs):
    forces = bench.hold(rigs.sine(2.0), 700)
    assert bench.health().peak_command_n == np.sqrt((forces**2).sum(axis=1)).max()
