"""Effects that were named, taken into the feedforward: on a device that rubs, with models of three kinds."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.frequency_response.transfer_estimate import estimate_transfer
from equalizer.identification.state_space.identify import identify
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel, ModelEffect, SensorLimits
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from equalizer.tracking.compensation.effect_compensation import compensate
from equalizer.tracking.compensation.effect_roles import IN_MODEL_REASON
from equalizer.tracking.compensation.known_forces import (
    LAWS,
    compute_deadband_describing_function,
    compute_equivalent_impedance,
)
from equalizer.tracking.compensation.law_compensation import SENSOR_ERROR
from equalizer.tracking.compensation.subtract_effects import subtract_effects
from equalizer.tracking.feedforward.band_pass import filter_to_band
from equalizer.tracking.feedforward.planned_motion import integrate_motion
from equalizer.tracking.learning.iteration import rms
from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingWeights, make_tracking_problem

RATE_HZ, BAND_HZ, AROUND, PERIOD = 1000.0, (5.0, 35.0), 300, 10_000
FORCES, ACCELERATIONS = ("fx", "fy", "fz"), ("ax", "ay", "az")


def physics(*effects: ModelEffect) -> MechanicalModel:
    identity = np.eye(3)
    sensor, actuator = SensorLimits(bandwidth_hz=500), ActuatorLimits(delay_s=0.001, bandwidth_hz=600)
    return MechanicalModel(
        "device", "acceleration", 0.28 * identity, identity, identity, identity, identity, sensor, actuator, effects
    )


def friction(level, axis=None) -> ModelEffect:
    return ModelEffect("coulomb_friction", axis, {"level": level})


@pytest.fixture(scope="module")
def frictionless(plants) -> IdentifiedModel:
    plant = plants.omega_like()
    return IdentifiedModel(
        plant.A, plant.B, plant.C, np.zeros((3, 3)), RATE_HZ, BAND_HZ, "N", "m/s^2", FORCES, ACCELERATIONS
    )


@pytest.fixture(scope="module")
def wanted() -> np.ndarray:
    noise = filter_to_band(np.random.default_rng(7).standard_normal((6000, 3)), RATE_HZ, BAND_HZ)[2000:4000]
    fade = np.clip(np.minimum(np.arange(2000), np.arange(2000)[::-1]) / 100, 0, 1)[:, None]
    rows = np.zeros((2000 + 2 * AROUND, 3))
    rows[AROUND:-AROUND] = 1.8 * noise / noise.std(axis=0) * (0.5 - 0.5 * np.cos(np.pi * fade))
    return filter_to_band(rows, RATE_HZ, BAND_HZ)


def inverse(model, wanted) -> np.ndarray:
    return track(
        compute_stored_gains(make_tracking_problem(model, TrackingWeights(weight=1e-3)), len(wanted)), wanted
    ).forces


def error(device, forces, wanted) -> float:
    return rms(filter_to_band(device.play(forces) - wanted, RATE_HZ, BAND_HZ)) / rms(wanted)


def recorded(device, commands, seed) -> Recording:
    """Two periods; the first holds the transient."""
    twice = np.tile(commands, (2, 1))
    segment = Segment(0, 2 * PERIOD, "multisine", float(np.abs(commands).max()), PERIOD)
    return Recording(
        "rubbing",
        Signal(twice, RATE_HZ, "force", "N", FORCES),
        Signal(device.measured(twice, seed), RATE_HZ, "acceleration", "m/s^2", ACCELERATIONS),
        excitation=Signal(twice, RATE_HZ, "force", "N", FORCES),
        segments=(segment,),
    )


def swept(plants, device) -> list[Recording]:
    """One axis after the other, as published."""
    sweep = plants.sweep(4.5, 37, PERIOD / RATE_HZ, 1.0)
    return [recorded(device, sweep[:, None] * np.eye(3)[axis], seed=axis) for axis in range(3)]


def driven_together(plants, device, newtons=1.0) -> list[Recording]:
    """Multisines on all axes at once, three times with phases turned by thirds."""
    lines = np.fft.rfft(plants.multisine(4.5, 37, PERIOD / RATE_HZ, newtons, seed=5), axis=0)
    turned = [np.exp(2j * np.pi / 3 * turn * np.arange(3)) for turn in range(3)]
    return [recorded(device, np.fft.irfft(lines * turn, PERIOD, axis=0), seed) for seed, turn in enumerate(turned)]


def identified(recordings) -> IdentifiedModel:
    settings = IdentificationSettings(draws=0, longer_horizons=(0,), record_horizons=())
    return identify(estimate_transfer(recordings), settings).model


@pytest.mark.parametrize(("level", "without", "with_it"), [(0.1, 0.15, 0.025), (0.3, 0.4, 0.04)])
def test_friction_is_cancelled_where_the_model_has_none(rubbing, plants, frictionless, wanted, level, without, with_it):
    device, forces = rubbing.rubbing(plants.modes_of(), level), inverse(frictionless, wanted)
    freed = compensate(forces, wanted, frictionless, physics(friction(level)), None).forces
    assert error(device, forces, wanted) > without
    assert error(device, freed, wanted) < with_it


@pytest.mark.slow
def test_from_recordings_freed_of_friction_a_linear_model_is_identified(rubbing, plants, wanted):
    device, known = rubbing.rubbing(plants.modes_of(), 0.1), physics(friction(0.1))
    recordings = driven_together(plants, device)
    as_recorded = identified(recordings)
    freed = identified([subtract_effects(recording, known, (4.5, 37)) for recording in recordings])
    forces = compensate(inverse(freed, wanted), wanted, freed, known, None).forces
    assert error(device, inverse(as_recorded, wanted), wanted) > 0.07
    assert error(device, forces, wanted) < 0.03


@pytest.mark.slow
@pytest.mark.parametrize("level", [0.1, pytest.param(0.3, marks=pytest.mark.slow)])
def test_friction_already_in_the_model_is_not_counted_twice(rubbing, plants, wanted, level):
    device, known = rubbing.rubbing(plants.modes_of(), level), physics(friction(level))
    model = identified(swept(plants, device))
    forces = inverse(model, wanted)
    plain = error(device, forces, wanted)
    twice = error(device, compensate(forces, wanted, model, known, None).forces, wanted)
    once = error(device, compensate(forces, wanted, model, known, 1.0).forces, wanted)
    assert once < 0.9 * plain
    assert twice > plain


def effect(kind, axis=None, **parameters) -> ModelEffect:
    return ModelEffect(kind, axis, parameters)


def test_every_effect_of_the_vocabulary_is_used_or_says_why_not(frictionless, wanted):
    effects = tuple(
        ModelEffect(name.name, None, {part.name: 0.01 for part in name.parameters}) for name in EFFECT_ENTRIES
    )
    done = compensate(inverse(frictionless, wanted), wanted, frictionless, physics(*effects), None)
    assert {each.kind for each in done.used} == {*LAWS, "force_deadband"}
    assert len(done.used) + len(done.not_used) == len(EFFECT_ENTRIES)
    assert all(reason for _, reason in done.not_used)


def test_what_is_linear_is_in_the_model_and_what_is_the_sensors_is_let_be(frictionless, wanted):
    forces = inverse(frictionless, wanted)
    known = physics(effect("viscous_damping", damping=5.0), effect("sensor_gain", gain=1.2))
    done = compensate(forces, wanted, frictionless, known, None)
    np.testing.assert_array_equal(done.forces, forces)
    assert [reason for _, reason in done.not_used] == [IN_MODEL_REASON, SENSOR_ERROR]


def test_an_effect_on_one_axis_changes_that_force_alone(frictionless, wanted):
    forces = inverse(frictionless, wanted)
    for axis in ("y", "fy", "ay"):
        added = compensate(forces, wanted, frictionless, physics(friction(0.1, axis)), None).forces - forces
        assert np.abs(added[:, [0, 2]]).max() == 0
        assert np.abs(added[:, 1]).max() == pytest.approx(0.1, rel=0.05)


def test_an_axis_that_is_not_there_is_refused(frictionless, wanted):
    with pytest.raises(ValueError, match="coulomb_friction is on the axis 'q', but there are fx, fy, fz"):
        compensate(wanted, wanted, frictionless, physics(friction(0.1, "q")), None)


def test_forces_that_do_not_go_axis_by_axis_are_refused(frictionless, wanted):
    with pytest.raises(ValueError, match="do not match the reference accelerations"):
        compensate(wanted[:, :2], wanted, frictionless, physics(), None)
    with pytest.raises(ValueError, match="it must be a force above zero"):
        compensate(wanted, wanted, frictionless, physics(), 0.0)


def test_a_stronger_actuator_needs_less_added(frictionless, wanted):
    forces = inverse(frictionless, wanted)
    plain = compensate(forces, wanted, frictionless, physics(friction(0.1)), None).forces - forces
    scaled = physics(friction(0.1), effect("force_gain", gain=1.25))
    np.testing.assert_allclose(
        compensate(forces, wanted, frictionless, scaled, None).forces - forces, plain / 1.25, atol=1e-12
    )


def test_the_forces_stay_within_the_cap(frictionless, wanted):
    forces = inverse(frictionless, wanted)
    cap_n = 1.01 * float(np.linalg.norm(forces, axis=1).max())
    done = compensate(forces, wanted, frictionless, physics(friction(0.3)), None, cap_n)
    assert 0 < done.share < 1
    assert np.linalg.norm(done.forces, axis=1).max() <= cap_n


@pytest.mark.parametrize("jump", [0.0, 0.5])
def test_a_dead_band_is_crossed(plants, frictionless, wanted, jump):
    plant, width = plants.omega_like(), 0.15
    known = physics(effect("force_deadband", width=width, jump=jump))
    forces = inverse(frictionless, wanted)
    done = compensate(forces, wanted, frictionless, known, None)

    def off(commands):
        behind = np.where(np.abs(commands) > width, commands - (1 - jump) * width * np.sign(commands), 0.0)
        return rms(filter_to_band(plant.play(behind) - wanted, RATE_HZ, BAND_HZ)) / rms(wanted)

    assert off(done.forces) < 0.2 * off(forces)


def test_a_planned_motion_is_the_motion_whose_acceleration_is_wanted(wanted):
    motion = integrate_motion(wanted, RATE_HZ, BAND_HZ)
    inside = slice(AROUND, -AROUND)
    np.testing.assert_allclose(
        np.gradient(motion.position, 1 / RATE_HZ, axis=0)[inside],
        motion.velocity[inside],
        atol=0.02 * np.abs(motion.velocity).max(),
    )
    assert rms(motion.acceleration - wanted) < 0.03 * rms(wanted)
    assert np.abs(motion.position.mean(axis=0)).max() < 0.02 * np.abs(motion.position).max()


def test_a_lead_takes_the_motion_ahead_of_time(wanted):
    now, ahead = (integrate_motion(wanted, RATE_HZ, BAND_HZ, lead).velocity for lead in (0.0, 0.005))
    np.testing.assert_allclose(ahead[:-5], now[5:], atol=1e-9)


def test_a_motion_about_a_resting_place_needs_a_band_above_zero(wanted):
    with pytest.raises(ValueError, match="needs more than 0 Hz"):
        integrate_motion(wanted, RATE_HZ, (0.0, 35.0))


def test_equivalents_are_those_of_the_literature():
    lines, speed = np.array([5.0, 20.0]), np.array([0.02, 0.05])
    coulomb = compute_equivalent_impedance(LAWS["coulomb_friction"], {"level": 0.1}, lines, speed, 1e-4)
    np.testing.assert_allclose(coulomb, 4 * 0.1 / (np.pi * speed), rtol=1e-3)
    cubic = compute_equivalent_impedance(LAWS["hardening_stiffness"], {"k3": 1e5}, lines, speed, 1e-4)
    reach = speed / (2 * np.pi * lines)
    np.testing.assert_allclose(cubic, 0.75e5 * reach**2 / (2j * np.pi * lines), rtol=1e-9)
    drag = compute_equivalent_impedance(LAWS["quadratic_damping"], {"coefficient": 3.0}, lines, speed, 1e-4)
    np.testing.assert_allclose(drag, 8 / (3 * np.pi) * 3.0 * speed, rtol=1e-4)


def test_a_bristle_slips_at_its_level_and_springs_before():
    of, x = {"level": 0.2, "stiffness": 2e4}, np.linspace(0, 1e-3, 5000)
    force = LAWS["presliding_hysteresis"](of, x, np.gradient(x), 1.0)
    assert force[-1] == pytest.approx(0.2, rel=1e-3)
    assert force[5] == pytest.approx(2e4 * x[5], rel=0.15)


def test_other_frictions_have_their_shape():
    v = np.array([-0.1, -0.001, 0.001, 0.1])
    apart = LAWS["asymmetric_friction"]({"level_positive": 0.3, "level_negative": 0.1}, 0 * v, v, 1e-5)
    np.testing.assert_allclose(apart, [-0.1, -0.1, 0.3, 0.3])
    humped = LAWS["stribeck_friction"]({"coulomb": 0.1, "static": 0.2, "speed": 0.005}, 0 * v, v, 1e-5)
    assert humped[2] == pytest.approx(0.1 + 0.1 * np.exp(-0.04))
    assert humped[3] == pytest.approx(0.1)
    x = np.array([0.0, 0.01, -0.01, 0.03])
    along = {"level": 0.1, "slope_per_m": 20.0, "bend_per_m2": -1e3}
    uneven = LAWS["position_dependent_friction"](along, x, np.full(4, 0.1), 1e-5)
    np.testing.assert_allclose(uneven, [0.1, 0.11, 0.07, 0.07])


def test_a_dead_band_wider_than_the_amplitude_lets_nothing_through():
    assert compute_deadband_describing_function({"width": 0.5}, 0.4) == 0
    assert compute_deadband_describing_function({"width": 0.0}, 0.4) == 1


@pytest.mark.parametrize("jump", [0.0, 0.4, 1.0])
def test_a_dead_bands_describing_function_is_its_fundamental(jump):
    angle = np.linspace(0, 2 * np.pi, 10_000, endpoint=False)
    wave = np.sin(angle)
    through = np.where(np.abs(wave) > 0.3, wave - (1 - jump) * 0.3 * np.sign(wave), 0.0)
    assert compute_deadband_describing_function({"width": 0.3, "jump": jump}, 1.0) == pytest.approx(
        2 * np.mean(through * wave), rel=1e-3
    )


def test_only_whole_recordings_of_accelerations_can_be_freed(rubbing, plants):
    recording = recorded(rubbing.rubbing(plants.modes_of(), 0.0), np.zeros((PERIOD, 3)), 1)
    positions = Signal(recording.response.samples, RATE_HZ, "position", "m", ("x", "y", "z"))
    with pytest.raises(ValueError, match="integrated from accelerations"):
        subtract_effects(replace(recording, response=positions), physics(), (4.5, 37))
    holed = recording.response.samples.copy()
    holed[5] = np.nan
    missing = replace(recording, response=replace(recording.response, samples=holed))
    with pytest.raises(ValueError, match="missing samples"):
        subtract_effects(missing, physics(), (4.5, 37))


def test_a_recording_without_effects_stays_as_it_is(rubbing, plants):
    recording = recorded(rubbing.rubbing(plants.modes_of(), 0.0), plants.multisine(4.5, 37), 1)
    freed = subtract_effects(recording, physics(effect("viscous_damping", damping=3.0)), (4.5, 37))
    np.testing.assert_array_equal(freed.command.samples, recording.command.samples)
