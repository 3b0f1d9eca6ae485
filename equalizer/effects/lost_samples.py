"""Lost samples: in place of a lost sample, a logger repeats the last sample that arrived.

    y[k] = y[k-1] for a random fraction of all samples, else y[k] = x[k]

Without a measurement, a simulation draws the lost samples at random. With a measurement, the samples are lost for which
the measured value is likelier under repetition than under the simulated value (likelihood ratio test with prior odds,
equation in `simulation.logger_kernel`). An entry of `catalogue`.
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.logger_kernel import repeat_likely_losses, repeat_lost_samples
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import BoolArray, FloatArray

DISTINGUISHABLE_SIGMA = 4.0
"""Difference of two successive samples, over the noise, above which a repeated sample is distinguishable. Chosen, as
are the limits below."""
LEAST_LOST_SAMPLES = 8
"""Fewest lost samples for a fraction to be estimated."""
LARGEST_FRACTION = 0.3
"""Largest fraction of lost samples."""
FRACTION_ITERATIONS = 4
"""Number of iterations; each decides with the last fraction which samples are lost, and counts them for the next."""
LEAST_CONTROL_RATIO = 3.0
"""Negative control: repeated samples must be more than this many times as frequent as samples that equal the next
sample, for which there is no physical cause."""


def _repeat_at_random(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    """Repeat samples of these channels of the response (n, p) at random: `OnResponse.change` of this effect."""
    # Seeded with the length, so that the same samples are lost in every simulation of a recording.
    is_lost = np.random.default_rng(len(response)).random(len(response)) < values["fraction"]
    readings, repeated = response.copy(), np.empty((len(response), len(channels)))
    repeat_lost_samples(np.ascontiguousarray(response[:, channels]), is_lost, repeated)
    readings[:, channels] = repeated
    return readings


def _repeat_as_measured(
    response: FloatArray, measured: FloatArray, noise: FloatArray, channels: tuple[int, ...], values: Values
) -> FloatArray:
    """Repeat the samples of the response (n, p) that the measurement shows as lost; unchanged unless the fraction lies
    between 0 and 1."""
    if not 0 < values["fraction"] < 1:
        return response
    columns, readings = list(channels), response.copy()
    readings[:, columns] = _repeat_by_likelihood(
        response[:, columns], measured[:, columns], noise[columns], values["fraction"]
    )[0]
    return readings


def _repeat_by_likelihood(
    samples: FloatArray, measured: FloatArray, noise: FloatArray, fraction: float
) -> tuple[FloatArray, BoolArray]:
    """Compute the samples (n, c) after losses, and a mask (n,) of the lost ones, by likelihood ratio with the prior
    odds of the fraction."""
    readings, is_lost = np.empty(samples.shape), np.zeros(len(samples), dtype=np.bool_)
    repeat_likely_losses(
        np.ascontiguousarray(samples),
        np.ascontiguousarray(measured),
        np.ascontiguousarray(noise),
        2 * math.log((1 - fraction) / fraction),
        readings,
        is_lost,
    )
    return readings, is_lost


def _repeat_positions_as_measured(
    response_before: FloatArray, response_after: FloatArray, position: FloatArray, measured: FloatArray
) -> FloatArray:
    """Repeat positions (n, p) where samples of the response are lost, provided that this brings them closer to the
    measured position, i.e. the same logger recorded both. Then also repeat those where only the position shows a loss,
    because the response hardly changed between the two samples."""
    is_lost = np.any(response_after != response_before, axis=1)
    if not is_lost.any():
        return position
    repeated_position = _repeat_rows(position, is_lost)
    if not np.nansum((measured - repeated_position)[is_lost] ** 2) < np.nansum((measured - position)[is_lost] ** 2):
        return position
    return _repeat_rows(position, is_lost | _find_clear_repetitions(position, measured))


def _repeat_rows(position: FloatArray, is_lost: BoolArray) -> FloatArray:
    """Replace each lost row of positions (n, p) by the last row that was not lost."""
    repeated_position = np.empty(position.shape)
    repeat_lost_samples(np.ascontiguousarray(position), is_lost, repeated_position)
    return repeated_position


def _find_clear_repetitions(position: FloatArray, measured: FloatArray) -> BoolArray:
    """Mark the samples (n,) whose measured position is clearly nearer to the simulated position of the preceding sample
    than to their own: the difference of the squared distances, in units of the noise (1.4826 times the median absolute
    error), exceeds half of `DISTINGUISHABLE_SIGMA` squared."""
    error = measured - position
    noise = 1.4826 * np.nanmedian(np.abs(error), axis=0)
    position_step = np.diff(position, axis=0, prepend=position[:1])
    with np.errstate(divide="ignore", invalid="ignore"):
        # Squared distance to the preceding position minus squared distance to the sample's own position.
        squared_distance_change = np.nansum((2 * error * position_step + position_step**2) / noise**2, axis=1)
    return np.asarray(squared_distance_change < -(DISTINGUISHABLE_SIGMA**2) / 2)


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find the fraction of lost samples; empty where they are too few, or not `LEAST_CONTROL_RATIO` times as frequent
    as in the negative control. For all channels together (ALL_SITES, -1) the last channel is used."""
    columns = [channel]
    fraction = _estimate_fraction(evidence, columns, 1)
    return (
        ({"fraction": fraction},)
        if fraction is not None and fraction > LEAST_CONTROL_RATIO * (_estimate_fraction(evidence, columns, -1) or 0)
        else ()
    )


def _estimate_fraction(evidence: Evidence, columns: list[int], direction: int) -> float | None:
    """Estimate the fraction of lost samples among those where a loss is distinguishable, at most `LARGEST_FRACTION`;
    None for fewer than `LEAST_LOST_SAMPLES`. direction: 1, or -1 for the negative control, in reversed time (samples
    that equal the next)."""
    samples, measured = evidence.predicted[::direction, columns], evidence.response[::direction, columns]
    noise, is_used = evidence.noise[columns], evidence.used[::direction] > 0
    is_distinguishable = (
        np.sum((np.diff(samples, axis=0, prepend=samples[:1]) / noise) ** 2, axis=1) > DISTINGUISHABLE_SIGMA**2
    )
    is_countable = is_distinguishable & is_used
    if not is_countable.any():
        return None
    fraction = 0.01  # start of the iteration
    for _ in range(FRACTION_ITERATIONS):
        is_lost = _repeat_by_likelihood(samples, measured, noise, fraction)[1]
        lost_count = int(np.count_nonzero(is_lost & is_countable))
        if lost_count < LEAST_LOST_SAMPLES:
            return None
        fraction = min(lost_count / int(np.count_nonzero(is_countable)), LARGEST_FRACTION)
    return fraction


EFFECT = Effect(
    name="lost_samples",
    equation="y[k] = y[k-1] at a fraction of all samples, by chance; else x[k]",
    source="Gilbert 1960, Bell Syst. Tech. J. 39:1253: losses in a channel",
    signature="single samples repeat the one before, scattered at random, in the response and in nothing "
    "that another logger read",
    parameters=(Parameter("fraction", 1e-6, LARGEST_FRACTION, none=0.0, fixed=True),),
    action=OnResponse(
        _repeat_at_random, stage=5, conditioned=_repeat_as_measured, conditioned_position=_repeat_positions_as_measured
    ),
    starts=_find_starting_values,
    of_time=True,
    sites=("all", "one"),
)
