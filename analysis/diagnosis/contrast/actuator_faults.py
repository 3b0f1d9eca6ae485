"""Faults of an actuator: what the drive made of the recorded command."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import irfft, rfft

from analysis.diagnosis.contrast.fault import Fault, Numbers, Told, Undo, Variant, sized
from analysis.diagnosis.contrast.taken import Taken
from equalizer.effects.simulation.sensor_path import filter_one_pole
from equalizer.effects.simulation.slew_kernel import limit_rate
from equalizer.signals.band_limited import end_to_end_line, odd_extension
from equalizer.signals.signal import FloatArray

Made = Callable[[FloatArray, float], FloatArray]
"""What is made of one axis's command (n,), at a rate."""
AROUND = (0.75, 1.35)
"""Sizes between which a change of a size of 1 stands for others."""
LONGEST = 0.3
"""Of the period of the command's middle frequency, that it comes late: beyond, late is no word for it."""
GRID = 12
BEGUN = (0.0, 0.25, 0.5)
"""Share of a drift that had come before the recording."""


@dataclass(frozen=True, slots=True)
class _Axis:
    number: int
    name: str

    def fault(self, effect: str, variants: Sequence[Variant]) -> Fault:
        return Fault(effect, "actuator", self.name, self.number, tuple(variants))

    def of(self, made: Made) -> Undo:
        def undo(taken: Taken) -> Taken:
            command = taken.command.copy()
            command[:, self.number] = made(command[:, self.number], taken.rate_hz)
            return replace(taken, command=command)

        return undo


def actuator_faults(number: int, name: str, parts: Sequence[Taken], by_force: bool) -> Iterator[Fault]:
    """parts: of all that is compared, which the grids span. by_force: the command is what is told."""
    axis = _Axis(number, name)
    whole = np.concatenate([part.command[:, number] for part in parts])
    top = float(np.abs(whole).max(initial=0.0)) or 1.0
    rms = float(np.std(whole)) or top
    yield from _gains(axis, by_force)
    yield axis.fault("force_offset", [Variant((axis.of(lambda u, rate: u + rms),), sized("offset", rms))])
    cubed = Variant((axis.of(lambda u, rate: u + u**3 / top**2),), sized("cubic", 1 / top**2))
    yield axis.fault("actuator_cubic", [cubed])
    longest = max(parts, key=lambda part: len(part.command))
    times = late_times(longest.command[:, number], longest.rate_hz)
    yield axis.fault("transport_delay", [_delayed(axis, time_s) for time_s in times])
    yield axis.fault("amplifier_lag", [_lagging(axis, time_s) for time_s in times])
    shares = np.quantile(np.abs(whole), np.array([0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98])) / top
    limits = sorted(top * share for share in (*shares.tolist(), 0.5, 0.6, 0.7, 0.8, 0.9) if 0 < share < 0.995)
    yield axis.fault("force_saturation", [_saturated(axis, limit) for limit in limits])
    fastest = max(float(np.abs(np.diff(part.command[:, number])).max(initial=0.0)) * part.rate_hz for part in parts)
    if fastest > 0:
        yield axis.fault("slew_limit", [_slow(axis, float(rate)) for rate in fastest * np.geomspace(0.01, 0.9, GRID)])
    yield axis.fault("force_deadband", [_dead(axis, float(width)) for width in rms * np.geomspace(0.02, 1.5, GRID)])


def _gains(axis: _Axis, by_force: bool) -> Iterator[Fault]:
    """A size grows the command that is told where forces are balanced, and else the force that is made of it."""

    def gain(size: float) -> float:
        return 1 / (1 + size) if by_force else 1 + size

    yield axis.fault("force_gain", [
        Variant((axis.of(lambda u, rate: 2 * u),), lambda s: {"gain": gain(float(s[0]))}, -0.9, 20.0,
                told=lambda x, rate: 2 * x),
    ])  # fmt: skip
    drifts = [_drifting(axis, begun, lambda s: {"change": gain(float(s[0])) - 1}) for begun in BEGUN]
    yield replace(axis.fault("force_gain_drift", drifts), varies=True, simpler=("force_gain",))


