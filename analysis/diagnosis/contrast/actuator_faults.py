"""Faults of an actuator, each as the change of the recorded command that undoes it. Called by `rank_faults`;
`sensor_faults` uses its grids.

A recording holds the command u that was sent; a faulty actuator delivered a force g(u) instead. The faulty recording is
explained by the intact device where u is replaced by g(u): "undoing" a fault therefore means to put the delivered force
in the place of the command. The laws g at size 1 are as listed; other sizes s use u + s (g(u) - u):

    force_gain        2 u                            force_offset      u + std(u)
    force_gain_drift  u (1 + ramp to 1 at the end)   actuator_cubic    u + u^3 / max|u|^2
    transport_delay   u(t - T)                       amplifier_lag     u / (T s + 1)
    force_saturation  u clipped to +-limit           slew_limit        u with |du/dt| <= rate
    force_deadband    sgn(u) max(|u| - width, 0)

Grids and bounds of sizes are chosen by hand: they span the magnitudes at which a fault alters the command noticeably,
but does not suppress it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.contrast.fault import (
    ColumnChange,
    Fault,
    Lags,
    ParametersOf,
    Undo,
    Variant,
    fix_size,
    scale_parameter,
)
from analysis.diagnosis.contrast.interpolation import shift_samples
from analysis.diagnosis.contrast.recording_part import Part
from analysis.diagnosis.limits import LONGEST_DELAY_PERIODS
from equalizer.effects.simulation.sensor_path import filter_one_pole
from equalizer.effects.slew_limit import limit_slew
from equalizer.signals.signal import FloatArray

CommandChange = Callable[[FloatArray, float], FloatArray]
"""Maps one axis's command (n,), at a rate in Hz, to the force of the faulty actuator."""
SIZE_RANGE = (0.75, 1.35)
"""Range of sizes within which a change that is nonlinear in its size is scaled, before it is linearised about another
size."""
GAIN_SIZE_RANGE, LIMIT_SIZE_RANGE = (-0.9, 20.0), (0.6, 1.5)
"""Ranges of sizes of a gain, and of a saturation or slew limit."""
SATURATION_QUANTILES, SATURATION_SHARES = (0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98), (0.5, 0.6, 0.7, 0.8, 0.9)
"""Tried limits of a saturation: quantiles of the command's magnitude, and shares of the largest command."""
LARGEST_SATURATION_SHARE = 0.995
"""Share of the largest command from which a limit saturates too few samples to be tried."""
GRID_SIZE = 12
"""Number of sizes on a logarithmic grid; for delays, the least number."""
EARLIER_DRIFT_SHARES = (0.0, 0.25, 0.5)
"""Shares of a drift that are assumed to have occurred before the recording began."""


@dataclass(frozen=True, slots=True)
class _Axis:
    """A driven axis: its index among the commands, and its name."""

    index: int
    name: str

    def make_fault(self, effect: str, variants: Sequence[Variant]) -> Fault:
        """Make a fault of this axis's actuator with these variants."""
        return Fault(effect, "actuator", self.name, self.index, tuple(variants))

    def make_undo(self, compute_delivered: CommandChange) -> Undo:
        """Make the function that replaces this axis's command by the force that the faulty actuator delivered."""

        def undo(part: Part) -> Part:
            command = part.command.copy()
            command[:, self.index] = compute_delivered(command[:, self.index], part.rate_hz)
            return replace(part, command=command)

        return undo


