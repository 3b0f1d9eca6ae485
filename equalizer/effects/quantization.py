"""Quantization: the response takes only whole multiples of a converter's step.

Where the recording itself lies on such a lattice, the reading before rounding is known to half a step, and the residual
is computed as the quantile of the noise (Dunn and Smyth 1996, J. Comput. Graph. Stat. 5:236), so that noise which
dithers the steps is not taken for a misfit. Otherwise the noise was added after rounding, and the prediction is
rounded.
"""

import numpy as np
from scipy.special import ndtr, ndtri

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.lattice import lattice_offset, lattice_step, staircase_step
from equalizer.effects.starts.response_starts import channels_of
from equalizer.signals.signal import FloatArray

FAR = 1e-12
"""Probability beyond which a quantile is not computed: its digits are lost."""


def _round_response(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    read = response.copy()
    if values["step"] > 0:
        read[:, channels] = values["step"] * np.round(response[:, channels] / values["step"])
    return read


def _round_as_measured(
    response: FloatArray, measured: FloatArray, noise: FloatArray, channels: tuple[int, ...], values: Values
) -> FloatArray:
    read, step = _round_response(response, 0.0, channels, values), values["step"]
    for channel in channels:
        if lattice_offset(measured[:, channel], step) is not None:
            read[:, channel] = _quantile_response(
                response[:, channel], measured[:, channel], float(noise[channel]), step
            )
    return read


def _quantile_response(response: FloatArray, measured: FloatArray, noise: float, step: float) -> FloatArray:
    """The prediction for which the residual is the noise's quantile (randomised quantile residual)."""
    missing = measured - response
    # Computed from the shorter tail, whose probabilities keep their digits.
    side = np.where(missing > 0, -1.0, 1.0)
    low, high = ndtr((side * missing - step / 2) / noise), ndtr((side * missing + step / 2) / noise)
    chance = np.random.default_rng(len(response)).random(len(response))
    residual = side * noise * ndtri(np.clip(low + chance * (high - low), FAR, 1 - FAR))
    far = high < FAR
    residual[far] = (missing - np.sign(missing) * step / 2)[far]
    return np.asarray(measured - residual)


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    used = evidence.used > 0
    for each in channels_of(evidence, channel):
        measured, noise = evidence.response[used, each], float(evidence.noise[each])
        step = lattice_step(measured) or staircase_step(measured, noise)
        if step is not None:
            return ({"step": step},)
    return ()


EFFECT = Effect(
    name="quantization",
    equation="y = step round(x / step)",
    source="Widrow and Kollar, Quantization Noise, Cambridge 2008",
    signature="the response takes whole multiples of one step, with as much error at every level, while the position "
    "agrees",
    parameters=(Parameter("step", 1e-12, 1e9, none=0.0, fixed=True),),
    acts=OnResponse(_round_response, stage=3, given=_round_as_measured),
    starts=_starts,
    sites=("all", "one"),
)
