"""Laws that depend on a recorded condition, found and played without a model: a rubbing mass whose friction falls with
its temperature, an imposed motion whose friction is set, and one whose condition does nothing."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.balance.laws.condition_laws import _make_formula
from analysis.diagnosis.balance.motion import Condition
from analysis.diagnosis.data.recorded_conditions import apply_conditions
from analysis.diagnosis.diagnose_values import diagnose_values
from analysis.diagnosis.prepare_recordings import prepare_recordings
from analysis.diagnosis.result.wording import format_effect_title
from equalizer.effects.discovered_law import Channels, name_conditions
from equalizer.effects.placing import PlacingError, place_effects, place_recorded_effects
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law, parse_law
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ, SAMPLES, FINER = 500.0, 10_000, 8
TIME_S = np.arange(SAMPLES) / RATE_HZ
MASS, DAMPING, STIFFNESS = 1.2, 3.0, 60.0


def temperature_course(seed: int) -> np.ndarray:
    """degC"""
    return 20 + 30 * (1 - np.exp(-TIME_S / 8)) + 0.1 * np.random.default_rng(seed).standard_normal(SAMPLES)


def record_rubbing_mass(friction_n: np.ndarray, condition: np.ndarray, seed: int) -> Recording:
    """Stepped in an eighth of a sample; the sign of the speed is smoothed within 1 mm/s."""
    random = np.random.default_rng(seed)
    tones = zip((4, 3, 3, 2), (0.7, 1.9, 4.3, 7.7), random.uniform(0, 6, 4), strict=True)
    force = sum(level * np.sin(2 * np.pi * hz * TIME_S + phase) for level, hz, phase in tones)
    x = v = 0.0
    position, step_s = np.zeros(SAMPLES), 1 / (RATE_HZ * FINER)
    for k in range(SAMPLES):
        position[k] = x
        for _ in range(FINER):
            v += step_s * (force[k] - DAMPING * v - STIFFNESS * x - friction_n[k] * np.tanh(v / 1e-3)) / MASS
            x += step_s * v
    seen = position + 2e-6 * random.standard_normal(SAMPLES)
    return Recording(
        "rig", Signal(force[:, None], RATE_HZ, "force", "N", ("fx",)),
        Signal(seen[:, None], RATE_HZ, "position", "m", ("x",)),
        condition=Signal(condition[:, None], RATE_HZ, "temperature", "K", ("T",)),
    )  # fmt: skip


def record_imposed_motion(seed: int) -> Recording:
    random = np.random.default_rng(seed)
    x = sum(0.008 * np.sin(2 * np.pi * hz * TIME_S + random.uniform(0, 6)) for hz in (0.5, 1.1, 2.3))
    v = np.gradient(x, 1 / RATE_HZ)
    current = np.repeat(random.uniform(0, 2, 20), SAMPLES // 20)
    force = 400 * v + (20 + 60 * current) * np.tanh(v / 4e-3) + random.standard_normal(SAMPLES)
    return Recording(
        "rig", Signal((x + 1e-6 * random.standard_normal(SAMPLES))[:, None], RATE_HZ, "position", "m", ("x",)),
        Signal(force[:, None], RATE_HZ, "force", "N", ("F",)),
        condition=Signal(current[:, None], RATE_HZ, "current", "A", ("setting",)),
    )  # fmt: skip


@pytest.mark.slow
def test_friction_that_falls_with_the_temperature_is_named_and_played():
    celsius = temperature_course(1)
    found = diagnose_values(record_rubbing_mass(2.5 - 0.04 * (celsius - 20), celsius + 273.15, 5)).diagnosis
    (effect,) = found.effects
    assert effect.class_[:2] == ("discovered_law", "condition_dependent_friction")
    assert "dry friction that depends on the recorded condition" in format_effect_title(effect)
    assert effect.law is not None and set(effect.law.variables) == {"T", "vx"}
    level, change = (effect.parameters[name].value for name in ("p0", "p1"))
    assert level == pytest.approx(2.5 - 0.04 * (celsius.mean() - 20), rel=0.03)
    assert change == pytest.approx(-0.04 * celsius.std(), rel=0.05)
    assert found.fit.test.after < 0.1 * found.fit.test.before


@pytest.mark.slow
def test_friction_that_a_setting_changes_is_named_where_the_motion_is_imposed():
    found = diagnose_values(record_imposed_motion(5)).diagnosis
    assert found.effects[0].class_[:2] == ("discovered_law", "condition_dependent_friction")
    assert found.fit.test.after < 0.15 * found.fit.test.before


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_condition_that_does_nothing_is_not_named(seed):
    found = diagnose_values(record_rubbing_mass(np.full(SAMPLES, 2.0), temperature_course(seed), seed)).diagnosis
    names = {name for effect in found.effects for name in (effect.effect, *effect.class_)}
    assert names and not any(name.startswith("condition") for name in names)


def test_a_model_with_such_a_law_is_played_with_the_recording_s_condition_and_not_without():
    law = parse_law("-2.0*(T - 300)*vx", "force", "x")
    plain = MechanicalModel("m", "position", np.eye(1), np.eye(1), 9 * np.eye(1), input=np.eye(1), output=np.eye(1))
    model = MechanicalModel(
        "m", "position", np.eye(1), np.eye(1), 9 * np.eye(1), input=np.eye(1), output=np.eye(1),
        effects=(ModelEffect("discovered_law", "x", {}, law),),
    )  # fmt: skip
    recording = record_rubbing_mass(np.zeros(SAMPLES), np.where(TIME_S < 4, 300.0, 301.0), 1)
    placed = place_recorded_effects(model, recording)
    command = recording.command.samples
    bound = simulate_mechanism(model, command, RATE_HZ, apply_conditions(placed, recording))
    without = simulate_mechanism(plain, command, RATE_HZ)
    same = int(4 * RATE_HZ)
    np.testing.assert_allclose(bound.response[:same], without.response[:same], atol=1e-9)
    # From there on it is a damper of 2 N s/m more.
    damped = MechanicalModel(
        "m", "position", np.eye(1), 3 * np.eye(1), 9 * np.eye(1), input=np.eye(1), output=np.eye(1)
    )
    late = simulate_mechanism(damped, command, RATE_HZ)
    settled = slice(same + int(6 * RATE_HZ), None)
    changed = np.std(late.response[settled] - without.response[settled])
    assert np.std(bound.response[settled] - late.response[settled]) < 0.02 * changed
    with pytest.raises(ValueError, match="needs conditions that were not recorded"):
        simulate_mechanism(model, command, RATE_HZ, placed)
    with pytest.raises(PlacingError, match="'T'"):
        place_effects(model, Channels(("fx",), ("x",)))


def test_a_condition_is_called_by_its_channel_where_no_signal_is_called_so():
    names = name_conditions(Channels(conditions=("T", "t", "vx", "oil pressure", "sin", "p1", "supply_bar")))
    assert names == ("T", "c2", "c3", "c4", "c5", "c6", "supply_bar")
    assert name_conditions(Channels(("force",), ("x",), conditions=("force", "T", "T"))) == ("c1", "c2", "c3")


@pytest.mark.parametrize(("mean", "spread"), [(312.68, 7.64003), (1_013_250.4, 0.3), (-2.5e-4, 1e-5), (3.0, 4e4)])
def test_a_formula_with_a_condition_keeps_its_free_numbers_when_it_is_read_back(mean, spread):
    formula = _make_formula(Condition("T", mean, spread), "v")({"change": 2.5})
    law = Law(formula.text, formula.numbers, (), "force", "x")
    again = parse_law(law.exact_text, "force", "x")
    assert again.numbers == (2.5,)
    at = {"T": np.array([mean + 2 * spread]), "v": np.ones(1)}
    assert evaluate(again, at, 1.0) == pytest.approx(-5.0, rel=2e-3)


def test_conditions_that_not_all_recordings_hold_are_left_out_and_that_is_said():
    first, second = (record_rubbing_mass(np.zeros(SAMPLES), temperature_course(seed), seed) for seed in (1, 2))
    ready = prepare_recordings((first, replace(second, condition=None)), ("a", "b"), True)
    assert all(each.condition is None for each in ready.recordings)
    assert "Not all recordings hold the same conditions" in " ".join(ready.remarks)
