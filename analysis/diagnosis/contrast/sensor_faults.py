"""Faults of a sensor: what it would have read without them."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from analysis.diagnosis.contrast.actuator_faults import AROUND, BEGUN, GRID, at_times, late_times, later, middle_hz
from analysis.diagnosis.contrast.fault import EVERY, Fault, Numbers, Undo, Variant, sized
from analysis.diagnosis.contrast.taken import Taken
from equalizer.effects.simulation.bristle_kernel import bristle_bend
from equalizer.signals.signal import FloatArray

Read = Callable[[FloatArray, float], FloatArray]
"""What one channel (n,) would have read, at a rate."""
WIDELY = (0.5, 1.6)
"""As AROUND, of faults that act nearly in proportion to their size."""
GAINS = (0.35, 0.5, 0.62, 0.75, 0.85, 0.92, 0.96, 1.04, 1.08, 1.15, 1.25, 1.4, 1.6, 2.0, 2.6)
SHIFTS = (0.03, 0.1, 0.3, 0.7, 1.2)
"""Of the channel's rms."""
BENT = (0.02, 0.06, 0.15, 0.3)
"""Share of its largest reading by which that is off."""
PLAYS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8)
"""As SHIFTS, of a gap before the sensor."""
TURNED = 0.05
"""Of a gap, by which a reading goes back that turns round."""
FASTEST = 0.05
"""No clock is further off."""
IN_UNITS = ("sensor_offset", "sensor_drift")
"""Faults that only channels of one unit can have alike."""


@dataclass(frozen=True, slots=True)
class _Channel:
    numbers: tuple[int, ...]
    """That have the fault: a channel, or all that there are."""
    name: str
    rms: float
    top: float

    def fault(self, effect: str, variants: Sequence[Variant], simpler: tuple[str, ...] = ()) -> Fault:
        site = self.numbers[0] if self.name else EVERY
        return Fault(effect, "sensor", self.name, site, tuple(variants), simpler)

    def of(self, read: Read) -> Undo:
        def undo(taken: Taken) -> Taken:
            response = taken.response.copy()
            for number in self.numbers:
                response[:, number] = read(response[:, number], taken.rate_hz)
            return replace(taken, response=response)

        return undo


def sensor_faults(number: int, name: str, parts: Sequence[Taken]) -> Iterator[Fault]:
    """parts: of all that is compared, which the grids span."""
    whole = np.concatenate([part.response[:, number] for part in parts])
    channel = _Channel((number,), name, float(np.std(whole)) or 1.0, float(np.abs(whole).max(initial=0.0)) or 1.0)
    longest = max(parts, key=lambda part: len(part.response))
    yield from _shared(channel, longest, longest.response[:, number])
    shares = [side * share for share in BENT for side in (1.0, -1.0)]
    yield channel.fault("sensor_nonlinearity", [_bent(channel, share, 3, "cubic") for share in shares])
    yield channel.fault("sensor_asymmetry", [_bent(channel, share, 2, "square") for share in shares])
    yield channel.fault("sensor_play", [_play(channel, share * channel.rms) for share in PLAYS])
    for other in range(longest.response.shape[1]):
        if other != number:
            yield _heard(channel, other)


def faults_of_all(parts: Sequence[Taken]) -> Iterator[Fault]:
    """That all channels have alike: of one supply, one filter, one logger. parts: as above."""
    whole = np.vstack([part.response for part in parts])
    sizes = np.std(whole, axis=0)
    largest = int(np.argmax(sizes))
    top = float(np.abs(whole).max(initial=0.0)) or 1.0
    channel = _Channel(tuple(range(whole.shape[1])), "", float(sizes[largest]) or 1.0, top)
    longest = max(parts, key=lambda part: len(part.response))
    alike = len(set(longest.recording.response.units)) == 1
    for fault in _shared(channel, longest, longest.response[:, largest]):
        if alike or fault.effect not in IN_UNITS:
            yield fault


def _shared(channel: _Channel, longest: Taken, course: FloatArray) -> Iterator[Fault]:
    """Faults that one channel may have, or all. course: (n,) of the longest part."""
    times = late_times(course, longest.rate_hz)
    yield channel.fault("sensor_gain", [_gain(channel, gain) for gain in GAINS])
    shifts = [side * share * channel.rms for share in SHIFTS for side in (1.0, -1.0)]
    yield channel.fault("sensor_offset", [_offset(channel, shift) for shift in shifts])
    drifts = [_drift(channel, shift, begun) for shift in shifts for begun in BEGUN]
    yield replace(channel.fault("sensor_drift", drifts, ("sensor_offset",)), varies=True)
    yield channel.fault("logger_offset", [_late(channel, time_s) for time_s in times])
    yield channel.fault("sensor_lag", [_lag(channel, time_s, longest.rate_hz) for time_s in times])
    seconds = len(longest.response) / longest.rate_hz
    least = 0.02 / middle_hz(course, longest.rate_hz) / seconds
    rates = [side * float(rate) for rate in least * np.geomspace(0.2, 100.0, GRID) for side in (1.0, -1.0)]
    clocks = [_other_clock(channel, rate) for rate in rates if abs(rate) < FASTEST]
    yield replace(channel.fault("clock_drift", clocks), varies=True)