def make_actuator_faults(
    axis_index: int, name: str, parts: Sequence[Part], by_force: bool, lags: Lags
) -> Iterator[Fault]:
    """Make all faults of the actuator of an axis. parts: all compared ones, whose range the grids span. by_force:
    whether the base predicts the command, not the response. lags: likely delays."""
    axis = _Axis(axis_index, name)
    commands = np.concatenate([part.command[:, axis_index] for part in parts])
    peak = float(np.abs(commands).max(initial=0.0)) or 1.0
    rms = float(np.std(commands)) or peak
    yield from _make_gain_faults(axis, by_force)
    yield axis.make_fault(
        "force_offset", [Variant((axis.make_undo(lambda u, rate: u + rms),), scale_parameter("offset", rms))]
    )
    cubic = Variant((axis.make_undo(lambda u, rate: u + u**3 / peak**2),), scale_parameter("cubic", 1 / peak**2))
    yield axis.make_fault("actuator_cubic", [cubic])
    longest_part = max(parts, key=lambda part: len(part.command))
    delays_s = choose_trial_delays_s(longest_part.command[:, axis_index], longest_part.rate_hz)
    yield axis.make_fault("transport_delay", [
        *(_make_delay(axis, time_s) for time_s in delays_s),
        *(replace(fix_size(_make_delay(axis, time_s), lags.step_s), column_change=None) for time_s in lags.delays_s),
    ])  # fmt: skip
    yield axis.make_fault("amplifier_lag", [_make_lag(axis, time_s) for time_s in delays_s])
    saturation_shares = (np.quantile(np.abs(commands), np.array(SATURATION_QUANTILES)) / peak).tolist()
    limits = sorted(
        peak * share for share in (*saturation_shares, *SATURATION_SHARES) if 0 < share < LARGEST_SATURATION_SHARE
    )
    yield axis.make_fault("force_saturation", [_make_saturation(axis, limit) for limit in limits])
    fastest_rate = max(
        float(np.abs(np.diff(part.command[:, axis_index])).max(initial=0.0)) * part.rate_hz for part in parts
    )
    if fastest_rate > 0:
        yield axis.make_fault(
            "slew_limit",
            [_make_slew_limit(axis, float(rate)) for rate in fastest_rate * np.geomspace(0.01, 0.9, GRID_SIZE)],
        )
    yield axis.make_fault(
        "force_deadband", [_make_deadband(axis, float(width)) for width in rms * np.geomspace(0.02, 1.5, GRID_SIZE)]
    )


def _make_gain_faults(axis: _Axis, by_force: bool) -> Iterator[Fault]:
    """Make the faults of the gain. Their size s scales what predicts the command in a force balance, so that the gain
    is 1 / (1 + s), and the delivered force elsewhere, so that it is 1 + s."""

    def compute_gain(size: float) -> float:
        """Compute the gain of the faulty actuator."""
        return 1 / (1 + size) if by_force else 1 + size

    yield axis.make_fault("force_gain", [
        Variant((axis.make_undo(lambda u, rate: 2 * u),), lambda s: {"gain": compute_gain(float(s[0]))},
                *GAIN_SIZE_RANGE, column_change=lambda x, rate, part: 2 * x),
    ])  # fmt: skip
    drifts = [
        _make_gain_drift(axis, earlier_share, lambda s: {"change": compute_gain(float(s[0])) - 1})
        for earlier_share in EARLIER_DRIFT_SHARES
    ]
    yield replace(axis.make_fault("force_gain_drift", drifts), varies=True, simpler=("force_gain",))


def _make_gain_drift(axis: _Axis, earlier_share: float, parameters_of: ParametersOf) -> Variant:
    """Make the variant of a gain that drifts linearly. earlier_share: share of the drift before the file began.
    parameters_of: maps the size to the parameter of the effect."""

    def compute_gain_ramp(part: Part, count: int) -> FloatArray:
        """Compute (count, 1): the gain at `count` evenly spaced times of a part, as rows may be decimated."""
        gain = 1 + compute_drift_shape(part, earlier_share)
        return np.interp(np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, len(gain)), gain)[:, None]

    def undo(part: Part) -> Part:
        command = part.command.copy()
        command[:, [axis.index]] *= compute_gain_ramp(part, len(command))
        return replace(part, command=command)

    return Variant(
        (undo,),
        parameters_of,
        *GAIN_SIZE_RANGE,
        column_change=lambda x, rate, part: x * compute_gain_ramp(part, len(x)),
    )


def compute_drift_shape(part: Part, earlier_share: float) -> FloatArray:
    """Compute (n,): a linear drift to 1 at the end of the file, of which `earlier_share` occurred before its
    beginning."""
    return np.asarray(earlier_share + (1 - earlier_share) * part.elapsed_share)


