"""The diagnosis as a call of values: what it refuses, and what it fits where no model is given."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from analysis.diagnosis import diagnose_values as module
from analysis.diagnosis.data.input_checks import NothingToDiagnoseError
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.errors.prediction_error import compute_prediction_error
from analysis.diagnosis.first_model.first_model import REPLACED_REMARK
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ = 500.0
MODEL = MechanicalModel(
    "cart", "position", np.eye(1), np.eye(1), 100 * np.eye(1), input=np.eye(1), output=np.eye(1)
)  # fmt: skip


def record_cart(seed: int, scale: float = 1.0, channel: str = "x") -> Recording:
    random = np.random.default_rng(seed)
    force = random.standard_normal((4000, 1))
    position = scale * np.cumsum(np.cumsum(force, axis=0), axis=0) / RATE_HZ**2
    return Recording(
        "cart", Signal(force, RATE_HZ, "force", "N", ("fx",)), Signal(position, RATE_HZ, "position", "m", (channel,))
    )


def test_a_recording_without_motion_has_no_verdict():
    with pytest.raises(NothingToDiagnoseError):
        module.diagnose_values(record_cart(1, scale=0.0), MODEL)


def test_recordings_that_are_not_alike_are_refused_clean_ones_too():
    with pytest.raises(NothingToDiagnoseError):
        module.diagnose_values([record_cart(1), record_cart(2, channel="y")], MODEL)
    with pytest.raises(NothingToDiagnoseError):
        module.diagnose_values(record_cart(1), MODEL, DiagnosisSettings(clean=(record_cart(2, channel="y"),)))


def test_the_same_recording_twice_is_refused():
    with pytest.raises(NothingToDiagnoseError):
        module.diagnose_values([record_cart(1), record_cart(1)], MODEL)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"names": ("a", "b")}, "names has 2 entries for 1 recordings"),
        ({"without": ("columb_friction",)}, "there is no effect columb_friction to leave out"),
        ({"compared": "forces"}, "compared is 'forces'; allowed are auto, motion, force"),
    ],
)
def test_settings_without_a_meaning_are_refused(settings, said):
    with pytest.raises(NothingToDiagnoseError, match=said):
        module.diagnose_values(record_cart(1), MODEL, DiagnosisSettings(**settings))


@pytest.mark.parametrize("law", ["coulomb_friction", "drifting_friction", "power_of_speed"])
def test_any_effect_or_law_that_a_diagnosis_tests_may_be_left_out(monkeypatch, law):
    def diagnosed(recordings, model, settings, map_, progress):
        raise RuntimeError(f"diagnosed without {settings.without}")

    monkeypatch.setattr(module, "diagnose", diagnosed)
    with pytest.raises(RuntimeError, match=f"diagnosed without .*{law}"):
        module.diagnose_values(record_cart(1), MODEL, DiagnosisSettings(without=(law,)))


def test_forces_are_not_compared_where_only_accelerations_were_measured():
    cart = record_cart(1)
    accelerated = replace(cart, response=replace(cart.response, quantity="acceleration", unit="m/s^2"))
    with pytest.raises(NothingToDiagnoseError, match="forces cannot be compared"):
        module.diagnose_values(
            accelerated, replace(MODEL, quantity="acceleration"), DiagnosisSettings(compared="force")
        )


@pytest.mark.parametrize(("mass_ratio", "remark"), [(1, "fitted"), (2, REPLACED_REMARK)])
def test_without_a_model_the_first_one_is_of_the_clean_recordings(monkeypatch, mass_ratio, remark):
    """Where the diagnosis replaces it, the remarks say so instead of how it was fitted."""
    seen, findings = {}, Mock(remarks=(), given=replace(MODEL, mass=mass_ratio * MODEL.mass))
    findings.diagnosis.error = "predicted force"

    def fitted(recordings, on_progress, whose):
        seen["fitted to"] = recordings
        return MODEL, ("fitted",)

    def diagnosed(recordings, model, settings, map_, progress):
        seen.update(settings=settings, model=model)
        return findings

    monkeypatch.setattr(module, "fit_first_linear_model", fitted)
    monkeypatch.setattr(module, "diagnose", diagnosed)
    monkeypatch.setattr(module, "replace", lambda found, **new: new if found is findings else replace(found, **new))
    clean = record_cart(2)
    found = module.diagnose_values(record_cart(1), settings=DiagnosisSettings(clean=(clean,)))
    assert np.array_equal(seen["fitted to"][0].response.samples, clean.response.samples)
    assert (seen["model"], seen["settings"].fitted) == (MODEL, True)
    assert remark in found["remarks"]
    assert ("fitted" in found["remarks"]) is (mass_ratio == 1)


@pytest.mark.slow
def test_the_improved_model_is_of_the_commands_as_they_were_recorded():
    """Dry friction and a constant pull, and a command counted against its motion."""
    model = MechanicalModel("slide", "velocity", 0.5 * np.eye(1), 2 * np.eye(1), np.zeros((1, 1)), np.eye(1), np.eye(1))
    acting = [
        PlacedEffect(EFFECTS[name], (0,), values)
        for name, values in (("coulomb_friction", {"level": 0.5}), ("constant_force", {"force": 0.3}))
    ]
    force = np.convolve(np.random.default_rng(3).standard_normal(6000), np.hanning(60), "same")[:, None]
    force *= 3 / force.std()
    speed = simulate_mechanism(model, force, RATE_HZ, acting).response
    against = Recording(
        "slide", Signal(-force, RATE_HZ, "force", "N", ("fx",)), Signal(speed, RATE_HZ, "velocity", "m/s", ("vx",))
    )

    found = module.diagnose_values(against)

    assert found.improved.input[0, 0] == found.retuned.input[0, 0] == -1
    pull, friction = found.improved.effects
    assert (pull.kind, friction.kind) == ("constant_force", "coulomb_friction")
    assert pull.parameters["force"] == pytest.approx(-0.3, rel=0.05)
    assert friction.parameters["level"] == pytest.approx(0.5, rel=0.05)
    without, with_them = (
        compute_prediction_error(against, each, "test").without_gain for each in (found.retuned, found.improved)
    )
    assert with_them < 0.2 * without < 0.1
