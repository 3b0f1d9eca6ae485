"""Quantization: the response takes only whole multiples of the step of an analogue-to-digital converter.

    y = step round(x / step)        step in the unit of the response

Where the recorded values lie on such a lattice, noise was rounded with the signal. The value before rounding is then
known to half a step, and the residual is the quantile of the noise (randomised quantile residual; Dunn and Smyth 1996,
J. Comput. Graph. Stat. 5:236), so that rounded noise does not count as misfit. Where they do not, noise was added after
rounding, and the prediction is rounded.
"""

import numpy as np
from scipy.special import ndtr, ndtri

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.lattice import lattice_offset, lattice_step, staircase_step
from equalizer.effects.starts.response_starts import site_channels
from equalizer.signals.signal import FloatArray

LEAST_TAIL = 1e-12
"""Least tail probability for which a quantile is computed; below it too few significant digits remain."""


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
    """The prediction (n, p): by quantile residuals in channels that were recorded on the lattice, else rounded."""
    read, step = _round_response(response, 0.0, channels, values), values["step"]
    for channel in channels:
        if lattice_offset(measured[:, channel], step) is not None:
            read[:, channel] = _quantile_response(
                response[:, channel], measured[:, channel], float(noise[channel]), step
            )
    return read


def _quantile_response(response: FloatArray, measured: FloatArray, noise: float, step: float) -> FloatArray:
    """The prediction (n,) whose residual is the randomised quantile residual: the quantile of a uniformly random
    probability between those of both ends of the rounding interval. noise: rms of the noise before rounding."""
    missing = measured - response
    # Probabilities of the lower tail keep their digits: residuals above zero are mirrored.
    side = np.where(missing > 0, -1.0, 1.0)
    low, high = ndtr((side * missing - step / 2) / noise), ndtr((side * missing + step / 2) / noise)
    # Seeded with the length, so that a fit sees the same residual for the same prediction.
    chance = np.random.default_rng(len(response)).random(len(response))
    residual = side * noise * ndtri(np.clip(low + chance * (high - low), LEAST_TAIL, 1 - LEAST_TAIL))
    # Too improbable for a quantile: the distance to the nearest end of the rounding interval.
    is_extreme = high < LEAST_TAIL
    residual[is_extreme] = (missing - np.sign(missing) * step / 2)[is_extreme]
    return np.asarray(measured - residual)


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """The step of the lattice of measured values, or the step under added noise; empty where neither is found."""
    used = evidence.used > 0
    for column in site_channels(evidence, channel):
        measured, noise = evidence.response[used, column], float(evidence.noise[column])
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
    action=OnResponse(_round_response, stage=3, conditioned=_round_as_measured),
    starts=_starts,
    sites=("all", "one"),
)