def _make_delay(axis: _Axis, time_s: float) -> Variant:
    """Make the variant of a transport delay by `time_s`: samples before it are not known any more."""
    # The command at t acts on the motion at t + T.
    change: ColumnChange = lambda x, rate, part: shift_samples(x, -time_s * rate)  # noqa: E731

    def undo(part: Part) -> Part:
        delay_samples = time_s * part.rate_hz
        undone = axis.make_undo(lambda u, rate: shift_samples(u[:, None], delay_samples)[:, 0])(part)
        return replace(undone, known=part.known & (np.arange(len(part.known)) >= delay_samples))

    at_size = lambda size: _make_delay(axis, size * time_s)  # noqa: E731
    delay = scale_parameter("delay", time_s)
    return Variant((undo,), delay, *SIZE_RANGE, column_change=change, at_size=at_size, one_size=True)


def _make_lag(axis: _Axis, time_s: float) -> Variant:
    """Make the variant of a first-order lag of the amplifier with the time constant `time_s`."""
    # The command is (1 + T s) times the delivered force.
    undo = axis.make_undo(lambda u, rate: apply_lag(u, time_s * rate))
    change: ColumnChange = lambda x, rate, part: x + time_s * rate * np.gradient(x, axis=0)  # noqa: E731
    at_size = lambda size: _make_lag(axis, size * time_s)  # noqa: E731
    return Variant(
        (undo,), scale_parameter("time_constant", time_s), *SIZE_RANGE, column_change=change, at_size=at_size
    )


def _make_saturation(axis: _Axis, limit: float) -> Variant:
    """Make the variant of a saturation at +-limit, in the command's unit."""
    undo = axis.make_undo(lambda u, rate: np.clip(u, -limit, limit))
    return Variant((undo,), lambda s: {"limit": limit}, *LIMIT_SIZE_RANGE)


def _make_slew_limit(axis: _Axis, limit: float) -> Variant:
    """Make the variant of a slew-rate limit, in the command's unit per second."""
    undo = axis.make_undo(lambda u, rate: limit_slew(u, 1 / rate, limit, float(u[0]), at_end=True))
    return Variant((undo,), lambda s: {"rate": limit}, *LIMIT_SIZE_RANGE)


def _make_deadband(axis: _Axis, width: float) -> Variant:
    """Make the variant of a dead band from -width to width, in the command's unit."""
    undo = axis.make_undo(lambda u, rate: np.sign(u) * np.maximum(np.abs(u) - width, 0.0))
    at_size = lambda size: _make_deadband(axis, size * width)  # noqa: E731
    return Variant((undo,), scale_parameter("width", width), *SIZE_RANGE, at_size=at_size)


def choose_trial_delays_s(samples: FloatArray, rate_hz: float) -> list[float]:
    """Choose delays in s on a logarithmic grid, from a tenth of a sample to `LONGEST_DELAY_PERIODS` periods of the
    median frequency of the samples (n,); empty where that range is empty."""
    shortest_s, longest_s = 0.1 / rate_hz, LONGEST_DELAY_PERIODS / compute_median_frequency_hz(samples, rate_hz)
    if longest_s <= shortest_s:
        return []
    # As many as needed for the ranges `SIZE_RANGE` of neighbouring delays to overlap.
    count = int(np.ceil(np.log(longest_s / shortest_s) / np.log(SIZE_RANGE[1] / SIZE_RANGE[0]))) + 1
    return [float(time_s) for time_s in np.geomspace(shortest_s, longest_s, max(count, GRID_SIZE))]


def compute_median_frequency_hz(samples: FloatArray, rate_hz: float) -> float:
    """Compute the frequency in Hz below which half of the power of samples (n,) about their mean lies; at least that of
    the first spectral line."""
    power = np.abs(np.fft.rfft(samples - samples.mean())) ** 2
    line = int(np.searchsorted(np.cumsum(power), 0.5 * power.sum()))
    return max(line, 1) * rate_hz / len(samples)


def apply_lag(samples: FloatArray, time_constant_samples: float) -> FloatArray:
    """Filter samples (n,) by a first-order low pass, from the steady state of the first sample. time_constant_samples:
    above 0."""
    low_passed = np.empty((len(samples), 1))
    filter_one_pole((samples - samples[0])[:, None], float(np.exp(-1 / time_constant_samples)), low_passed)
    return np.asarray(samples[0] + low_passed[:, 0])