def _drifting(axis: _Axis, begun: float, numbers: Numbers) -> Variant:
    def ramp(samples: FloatArray) -> FloatArray:
        return 1 + np.linspace(begun, 1.0, len(samples))

    undo = axis.of(lambda u, rate: u * ramp(u))
    return Variant((undo,), numbers, -0.9, 20.0, told=lambda x, rate: x * ramp(x)[:, None])


def _delayed(axis: _Axis, time_s: float) -> Variant:
    told: Told = lambda x, rate: later(x, -time_s * rate)  # noqa: E731
    undo = axis.of(lambda u, rate: later(u[:, None], time_s * rate)[:, 0])
    return Variant((undo,), sized("delay", time_s), *AROUND, told=told)


def _lagging(axis: _Axis, time_s: float) -> Variant:
    undo = axis.of(lambda u, rate: lagged(u, time_s * rate))
    told: Told = lambda x, rate: x + time_s * rate * np.gradient(x, axis=0)  # noqa: E731
    return Variant((undo,), sized("time_constant", time_s), *AROUND, told=told)


def _saturated(axis: _Axis, limit: float) -> Variant:
    return Variant((axis.of(lambda u, rate: np.clip(u, -limit, limit)),), lambda s: {"limit": limit}, 0.6, 1.5)


def _slow(axis: _Axis, limit: float) -> Variant:
    return Variant((axis.of(lambda u, rate: _followed(u, limit / rate)),), lambda s: {"rate": limit}, 0.6, 1.5)


def _followed(command: FloatArray, reach: float) -> FloatArray:
    """As near to the command as it comes by steps of `reach` at most."""
    mean, end = np.empty_like(command), np.empty_like(command)
    limit_rate(command - command[0], reach, mean, end)
    return np.asarray(end + command[0])


def _dead(axis: _Axis, width: float) -> Variant:
    undo = axis.of(lambda u, rate: np.sign(u) * np.maximum(np.abs(u) - width, 0.0))
    return Variant((undo,), sized("width", width), *AROUND)


def late_times(samples: FloatArray, rate_hz: float) -> list[float]:
    """From a tenth of a sample on, as long as late is a word for it."""
    shortest, longest = 0.1 / rate_hz, LONGEST / middle_hz(samples, rate_hz)
    return [float(time_s) for time_s in np.geomspace(shortest, longest, GRID)] if longest > shortest else []


def middle_hz(samples: FloatArray, rate_hz: float) -> float:
    """Below which half of the power lies."""
    power = np.abs(np.fft.rfft(samples - samples.mean())) ** 2
    line = int(np.searchsorted(np.cumsum(power), 0.5 * power.sum()))
    return max(line, 1) * rate_hz / len(samples)


FINER = 4
"""Points between samples, from which a line is drawn to any other time: alone it would be a low pass."""


def at_times(samples: FloatArray, at: FloatArray) -> FloatArray:
    """Samples (n,) at other times (n,), in samples; beyond the ends, as at the ends."""
    line = np.linspace(samples[0], samples[-1], len(samples))
    bent = samples - line
    whole = odd_extension(bent[:, None])[:, 0]
    fine = irfft(rfft(whole), FINER * len(whole))[: FINER * (len(samples) - 1) + 1] * FINER
    inside = np.clip(at, 0, len(samples) - 1)
    along = np.interp(inside, np.arange(len(line)), line)
    return np.asarray(np.interp(FINER * inside, np.arange(len(fine)), fine) + along)


def later(samples: FloatArray, by: float) -> FloatArray:
    """Samples (n, k) by samples, whole or not: line by line of the spectrum, which keeps each line's size."""
    line = end_to_end_line(samples)
    whole = odd_extension(samples - line)
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(len(whole)) * by)
    moved = irfft(rfft(whole, axis=0) * turn[:, None], len(whole), axis=0)[: len(samples)]
    slope = (samples[-1] - samples[0]) / max(len(samples) - 1, 1)
    return np.asarray(moved + line - slope * by)


def lagged(samples: FloatArray, constant: float) -> FloatArray:
    """A low pass of the first order; constant: in samples."""
    share = 1 - np.exp(-1 / constant)
    passed = np.empty((len(samples), 1))
    filter_one_pole((samples - samples[0])[:, None], 1 - share, passed)
    return np.asarray(samples[0] + passed[:, 0])
