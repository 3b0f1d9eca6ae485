"""Sentences for a diagnosis of rattling play, which compares band powers of the response instead of samples.

Errors are rms logarithms of the ratio of amplitudes (`errors.band_power`), so that exp(error) is the factor by which
amplitudes are off.
"""

import math

from analysis.diagnosis.document import Diagnosis

IMPACTS_COMPARED = (
    "The device rattles, and no simulation predicts a sequence of impacts for long: two that differ by a billionth "
    "soon part. Instead of samples, the power of each channel in each half octave of each segment was compared. The "
    "errors are root-mean-square logarithms of the ratio of amplitudes, and what two simulations of the same play "
    "differ by, at least 5 %, stands where the noise stands otherwise. No black box was fitted beside: it would have "
    "to predict each impact."
)
"""Remark on every such diagnosis: how impacts were compared, and what the errors mean."""


def impact_sentence(diagnosis: Diagnosis, named: str) -> str:
    """The answer, with which the report begins: the named effects, and the factors by which amplitudes are off without
    them, with them, and by chance alone (held-out errors, else those of the fit). named: the effects, in words."""
    errors = diagnosis.fit.test if diagnosis.fit.test.after is not None else diagnosis.fit.fit
    rest = "" if diagnosis.verdict == "explained" else ", but that is not all"
    off = [errors.retuned, errors.after, errors.noise]
    factors = [f"{math.exp(ratio):.3g}" for ratio in off if ratio is not None]
    text = "how far its amplitudes are off is not known"
    if len(factors) == len(off):
        without, with_it, chance = factors
        text = (
            f"how strong they are, can: by half octaves, amplitudes are off by a factor of {without} without it and "
            f"of {with_it} with it, and chance alone makes {chance} of it"
        )
    return f"Missing in the model: {named}{rest}. Its impacts cannot be predicted one by one; {text}."
