"""The labelled cases' actuators, sensors and clocks, which others simulated: with the effect that each case names,
its own starting value and the model's numbers inside their tolerance, what is left is the noise."""

import json

import numpy as np
import pytest

from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import build_jacobian, evaluate_fit, fit, gather_evidence
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.search.starting_hypotheses import list_candidates
from equalizer.effects.catalogue import EFFECTS
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import read_recording

NOISE = np.array([0.042, 0.042, 0.083, *[np.hypot(4e-6, 10e-6 / np.sqrt(12))] * 3])
"""As the cases' notes say: the accelerometer's, and the position's with its rounding."""
WITHIN = 0.02
"""Of the main parameter: the case's own integration is not ours."""


@pytest.mark.parametrize(
    "case",
    [
        pytest.param("open-05", marks=pytest.mark.slow),
        "open-06",
        "open-07",
        pytest.param("open-08", marks=pytest.mark.slow),
    ],
)
def test_with_the_effect_that_it_names_a_case_is_explained_to_the_noise(shared, case):
    recording = read_recording(shared / "cases" / f"{case}.h5")
    model = read_mechanical_model(shared / "cases" / f"{case}.toml")
    (truth,) = json.loads((shared / "cases" / f"{case}.truth.json").read_text())
    effect = EFFECTS[truth["effect"]]
    record = observe_parts([recording], model.outputs)[0]
    measure = FreeSimulation((record,), NOISE, NOISE)
    tuning = make_tuning(model, recording.command.channels)
    nominal = evaluate_fit(measure, tuning, np.zeros(len(tuning.names)), NO_EFFECTS)
    known = build_jacobian(measure, tuning, nominal.deviations, NO_EFFECTS)
    retuned = fit(measure, tuning, nominal, known, 2)
    spread = "one" if truth["axis"] else "all"
    suggested = list_candidates([effect], gather_evidence(measure, tuning, retuned)[0])
    hypothesis = next(each for each in suggested if each.claims[0].spread == spread)
    # From the calibration on: the re-tuned numbers have already bent themselves to what the effect does.
    found = evaluate_fit(measure, tuning, nominal.deviations, hypothesis)
    for _ in range(2):
        found = fit(measure, tuning, found, known, 5)
        known = build_jacobian(measure, tuning, found.deviations, found.hypothesis)
    left = np.sqrt(np.mean(found.residuals[0][record.test] ** 2, axis=0))
    assert np.all(left < 1.08)
    (placed,) = found.hypothesis.list_placed_effects()
    ((name, value),) = truth["values"].items()
    assert effect.report(placed.values)[name] == pytest.approx(value, rel=WITHIN)
    assert placed.sites == (("xyz".index(truth["axis"]),) if truth["axis"] else (0, 1, 2))
