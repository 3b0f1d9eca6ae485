"""The governed tick as a rig feels it: fade, spring, damping, caps, slew limit, and what is recorded of them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from study.devices.governor import govern
from tests.study.devices.governor.bench import Bench


def without_spring(rigs):
    return replace(rigs.SETTINGS, spring_frequency_hz=0.0, spring_damping_n_s_per_m=0.0)


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
    bench.governor.request_release()
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
    bench.governor.request_release()
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


@pytest.mark.parametrize("cap", [math.nan, -1.0, 0.0])
def test_a_cap_that_is_not_positive_means_no_force(bench, rigs, cap):
    bench.governor.settings[govern.TOTAL_CAP] = cap
    assert not bench.hold(rigs.sine(3.0), 300).any()


def test_missed_ticks_are_rows_without_readings_in_which_the_force_was_held(bench, rigs):
    bench.hold(rigs.sine(2.0, fade_s=0.0), 20)
    bench.governor.record_missed_ticks(3)
    bench.go_on(10)
    rows = bench.governor.copy_rows()
    assert len(rows) == 33
    assert (rows[20:23, 0:3] == rows[19, 0:3]).all()
    assert np.isnan(rows[20:23, 6:]).all()
    assert bench.health().missed_ticks == 3
    assert np.allclose(rows[23:33, 3:6], rigs.sine(2.0).loop.samples[23:33])


def test_ticks_missed_at_the_end_of_commands_do_not_shift_what_was_recorded(bench, rigs):
    commands = rigs.force(np.linspace(0.0, 1.0, 301)[:, None] * [1.0, 0.0, 0.0])
    bench.governor.begin_play(commands)
    bench.go_on(790)
    bench.governor.record_missed_ticks(30)  # 500 to settle, 301 to play
    bench.go_on(100)
    assert np.allclose(bench.gained()[:290], commands.samples[:290])
    assert len(bench.governor.copy_rows()) == 301
    assert bench.health().missed_ticks == 30


def test_the_clips_of_the_sensor_are_counted(bench, rigs):
    bench.rig.parameters[2] = -1.0
    bench.hold(rigs.sine(), 50)
    assert bench.health().sensor_clipped == 50


def test_the_peak_is_the_largest_norm_that_was_written(bench, rigs):
    forces = bench.hold(rigs.sine(2.0), 700)
    assert bench.health().peak_command_n == np.sqrt((forces**2).sum(axis=1)).max()
