"""A hub that turns a beam, whose deflection is measured with noise: laws of the hub show in the band of the hub."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.balance.balances import restrict_to_motion_band
from analysis.diagnosis.balance.motion import compute_motion_band_hz, compute_motions
from analysis.diagnosis.confirm.fitting_measures import choose_fitting_measure
from analysis.diagnosis.confirm.force_balance_measures import BALANCE_PREDICTS_BETTER, choose_forces_of_balance
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.search_by_simulation import _is_unobservable
from equalizer.plant.mechanical_model import MechanicalModel

RATE_HZ, SECONDS, FINE = 500.0, 5.0, 20
HUB, DRAG, BEAM, BEAM_HZ, BEAM_DAMPING = 8e-3, 0.5, 6e-3, 3.0, 0.02
GAIN, FRICTION, BRISTLE = 9.5, 0.2, 5e-4
STEP, GAUGE_NOISE = np.deg2rad(0.088), np.deg2rad(0.6)


def simulate_hub(friction, seed):
    """Voltage (n,), hub angle and deflection (n, 2), in rad: a square reference under feedback with noise in it."""
    rng = np.random.default_rng(seed)
    count, dt = int(RATE_HZ * SECONDS), 1 / (FINE * RATE_HZ)
    reference = np.repeat(np.where(np.arange(8) % 2 == 0, 0.5, -0.5), count // 8 + 1)[:count]
    reference += 0.02 * np.convolve(rng.standard_normal(count), np.ones(25) / 5, "same")
    omega = 2 * np.pi * BEAM_HZ
    hub = speed = bend = bending = bristle = 0.0
    command, motion = np.zeros(count), np.zeros((count, 2))
    for k in range(count):
        command[k] = GAIN * (reference[k] - hub) - 0.2 * speed
        motion[k] = hub, bend
        for _ in range(FINE):
            bristle = np.clip(bristle + dt * speed, -BRISTLE, BRISTLE)
            spring = BEAM * (omega**2 * bend + 2 * BEAM_DAMPING * omega * bending)
            turn = (command[k] - DRAG * speed - friction * bristle / BRISTLE + spring) / HUB
            bending += dt * (-turn - spring / BEAM)
            speed += dt * turn
            hub += dt * speed
            bend += dt * bending
    encoder = STEP * np.round(motion[:, :1] / STEP)
    return command, np.hstack([encoder, motion[:, 1:] + GAUGE_NOISE * rng.standard_normal((count, 1))])


@pytest.fixture
def record_hub(record_samples):
    def made(friction, seed=3):
        command, motion = simulate_hub(friction, seed)
        return record_samples(command[:, None], motion, RATE_HZ)

    return made


def test_the_band_of_the_motion_is_that_of_the_driven_one(record_hub):
    records = observe_parts([record_hub(FRICTION)], 2)
    motions = compute_motions(records)
    hub_hz, both_hz = compute_motion_band_hz(motions, [0]), compute_motion_band_hz(motions, [0, 1])
    (narrow,) = restrict_to_motion_band(records, motions)
    assert narrow.band_hz == pytest.approx(hub_hz)
    assert hub_hz < 0.8 * both_hz


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4])
def test_friction_of_the_hub_is_named_beside_the_beam(record_hub, find_balance, seed):
    (balance,) = find_balance(record_hub(FRICTION, seed))
    assert [law.law.effect for law in balance.named] in (["coulomb_friction"], ["presliding_hysteresis"])
    assert balance.named[0].values["level"] == pytest.approx(FRICTION, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4])
def test_without_friction_nothing_is_named(record_hub, find_balance, seed):
    assert not find_balance(record_hub(0.0, seed))[0].named


def hub_and_beam(hub):
    """Two bodies, of which the second is the beam's deflection; the hub's inertia is `hub`."""
    drag, spring = np.diag([DRAG, 1e-3]), np.diag([0.0, BEAM * (2 * np.pi * BEAM_HZ) ** 2])
    return MechanicalModel(
        "fitted", "position", np.diag([hub, BEAM]), drag, spring, np.array([[1.0], [0.0]]), np.eye(2)
    )


@pytest.mark.slow
def test_where_no_law_is_named_the_linear_numbers_that_leave_less_of_the_forces_are_taken(record_hub, find_balance):
    recording = record_hub(0.0)
    balances = find_balance(recording)
    given = choose_fitting_measure([recording], hub_and_beam(5 * HUB), (), "force", about_mean=True)
    plain = choose_forces_of_balance([recording], given, balances)
    assert plain.model.mass.shape == (1, 1)
    assert BALANCE_PREDICTS_BETTER in plain.chosen.remarks
    left = [rms_of_forces(each) for each in (given, plain)]
    assert left[1] < 0.3 * left[0]


@pytest.mark.slow
def test_a_given_model_that_leaves_less_stays(record_samples, find_balance):
    """One body under a broad force: the true model's error is the noise, and the balance's numbers are fitted."""
    rng = np.random.default_rng(5)
    recording, mass = record_driven_body(record_samples, rng)
    true = MechanicalModel("true", "position", *(np.array([[value]]) for value in mass), np.eye(1), np.eye(1))
    given = choose_fitting_measure([recording], true, (), "force")
    wrong = choose_fitting_measure([recording], replace(true, mass=3 * true.mass), (), "force")
    balances = find_balance(recording)
    left = [rms_of_forces(choose_forces_of_balance([recording], each, balances)) for each in (given, wrong)]
    assert left[0] <= rms_of_forces(given)
    assert left[1] < 0.5 * rms_of_forces(wrong)


@pytest.mark.slow
@pytest.mark.parametrize("offset", [0.0, 2.0])
def test_a_constant_force_does_not_decide_which_is_taken(record_hub, find_balance, offset):
    recording = record_hub(0.0)
    command = replace(recording.command, samples=recording.command.samples + offset)
    moved = replace(recording, command=command)
    given = choose_fitting_measure([moved], hub_and_beam(5 * HUB), (), "force", about_mean=True)
    plain = choose_forces_of_balance([moved], given, find_balance(moved))
    assert BALANCE_PREDICTS_BETTER in plain.chosen.remarks
    assert plain.is_reduced
    assert rms_of_forces(plain) < 0.3 * rms_of_forces(given)


@pytest.mark.parametrize(
    ("name", "place", "driven", "tried"),
    [
        ("amplifier_lag", "actuator", True, True),
        ("amplifier_lag", "actuator", False, False),
        ("force_deadband", "actuator", True, False),
        ("sensor_offset", "sensor", False, True),
    ],
)
def test_effects_of_the_actuator_are_tried_on_the_commands_as_they_are_alone(name, place, driven, tried):
    assert _is_unobservable(name, place, driven) is tried


@pytest.mark.slow
def test_with_a_named_law_or_without_balances_the_model_stays(record_hub, find_balance):
    recording = record_hub(FRICTION)
    given = choose_fitting_measure([recording], hub_and_beam(5 * HUB), (), "force", about_mean=True)
    assert choose_forces_of_balance([recording], given, find_balance(recording)) is given
    assert choose_forces_of_balance([recording], given, ()) is given


def record_driven_body(record_samples, rng):
    """Recording, and mass, damping and stiffness."""
    mass, damping, spring = 0.1, 2.0, 400.0
    force = np.convolve(rng.standard_normal(4000), np.hanning(20), "same")
    place, speed, found = 0.0, 0.0, []
    for push in force:
        found.append(place)
        for _ in range(10):
            speed += (push - damping * speed - spring * place) / mass / RATE_HZ / 10
            place += speed / RATE_HZ / 10
    noisy = np.array(found) + 1e-6 * rng.standard_normal(len(found))
    return record_samples(force[:, None], noisy[:, None], RATE_HZ), (mass, damping, spring)


def rms_of_forces(fitting):
    measure = fitting.chosen.measure
    left = measure.residuals(fitting.model, ())
    used = [each[record.fit] for each, record in zip(left, measure.records, strict=True)]
    return measure.unit[0] * np.sqrt(np.mean(np.vstack(used) ** 2))
