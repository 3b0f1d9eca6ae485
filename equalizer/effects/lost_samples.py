"""Lost samples: the last sample that arrived is repeated in place of each, at random.

Simulated without a measurement, samples are drawn at random with the given fraction. Conditioned on one, those are lost
that the measurement explains better by the sample before (likelihood ratio).
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.reading_kernel import Flags, repeat_as_measured, repeat_where
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

CLEAR = 4.0
"""Difference of two samples, in units of the noise, above which it is clear which of them was read."""
LEAST_EVENTS = 8
"""Fewest repeated readings that count as lost samples."""
LARGEST = 0.3
"""Largest fraction of lost samples."""
ROUNDS = 4
"""Passes that refine which samples are lost."""
CONTROL = 3.0
"""Negative control: repeats must be this many times as frequent as samples that equal the next one, which no physical
cause produces."""


def _lose_at_random(
    response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values
) -> FloatArray:
    lost = np.random.default_rng(len(response)).random(len(response)) < values["fraction"]
    read, held = response.copy(), np.empty((len(response), len(channels)))
    repeat_where(np.ascontiguousarray(response[:, channels]), lost, held)
    read[:, channels] = held
    return read


def _lose_as_measured(
    response: FloatArray, measured: FloatArray, noise: FloatArray, channels: tuple[int, ...], values: Values
) -> FloatArray:
    if not 0 < values["fraction"] < 1:
        return response
    which, read = list(channels), response.copy()
    read[:, which] = _repeat_by_likelihood(response[:, which], measured[:, which], noise[which], values["fraction"])[0]
    return read


def _repeat_by_likelihood(
    samples: FloatArray, measured: FloatArray, noise: FloatArray, fraction: float
) -> tuple[FloatArray, Flags]:
    read, lost = np.empty(samples.shape), np.zeros(len(samples), dtype=np.bool_)
    repeat_as_measured(
        np.ascontiguousarray(samples),
        np.ascontiguousarray(measured),
        np.ascontiguousarray(noise),
        2 * math.log((1 - fraction) / fraction),
        read,
        lost,
    )
    return read, lost


def _lose_positions_as_measured(
    before: FloatArray, after: FloatArray, position: FloatArray, measured: FloatArray
) -> FloatArray:
    """Repeats positions where the response repeats, provided that the measured position shows that the same logger read
    it; then also where only the position shows it, because the response hardly changed from one sample to the next."""
    lost = np.any(after != before, axis=1)
    if not lost.any():
        return position
    held = _repeat_rows(position, lost)
    if not np.nansum((measured - held)[lost] ** 2) < np.nansum((measured - position)[lost] ** 2):
        return position
    return _repeat_rows(position, lost | _is_clearly_repeated(position, measured))


def _repeat_rows(position: FloatArray, lost: Flags) -> FloatArray:
    held = np.empty(position.shape)
    repeat_where(np.ascontiguousarray(position), lost, held)
    return held


def _is_clearly_repeated(position: FloatArray, measured: FloatArray) -> Flags:
    """Mask of the samples whose measured position is far nearer to the simulated position of the sample before than to
    their own, in units of the noise (1.4826 times the median absolute deviation)."""
    error = measured - position
    noise = 1.4826 * np.nanmedian(np.abs(error), axis=0)
    step = np.diff(position, axis=0, prepend=position[:1])
    with np.errstate(divide="ignore", invalid="ignore"):
        # The squared distance to the position before, less that to its own.
        nearer = np.nansum((2 * error * step + step**2) / noise**2, axis=1)
    return np.asarray(nearer < -(CLEAR**2) / 2)


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    which = [channel]
    found = _estimate_fraction(evidence, which, 1)
    return (
        ({"fraction": found},)
        if found is not None and found > CONTROL * (_estimate_fraction(evidence, which, -1) or 0)
        else ()
    )


def _estimate_fraction(evidence: Evidence, which: list[int], forwards: int) -> float | None:
    """Share of lost samples among those where both cases can be distinguished; backwards (-1), of those that equal the
    next one. None for too few events."""
    samples, measured = evidence.predicted[::forwards, which], evidence.response[::forwards, which]
    noise, used = evidence.noise[which], evidence.used[::forwards] > 0
    apart = np.sum((np.diff(samples, axis=0, prepend=samples[:1]) / noise) ** 2, axis=1) > CLEAR**2
    clear = apart & used
    if not clear.any():
        return None
    fraction = 0.01
    for _ in range(ROUNDS):
        lost = _repeat_by_likelihood(samples, measured, noise, fraction)[1]
        events = int(np.count_nonzero(lost & clear))
        if events < LEAST_EVENTS:
            return None
        fraction = min(events / int(np.count_nonzero(clear)), LARGEST)
    return fraction


EFFECT = Effect(
    name="lost_samples",
    equation="y[k] = y[k-1] at a fraction of all samples, by chance; else x[k]",
    source="Gilbert 1960, Bell Syst. Tech. J. 39:1253: losses in a channel",
    signature="single samples repeat the one before, scattered at random, in the response and in nothing "
    "that another logger read",
    parameters=(Parameter("fraction", 1e-6, LARGEST, none=0.0, fixed=True),),
    acts=OnResponse(_lose_at_random, stage=5, given=_lose_as_measured, given_position=_lose_positions_as_measured),
    starts=_starts,
    of_time=True,
    sites=("all", "one"),
)
