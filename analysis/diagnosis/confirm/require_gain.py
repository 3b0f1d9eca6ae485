"""Decides which effects of a search stay named where the model was fitted to the same recordings.

The parameters of such a model have absorbed part of a missing law, and a wrong law may imitate the remainder. Therefore
an effect must remove at least `FURTHER_LAW_OF_ALL` of the held-out error power, as the laws of a force balance must;
effects of actuator and sensor become candidates, unless the signal itself shows them.
"""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.confirm.held_out_gain import estimate_held_out_gain, predicts_motion
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.revise_selection import remove_effect
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.verdict import SearchResult, Unconfirmed, judge
from analysis.diagnosis.settings import FURTHER_LAW_OF_ALL

CONSTANT = "constant_force"
CONSTANTS = {CONSTANT: "force", "sensor_offset": "offset"}
"""Effects that are constants of a fitted model and no missing physics, with the names of their parameters."""
SHOWN_BY_SIGNAL = ("sensor_clipping", "quantization", "mains_hum", "lost_samples")
"""Effects of a sensor that its signal shows without a model."""
ONLY_BESIDE_CALIBRATION = (
    "the model was fitted to these recordings, and a law of the motion that the catalogue lacks may have the same "
    "effect; a calibrated model, or recordings of the device without the fault, would distinguish them"
)
"""Reason not to name an effect of actuator or sensor where the model was fitted to the same recordings."""
BESIDE_DIVERGENCE = (
    "without it the model's error is larger than the signal: any effect that bounds the prediction lowers it"
)
"""Reason not to name an effect that the signal shows, where the model without it predicts nothing."""


def require_enough_gain(result: SearchResult, repeats: bool) -> SearchResult:
    """The result with only those effects that remove as much of the held-out error power as a law of a balance must:
    effects are dropped from the last on until the last one removes enough. repeats: whether repeated periods show the
    noise; without them no verdict is `explained`, because no error is known to be noise alone. Constants are parameters
    of the model: where all effects are constants, `explained` is kept."""
    explanation = result.found
    while explanation.steps and not _removes_enough(result.context, explanation):
        explanation = remove_effect(result.context, explanation, len(explanation.steps) - 1)
        result = replace(result, found=explanation, judgement=judge(explanation), errors=None)
    names = {placed.effect.name for placed in explanation.after.fitted.hypothesis.list_placed_effects()}
    if repeats or result.judgement.verdict != "explained" or names <= set(CONSTANTS):
        return result
    return replace(result, judgement=replace(result.judgement, verdict="partly_explained"))


def _removes_enough(context: SearchContext, explanation: Explanation) -> bool:
    """Whether the last effect removes `FURTHER_LAW_OF_ALL` of the held-out error power that remains with the effects
    before it. True where nothing is held out: both errors are then infinite."""
    previous = context.with_test_score(explanation.steps[-2]) if len(explanation.steps) > 1 else explanation.plain
    # `held_out_error` is a logarithm of rms errors, and thus half of the logarithm of the error power.
    return not explanation.after.held_out_error > previous.held_out_error + np.log(1 - FURTHER_LAW_OF_ALL) / 2


def unname_doubtful_effects(result: SearchResult) -> SearchResult:
    """The result with named effects of actuator and sensor made candidates, unless the signal itself shows them: the
    model was fitted to these recordings, so that a law of the motion that the catalogue lacks may look like a nonlinear
    or late sensor. What the signal shows is a candidate, too, where the model without it predicts nothing. A candidate
    is reported with the gain of all effects up to it, if that is positive on the held-out samples."""
    explanation, context, candidates = result.found, result.context, []
    doubtful_indices = [number for number, step in enumerate(explanation.steps) if step.newest not in SHOWN_BY_SIGNAL]
    if len(doubtful_indices) < len(explanation.steps) and not predicts_motion(context.full_measure, explanation.plain):
        doubtful_indices = list(range(len(explanation.steps)))
    if not doubtful_indices:
        return result
    for number in reversed(doubtful_indices):  # the last first: the numbers of those before it stay
        step = explanation.steps[number]
        gain = estimate_held_out_gain(context.full_measure, explanation.plain, context.with_test_score(step))
        if gain is not None and gain.gain > 0:
            reason = BESIDE_DIVERGENCE if step.newest in SHOWN_BY_SIGNAL else ONLY_BESIDE_CALIBRATION
            candidates.append(Unconfirmed(step.fitted.hypothesis, gain.gain, reason))
        explanation = remove_effect(context, explanation, number)
    ranked = tuple(sorted(candidates, key=lambda candidate: -candidate.gain))
    return replace(
        result, found=explanation, judgement=judge(explanation), errors=None, unconfirmed=(*result.unconfirmed, *ranked)
    )
