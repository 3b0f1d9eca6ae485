"""Withdraws the names of effects of a search whose model was fitted to the same recordings.

The parameters of such a model have absorbed part of a missing law, and a wrong law may imitate the remainder. Therefore
an effect must remove at least `FURTHER_LAW_SHARE` of the held-out error power, as the laws of a force balance must
(`require_enough_gain`); effects become candidates, unless the signal itself shows them (`withdraw_doubtful_names`).
"""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.confirm.held_out_gain import estimate_held_out_gain, predicts_motion
from analysis.diagnosis.limits import FURTHER_LAW_SHARE
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.revise_selection import remove_effect
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.verdict import SearchResult, UnconfirmedEffect, judge

CONSTANT_FORCE = "constant_force"
CONSTANT_EFFECTS = {CONSTANT_FORCE: "force", "sensor_offset": "offset"}
"""Name of the parameter of each effect that is a constant of a fitted model and no missing physics."""
EFFECTS_VISIBLE_IN_SIGNAL = ("sensor_clipping", "quantization", "mains_hum", "lost_samples")
"""Effects of a sensor that can be seen in its signal without a model."""
MODEL_FITTED_REASON = (
    "the model was fitted to these recordings, and a law of the motion that the catalogue lacks may have the same "
    "effect; a calibrated model, or recordings of the device without the fault, would distinguish them"
)
"""Reason not to name an effect of actuator or sensor where the model was fitted to the same recordings."""
MODEL_DIVERGES_REASON = (
    "without it the model's error is larger than the signal: any effect that bounds the prediction lowers it"
)
"""Reason not to name an effect that the signal shows, where the model without it predicts worse than the mean."""


def require_enough_gain(result: SearchResult, noise_is_measured: bool) -> SearchResult:
    """Keep only effects that remove as much of the held-out error power as a law of a balance must: effects are dropped
    from the last on until the last one removes enough. noise_is_measured: whether repeated periods show the noise;
    without them the verdict `explained` becomes `partly_explained`, because no error is known to be noise alone.
    Where all effects are constants, which are parameters of the model, or none is left, `explained` stays."""
    explanation = result.found
    while explanation.steps and not _removes_enough(result.context, explanation):
        explanation = remove_effect(result.context, explanation, len(explanation.steps) - 1)
        result = replace(result, found=explanation, judgement=judge(explanation), errors=None)
    effect_names = {
        placed_effect.effect.name for placed_effect in explanation.after.fitted.hypothesis.list_placed_effects()
    }
    if noise_is_measured or result.judgement.verdict != "explained" or effect_names <= set(CONSTANT_EFFECTS):
        return result
    return replace(result, judgement=replace(result.judgement, verdict="partly_explained"))


def _removes_enough(context: SearchContext, explanation: Explanation) -> bool:
    """Whether the last effect removes at least `FURTHER_LAW_SHARE` of the held-out error power that remains with the
    effects before it. True where nothing is held out: both errors are then infinite."""
    previous_step = context.with_test_score(explanation.steps[-2]) if len(explanation.steps) > 1 else explanation.plain
    # `held_out_error` is a logarithm of rms errors, and thus half of the logarithm of the error power.
    return not explanation.after.held_out_error > previous_step.held_out_error + np.log(1 - FURTHER_LAW_SHARE) / 2


def withdraw_doubtful_names(result: SearchResult) -> SearchResult:
    """Make named effects candidates unless the signal itself shows them: the model was fitted to these recordings, so
    that a law of the motion that the catalogue lacks may have the same effect as a nonlinear or delayed sensor. An
    effect that the signal shows is a candidate, too, where the model without effects fails `predicts_motion`. A
    candidate is reported with the gain of all effects up to it, if that is positive on the held-out samples."""
    explanation, context, candidates = result.found, result.context, []
    doubtful_indices = [
        step_index for step_index, step in enumerate(explanation.steps) if step.newest not in EFFECTS_VISIBLE_IN_SIGNAL
    ]
    if len(doubtful_indices) < len(explanation.steps) and not predicts_motion(context.full_measure, explanation.plain):
        doubtful_indices = list(range(len(explanation.steps)))
    if not doubtful_indices:
        return result
    for step_index in reversed(doubtful_indices):  # from the last on, so that the remaining indices stay valid
        step = explanation.steps[step_index]
        gain = estimate_held_out_gain(context.full_measure, explanation.plain, context.with_test_score(step))
        if gain is not None and gain.gain > 0:
            reason = MODEL_DIVERGES_REASON if step.newest in EFFECTS_VISIBLE_IN_SIGNAL else MODEL_FITTED_REASON
            candidates.append(UnconfirmedEffect(step.fitted.hypothesis, gain.gain, reason))
        explanation = remove_effect(context, explanation, step_index)
    ranked_candidates = tuple(sorted(candidates, key=lambda candidate: -candidate.gain))
    return replace(
        result,
        found=explanation,
        judgement=judge(explanation),
        errors=None,
        unconfirmed=(*result.unconfirmed, *ranked_candidates),
    )