def _play(channel: _Channel, gap: float) -> Variant:
    return Variant((channel.of(lambda y, rate: _driven(y, gap)),), sized("gap", gap), *WIDELY)


def _driven(y: FloatArray, gap: float) -> FloatArray:
    """What drives a reading through a gap: half of it ahead. It turns round at the reading's extreme, at first slowly,
    and has crossed the gap where the reading turns round, too."""
    side = np.sign(bristle_bend(y, TURNED * gap))
    ahead = 0.5 * side
    turns = np.flatnonzero(side[1:] * side[:-1] < 0) + 1
    for begin, turn in pairwise([0, *turns.tolist()]):
        course = side[turn - 1] * y[begin:turn]
        top = begin + int(np.argmax(course))
        left = top + int(np.flatnonzero(course[top - begin :] > course.max() - TURNED * gap)[-1])
        crossed = (np.arange(top, turn) - top) / max(left - top, 1)
        ahead[top:turn] = side[turn - 1] * (0.5 - np.minimum(crossed, 1.0) ** 2)
    return np.asarray(y + gap * ahead)


def _heard(channel: _Channel, other: int) -> Fault:
    """Another channel in this one."""
    (own,) = channel.numbers

    def undo(taken: Taken) -> Taken:
        response = taken.response.copy()
        response[:, own] -= taken.response[:, other]
        return replace(taken, response=response)

    return channel.fault("cross_axis_sensitivity", [Variant((undo,), sized("from_next"))])


def _gain(channel: _Channel, gain: float) -> Variant:
    undo = channel.of(lambda y, rate: y / gain)
    return Variant((undo,), lambda s: {"gain": 1 / (1 + float(s[0]) * (1 / gain - 1))}, *AROUND, lambda step: gain)


def _offset(channel: _Channel, shift: float) -> Variant:
    return Variant((channel.of(lambda y, rate: y - shift),), sized("offset", shift), *WIDELY)


def _drift(channel: _Channel, total: float, begun: float) -> Variant:
    undo = channel.of(lambda y, rate: y - total * np.linspace(begun, 1.0, len(y)))
    return Variant((undo,), sized("total", total), *WIDELY)


def _late(channel: _Channel, time_s: float) -> Variant:
    return Variant(
        (channel.of(lambda y, rate: later(y[:, None], -time_s * rate)[:, 0]),), sized("offset", time_s), *AROUND
    )


def _lag(channel: _Channel, time_s: float, rate_hz: float) -> Variant:
    """A low pass y += share (x - y) from sample to sample, taken back exactly."""
    kept = float(np.exp(-1 / (time_s * rate_hz)))
    undo = channel.of(lambda y, rate: (y - kept * np.concatenate([y[:1], y[:-1]])) / (1 - kept))
    numbers: Numbers = lambda s: {"bandwidth": 1 / (2 * np.pi * time_s * float(s[0]))}  # noqa: E731
    return Variant((undo,), numbers, *AROUND, lambda step: _mean_gain(kept, step))


def _mean_gain(kept: float, step: int) -> float:
    """Of the low pass, as a mean of logarithms over what every so many samples hold: by so much it makes smaller what
    cannot be foretold (Kolmogorov's formula for the error of the best prediction of a next sample)."""
    turn = np.pi / step * (np.arange(256) + 0.5) / 256
    return float(np.exp(np.mean(np.log((1 - kept) / np.abs(1 - kept * np.exp(-1j * turn))))))


def _bent(channel: _Channel, share: float, power: int, number: str) -> Variant:
    top = channel.top
    undo = channel.of(lambda y, rate: _straightened(y / top, share, power) * top)
    return Variant((undo,), sized(number, share / top ** (power - 1)), *WIDELY)


def _straightened(y: FloatArray, share: float, power: int) -> FloatArray:
    """The x with y = x + share x^power, by Newton's steps."""
    x = y.copy()
    for _ in range(20):
        slope = 1 + power * share * x ** (power - 1)
        x = x - (x + share * x**power - y) / np.where(np.abs(slope) > 0.1, slope, 0.1)
    return np.asarray(np.clip(x, -3.0, 3.0))


def _other_clock(channel: _Channel, late: float) -> Variant:
    """Read at t (1 + late), put back to t."""
    undo = channel.of(lambda y, rate: at_times(y, np.arange(len(y)) / (1 + late)))
    return Variant((undo,), sized("ppm", 1e6 * late), *AROUND)


TURNS = (
    ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),
    ((0.0, 0.0, -1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
)


def turned_sensor() -> Fault:
    """Three directions of one sensor, turned together by small angles."""

    def of(turn: FloatArray) -> Undo:
        return lambda taken: replace(taken, response=taken.response + taken.response @ turn.T)

    undo = tuple(of(np.array(turn)) for turn in TURNS)
    variant = Variant(undo, lambda s: {"degrees": float(np.degrees(np.linalg.norm(s)))})
    return Fault("sensor_misalignment", "sensor", "", EVERY, (variant,))
