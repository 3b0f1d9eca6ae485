"""Sentences of the report on backlash with impacts, whose diagnosis compares band powers instead of samples.

Errors are rms natural logarithms of the ratio of predicted to measured amplitude (`errors.band_power`), so that
exp(error) is the typical factor between them.
"""

import math

from analysis.diagnosis.document import Diagnosis

IMPACTS_COMPARED = (
    "The device rattles, and no simulation predicts a sequence of impacts for long: simulations whose initial states "
    "differ by a billionth soon diverge. Instead of samples, the power of each channel in each half octave of each "
    "segment was compared. The errors are root-mean-square logarithms of the ratio of amplitudes, and the difference "
    "between two simulations of the same play, at least 5 %, takes the place of the noise. No black box was fitted "
    "for comparison, because it would have to predict each impact."
)
"""Remark on every such diagnosis: how impacts were compared, and what the errors mean."""


def format_impact_answer(diagnosis: Diagnosis, effect_words: str) -> str:
    """Format the first sentences of the report: the named effects, and the factors between predicted and measured
    amplitudes without them, with them, and by chance alone, from held-out errors where there are any, else from those
    of the fit; a statement that they are not known where one of the three is missing. effect_words: the named effects,
    in words."""
    errors = diagnosis.fit.test if diagnosis.fit.test.after is not None else diagnosis.fit.fit
    verdict_text = "" if diagnosis.verdict == "explained" else ", but that is not all"
    log_ratios = [errors.retuned, errors.after, errors.noise]
    factors = [f"{math.exp(ratio):.3g}" for ratio in log_ratios if ratio is not None]
    factors_text = "the error of the predicted amplitudes is not known"
    if len(factors) == len(log_ratios):
        factor_without, factor_with, factor_by_chance = factors
        factors_text = (
            f"their strength can: in half octaves, the predicted amplitudes are wrong by a factor of {factor_without} "
            f"without this effect and of {factor_with} with it; chance alone gives a factor of {factor_by_chance}"
        )
    return (
        f"Missing in the model: {effect_words}{verdict_text}. Its impacts cannot be predicted one by one; "
        f"{factors_text}."
    )
