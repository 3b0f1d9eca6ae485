"""Decays without a command: what they show per unit of mass, also across parts, and what they do not show."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.balance.balances import find_balances
from analysis.diagnosis.data.input_checks import NothingToDiagnoseError
from analysis.diagnosis.diagnose_values import diagnose_values
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.first_model.choose_structure import choose_structure
from analysis.diagnosis.first_model.free_motion import convert_free_motion, is_undriven_motion
from analysis.diagnosis.first_model.model_structures import StructureFitError
from analysis.diagnosis.first_model.one_motion_per_force import convert_to_driven_motions
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.search.time_budget import grant_time
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ, FINER, NOISE_RAD = 200.0, 16, 2e-4
TURN_RAD_PER_S2 = 38.0
"""Of a pendulum's weight over its inertia."""
SPRING, DAMPING = 40.0, 0.15


def simulate_decay(acceleration, start: float, seconds: float, seed: int) -> np.ndarray:
    """(n,): position from rest at `start`, by semi-implicit Euler steps of a sixteenth of a sample, with noise."""
    count, step_s = int(seconds * RATE_HZ), 1 / (RATE_HZ * FINER)
    q, v, found = start, 0.0, np.zeros(count)
    for k in range(count):
        found[k] = q
        for _ in range(FINER):
            v += step_s * acceleration(q, v)
            q += step_s * v
    return found + NOISE_RAD * np.random.default_rng(seed).standard_normal(count)


def make_recording(*decays: np.ndarray) -> Recording:
    """The decays one after the other, as parts of one recording."""
    ends = np.cumsum([len(each) for each in decays])
    parts = [
        {"start": int(end - len(each)), "stop": int(end), "name": str(number)}
        for number, (each, end) in enumerate(zip(decays, ends, strict=True))
    ]
    angle = np.concatenate(decays)[:, None]
    return Recording(
        "rig", Signal(np.zeros_like(angle), RATE_HZ, "torque", "N m", ("none",)),
        Signal(angle, RATE_HZ, "angle", "rad", ("angle",)), meta={"parts": parts},
    )  # fmt: skip


def effect_names(found) -> set[str]:
    return {name for effect in found.diagnosis.effects for name in (effect.effect, *effect.class_)}


def pendulum_acceleration(q: float, v: float) -> float:
    return -TURN_RAD_PER_S2 * np.sin(q) - DAMPING * v


def friction_acceleration(q: float, v: float) -> float:
    return -SPRING * q - DAMPING * v - 0.8 * np.tanh(v / 0.01)


def linear_acceleration(q: float, v: float) -> float:
    return -SPRING * q - DAMPING * v


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_the_weight_of_a_pendulum_is_named_from_its_decays(seed):
    found = diagnose_values(
        make_recording(
            simulate_decay(pendulum_acceleration, 1.6, 12, seed),
            simulate_decay(pendulum_acceleration, 0.9, 12, seed + 10),
        )
    )
    assert "gravity_torque" in effect_names(found)
    assert found.diagnosis.fit.test.after < 0.3 * found.diagnosis.fit.test.retuned
    # Its two parameters make one: spring and weight together hold the small motion.
    (weight,) = (each for each in found.diagnosis.effects if each.effect == "gravity_torque")
    held = found.improved.stiffness[0, 0] + weight.parameters["torque"].value
    assert held == pytest.approx(TURN_RAD_PER_S2, rel=0.05)
    assert found.improved.mass == pytest.approx(np.eye(1))


def balance_of_coloured_decay(acceleration, seed: int):
    """The force balance of one long decay under noise that falls with the frequency, unlike that of a converter."""
    from scipy.signal import lfilter

    angle = simulate_decay(acceleration, 1.2, 50, seed)
    white = np.random.default_rng(seed + 50).standard_normal(len(angle))
    (recording,), _ = convert_free_motion([make_recording(angle + 8e-4 * lfilter([0.5], [1, -0.87], white))])
    return find_balances([recording], frozenset(), grant_time)[0]


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_weight_is_named_under_noise_that_hides_it_above_the_third_harmonic(seed):
    balance = balance_of_coloured_decay(lambda q, v: -TURN_RAD_PER_S2 * np.sin(q) - 0.05 * v, seed)
    (weight,) = balance.named
    assert weight.law.effect == "gravity_torque"
    assert weight.values["torque"] == pytest.approx(TURN_RAD_PER_S2, rel=0.02)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_spring_under_such_noise_has_no_name(seed):
    assert not balance_of_coloured_decay(lambda q, v: -SPRING * q - 0.05 * v, seed).named


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_dry_friction_is_named_from_a_decay(seed):
    found = diagnose_values(make_recording(simulate_decay(friction_acceleration, 1.0, 8, seed)))
    (friction,) = found.diagnosis.effects
    assert "coulomb_friction" in effect_names(found)
    assert friction.parameters["level"].value == pytest.approx(0.8, rel=0.25)
    assert any("The motion is free" in remark for remark in found.remarks)
    assert not any("was imposed" in remark or "lower bound" in remark for remark in found.remarks)
    assert found.improved.mass == pytest.approx(np.eye(1))


