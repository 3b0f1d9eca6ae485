"""Quantization: the response takes only whole multiples of the step of an analogue-to-digital converter.

    y = step round(x / step)        step in the unit of the response

If the recorded values lie on such a lattice, noise was rounded together with the signal. The value before rounding is
then known to half a step, and the residual is the quantile of the noise (randomised quantile residual; Dunn and Smyth
1996, J. Comput. Graph. Stat. 5:236), so that rounded noise does not count as misfit. If they do not, noise was added
after rounding, and the prediction is rounded.

`EFFECT` is listed in the catalogue of effects; sizes in the functions: n samples, p response channels.
"""

import numpy as np
from scipy.special import ndtr, ndtri

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.lattice import find_lattice_offset, find_lattice_step, find_step_under_noise
from equalizer.effects.starts.response_starts import list_site_channels
from equalizer.signals.signal import FloatArray

MIN_TAIL_PROBABILITY = 1e-12
"""Smallest tail probability for which a quantile is computed; below it too few significant digits remain. Chosen."""


def _round_response(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    """Round these channels of a response (n, p) to multiples of the step; unchanged for a step that is not above 0."""
    rounded = response.copy()
    if values["step"] > 0:
        rounded[:, channels] = values["step"] * np.round(response[:, channels] / values["step"])
    return rounded


def _condition_on_measurement(
    response: FloatArray, measured: FloatArray, noise: FloatArray, channels: tuple[int, ...], values: Values
) -> FloatArray:
    """Condition the predicted response (n, p) on the measured one (n, p): by quantile residuals in channels that were
    recorded on the lattice, else by rounding. noise: (p,), rms before rounding, above 0."""
    conditioned, step = _round_response(response, 0.0, channels, values), values["step"]
    for channel in channels:
        if find_lattice_offset(measured[:, channel], step) is not None:
            conditioned[:, channel] = _compute_quantile_response(
                response[:, channel], measured[:, channel], float(noise[channel]), step
            )
    return conditioned


def _compute_quantile_response(response: FloatArray, measured: FloatArray, noise: float, step: float) -> FloatArray:
    """Compute the prediction (n,) whose residual is the randomised quantile residual: the quantile of a uniformly
    random probability between those of both ends of the rounding interval. response, measured: (n,); noise: rms of the
    noise before rounding, above 0."""
    deviation = measured - response
    # Positive deviations are mirrored, because only small probabilities (the lower tail) keep their significant digits.
    sign = np.where(deviation > 0, -1.0, 1.0)
    low_probability, high_probability = (
        ndtr((sign * deviation - step / 2) / noise),
        ndtr((sign * deviation + step / 2) / noise),
    )
    # Seeded with the length, so that the same prediction always has the same residual in a fit.
    uniform_draws = np.random.default_rng(len(response)).random(len(response))
    quantile_residual = (
        sign
        * noise
        * ndtri(
            np.clip(
                low_probability + uniform_draws * (high_probability - low_probability),
                MIN_TAIL_PROBABILITY,
                1 - MIN_TAIL_PROBABILITY,
            )
        )
    )
    # Too improbable for a quantile: the distance to the nearest end of the rounding interval.
    is_extreme = high_probability < MIN_TAIL_PROBABILITY
    quantile_residual[is_extreme] = (deviation - np.sign(deviation) * step / 2)[is_extreme]
    return np.asarray(measured - quantile_residual)


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find the step of the lattice of the measured values, or else the step under added noise, in the first channel
    where there is one; empty without any."""
    is_used = evidence.used > 0
    for column in list_site_channels(evidence, channel):
        measured_samples, noise = evidence.response[is_used, column], float(evidence.noise[column])
        step = find_lattice_step(measured_samples) or find_step_under_noise(measured_samples, noise)
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
    action=OnResponse(_round_response, stage=3, conditioned=_condition_on_measurement),
    starts=_find_starting_values,
    sites=("all", "one"),
)
