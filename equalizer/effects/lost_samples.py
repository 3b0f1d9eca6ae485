"""Samples that did not arrive: the last one read stands in their place. Which, is chance.

Played without a measurement, some samples are lost by the fraction. Given one, those are lost for which the sample
before is the likelier origin of what was measured.
"""

import math

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.simulation.reading_kernel import Flags, repeat_as_measured, repeat_where
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

CLEAR = 4.0
"""Times the noise by which two samples must differ to tell which of them was read."""
LEAST_EVENTS = 8
LARGEST = 0.3
ROUNDS = 4
CONTROL = 3.0
"""A repeated sample must be so many times as frequent as one that came early, which nothing physical does."""


def _played(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], of: Values) -> FloatArray:
    lost = np.random.default_rng(len(response)).random(len(response)) < of["fraction"]
    read, held = response.copy(), np.empty((len(response), len(channels)))
    repeat_where(np.ascontiguousarray(response[:, channels]), lost, held)
    read[:, channels] = held
    return read


def _given(
    response: FloatArray, measured: FloatArray, noise: FloatArray, channels: tuple[int, ...], of: Values
) -> FloatArray:
    if not 0 < of["fraction"] < 1:
        return response
    which, read = list(channels), response.copy()
    read[:, which] = _repeated(response[:, which], measured[:, which], noise[which], of["fraction"])[0]
    return read


def _repeated(
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


def _given_position(before: FloatArray, after: FloatArray, position: FloatArray, measured: FloatArray) -> FloatArray:
    """Repeats where the response does, if the measured position was read by the same logger and shows it."""
    lost = np.any(after != before, axis=1)
    if not lost.any():
        return position
    held = np.empty(position.shape)
    repeat_where(np.ascontiguousarray(position), lost, held)
    better = np.nansum((measured - held)[lost] ** 2) < np.nansum((measured - position)[lost] ** 2)
    return held if better else position


def _starts(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    which = [channel]
    found = _fraction(evidence, which, 1)
    return (
        ({"fraction": found},) if found is not None and found > CONTROL * (_fraction(evidence, which, -1) or 0) else ()
    )


def _fraction(evidence: Evidence, which: list[int], forwards: int) -> float | None:
    """Of the samples for which it can be told; backwards, of those that look like the next one."""
    samples, measured = evidence.predicted[::forwards, which], evidence.response[::forwards, which]
    noise, used = evidence.noise[which], evidence.used[::forwards] > 0
    apart = np.sum((np.diff(samples, axis=0, prepend=samples[:1]) / noise) ** 2, axis=1) > CLEAR**2
    clear = apart & used
    if not clear.any():
        return None
    fraction = 0.01
    for _ in range(ROUNDS):
        lost = _repeated(samples, measured, noise, fraction)[1]
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
    acts=OnResponse(_played, stage=5, given=_given, given_position=_given_position),
    starts=_starts,
    of_time=True,
    sites=("all", "one"),
)