def test_a_crash_of_the_comparison_of_parts_is_told(monkeypatch):
    def crash(*arguments):
        raise ValueError("operands could not be broadcast together")

    monkeypatch.setattr("analysis.diagnosis.result.plausibility.describe_changed_strengths", crash)
    settings = DiagnosisSettings(guard=Guard(enabled=True))
    found = diagnose_values(make_recording(simulate_decay(friction_acceleration, 1.0, 8, 1)), settings=settings)
    assert "coulomb_friction" in effect_names(found)
    assert any(remark.startswith("The comparison of parts was left out") for remark in found.remarks)


@pytest.mark.parametrize(
    ("quantity", "unit", "force_unit"),
    [("position", "m", "N"), ("angle", "rad", "N m"), ("velocity", "m/s", "N"), ("voltage", "V", "V/s^2"),
     ("position", "1", "1/s^2")],
)  # fmt: skip
def test_forces_per_unit_mass_are_in_the_unit_of_the_motion(quantity, unit, force_unit):
    decay = make_recording(simulate_decay(linear_acceleration, 1.0, 8, 3))
    read = replace(decay, response=replace(decay.response, quantity=quantity, unit=unit))
    (converted,), sentence = convert_free_motion([read])
    assert converted.command.units == (force_unit,)
    assert f"per unit mass, in {force_unit}." in sentence or force_unit in ("N", "N m")
    chosen = choose_structure([converted], None, lambda share: None)
    assert all(("N" in parameter.unit) == ("N" in force_unit) for parameter in chosen.fit.parameters)


@pytest.mark.slow
def test_a_decay_in_an_unknown_unit_is_read_as_a_position_and_named():
    """As of a photodiode that a swinging mirror shines on: its parameters are in no unit."""
    counted = make_recording(simulate_decay(friction_acceleration, 1.0, 8, 3))
    response = replace(counted.response, quantity="1", unit="1", channels=("diode",))
    unknown = replace(counted, response=response)
    assert "coulomb_friction" in effect_names(diagnose_values(unknown))
    assert "diode measures; it was taken for a position that moves freely" in convert_to_driven_motions([unknown])[1][0]


@pytest.mark.parametrize(("quantity", "unit"), [("temperature", "K"), ("current", "A")])
def test_what_is_no_motion_is_not_read_as_a_position(quantity, unit):
    cooled = make_recording(simulate_decay(friction_acceleration, 1.0, 8, 3))
    with pytest.raises(NothingToDiagnoseError, match="the command never changes"):
        diagnose_values(replace(cooled, response=replace(cooled.response, quantity=quantity, unit=unit)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_linear_decay_names_nothing(seed):
    found = diagnose_values(
        make_recording(
            simulate_decay(linear_acceleration, 1.0, 12, seed), simulate_decay(linear_acceleration, 0.4, 12, seed + 10)
        )
    )
    assert effect_names(found) == set()
    assert found.diagnosis.fit.test.retuned < 0.1


def test_a_standing_command_with_accelerations_alone_is_refused_with_a_way_on():
    swing = make_recording(simulate_decay(linear_acceleration, 1.0, 8, 1))
    response = Signal(swing.response.samples, RATE_HZ, "angular acceleration", "rad/s^2", ("alpha",))
    with pytest.raises(NothingToDiagnoseError, match="a free motion, measured as positions or speeds"):
        diagnose_values(replace(swing, response=response))


def test_commands_that_differ_between_recordings_drive():
    swing = make_recording(simulate_decay(linear_acceleration, 1.0, 8, 1))
    pushed = replace(swing, command=replace(swing.command, samples=swing.command.samples + 2.0))
    assert is_undriven_motion((swing, swing)) and not is_undriven_motion((swing, pushed))


def test_a_command_that_is_missing_where_the_motion_is_drives_nothing():
    """As importing 0 x angle makes it, where samples of the angle are missing."""
    swing = make_recording(simulate_decay(linear_acceleration, 1.0, 8, 1))
    gaps = swing.command.samples.copy()
    gaps[100:103] = np.nan
    read, said = convert_free_motion((replace(swing, command=replace(swing.command, samples=gaps)),))
    assert said and np.isfinite(read[0].command.samples).all()


def test_a_first_model_of_a_decay_has_damping_and_spring_per_unit_of_mass():
    read, _ = convert_free_motion((make_recording(simulate_decay(linear_acceleration, 1.0, 12, 1)),))
    choice = choose_structure(read, None, lambda share: None)
    assert choice.fit.kind == "mass-spring"
    assert choice.tried[0].kind == "motor"  # it has fewer parameters
    assert "the choice is mass-spring" in choice.reason
    numbers = {number.name: number.value for number in choice.fit.parameters}
    assert numbers == {"damping angle": pytest.approx(DAMPING, rel=0.1), "stiffness angle": pytest.approx(SPRING, 0.01)}
    with pytest.raises(StructureFitError, match="has a mass"):
        choose_structure(read, "massless", lambda share: None)


def test_a_rotor_that_runs_down_is_a_motor():
    noise = NOISE_RAD * np.random.default_rng(1).standard_normal(int(8 * RATE_HZ))
    read, _ = convert_free_motion((make_recording(rotor_angle() + noise),))
    assert choose_structure(read, None, lambda share: None).fit.kind == "motor"


def rotor_angle() -> np.ndarray:
    """(n,): turned so far, rad, by a rotor that loses half of its speed per second."""
    time_s = np.arange(int(8 * RATE_HZ)) / RATE_HZ
    return 60.0 * (1 - np.exp(-0.5 * time_s))
