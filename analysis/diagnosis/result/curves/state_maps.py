"""Maps of the missing force along each axis against position, velocity, command and time, and hysteresis loops.

From force balances, the missing force is the residual of mass, damping and stiffness (or of the given model); without
balances, that of the re-tuned model, from its evidence. Its sign is that of a force on the device. Where laws complete
the model, the residual with them is shown, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from analysis.diagnosis.document import Diagnosis
from analysis.diagnosis.result.curves.signature_bins import bin_means
from analysis.diagnosis.types import Mask
from equalizer.effects.placing import axis_letter
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from equalizer.signals.unit_system import system_of

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance
    from analysis.diagnosis.balance.motion import Motion
    from analysis.diagnosis.balance.regression import Regression


CLOUD = 600
"""Number of single samples that are drawn, about."""
LOOP_SAMPLES = 2000
"""Largest number of samples of a loop."""
LOOP_PERIODS = 1.1
"""Length of a loop in periods of the motion's strongest line, so that it closes."""
NAMED, NOT_CONFIRMED = "with the named effects", "with the best candidates, not confirmed"
"""Texts for the laws that complete the model."""


@dataclass(frozen=True, slots=True, eq=False)
class StateView:
    """The missing force against a state variable: single samples, and means per bin."""

    along: str
    """Name of the abscissa: "position"."""
    unit: str
    """Unit of the abscissa, SI."""
    cloud_at: FloatArray
    """Abscissa of the single samples."""
    cloud: FloatArray
    """Single samples of the missing force."""
    at: FloatArray
    """Mean abscissa per bin."""
    mean: FloatArray
    """Mean of the missing force per bin."""
    error: FloatArray
    """Standard error of the mean."""
    left: FloatArray
    """Mean residual of the completed model per bin; empty without one."""


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """Forces over a state variable for about one period of the motion, in the order of time."""

    along: str
    unit: str
    at: FloatArray
    measured: FloatArray
    """Applied or measured force."""
    before: FloatArray
    """Force that the model without new physics needs for this motion."""
    after: FloatArray
    """The same with the completed model; empty where there is none."""


@dataclass(frozen=True, slots=True, eq=False)
class StateMaps:
    """The missing force of one axis, as curves and loops."""

    axis: str
    unit: str
    """Unit of the force, SI."""
    model: str
    """The model that lacks the force, in words."""
    completed: str
    """Kind of the laws that complete the model: NAMED, NOT_CONFIRMED; empty = none."""
    share: float
    """Missing force over force, rms."""
    views: tuple[StateView, ...]
    loops: tuple[Loop, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _AxisSeries:
    """Samples (n,) of one axis, all parts in a row; SI."""

    rate_hz: float
    seconds: FloatArray
    position: FloatArray
    velocity: FloatArray
    force: FloatArray
    before: FloatArray
    after: FloatArray | None
    used: Mask
    parts: tuple[slice, ...]


def state_maps(
    diagnosis: Diagnosis, balances: "Sequence[Balance]", evidence: Sequence[Evidence], recording: Recording
) -> tuple[StateMaps, ...]:
    """Maps of all axes, in the order of drawing: the axis of the first named effect, then by missing force. From the
    force balances where there are any; else from the evidence of the re-tuned model."""
    channels = recording.command.channels
    letters = tuple(axis_letter(channel, channels) for channel in channels)
    units = recording.command.units
    length = system_of(units, recording.response.units).length
    found = []
    for axis, letter in enumerate(letters):
        if balances:
            series, completed = _series_of_balance(balances[axis], diagnosis, letter)
            given = balances[axis].search.regression.prior is not None
            model = "the re-tuned model" if given else "mass, damping and stiffness alone"
        else:
            series, completed, model = _series_of_evidence(evidence, axis), "", "the re-tuned model"
        if series is not None:
            labels = (letter, units[axis], model, completed)
            found.append(_maps(series, labels, length))
    first = diagnosis.effects[0].axis if diagnosis.effects else None
    return tuple(sorted(found, key=lambda each: (each.axis != first, -each.share)))


def _series_of_balance(balance: "Balance", diagnosis: Diagnosis, letter: str) -> tuple[_AxisSeries | None, str]:
    """The samples of one axis from its balance, None without any, and the text for the laws that complete the model:
    the named ones, else all that were chosen."""
    regression = balance.search.regression
    names = {effect.effect for effect in diagnosis.effects if effect.axis in (letter, None, "")}
    named = [law.place for law in balance.laws if law.played_as in names]
    laws = named or [law.place for law in balance.laws]
    linear, whole = (regression.remainder(regression.columns_of(each)) for each in ((), laws))
    axis = min(regression.axis, len(regression.motions[0].channels) - 1)
    motions = regression.motions
    series = _AxisSeries(
        motions[0].rate_hz / motions[0].step,
        _seconds(motions),
        np.concatenate([motion.position[:: motion.step, axis] for motion in motions]),
        np.concatenate([motion.velocity[:: motion.step, axis] for motion in motions]),
        np.concatenate(regression.force),
        np.concatenate(_forces_without_remainder(regression, linear)),
        np.concatenate(_forces_without_remainder(regression, whole)) if laws else None,
        np.concatenate([motion.valid_samples(motion.fit | motion.test) for motion in motions]),
        _slices([len(force) for force in regression.force]),
    )
    return (series if series.used.any() else None), (NAMED if named else NOT_CONFIRMED if laws else "")


def _forces_without_remainder(regression: "Regression", remainder: Sequence[FloatArray]) -> list[FloatArray]:
    """Force that the model needs for the motion: the measured force less the residual, per motion."""
    return [force - left for force, left in zip(regression.force, remainder, strict=True)]


def _seconds(motions: "Sequence[Motion]") -> FloatArray:
    """(n,): time of the decimated samples, as if the parts followed one another without a gap."""
    count = sum(len(motion.force[:: motion.step]) for motion in motions)
    return np.asarray(np.arange(count) * motions[0].step / motions[0].rate_hz)


def _slices(counts: Sequence[int]) -> tuple[slice, ...]:
    """Ranges of parts with these numbers of samples."""
    ends = np.cumsum([0, *counts]).tolist()
    return tuple(slice(begin, end) for begin, end in pairwise(ends))


def _series_of_evidence(evidence: Sequence[Evidence], axis: int) -> _AxisSeries | None:
    """The samples of one axis from the evidence; None where its motion is not known."""
    if not evidence or any(axis >= each.axis_force.shape[1] for each in evidence):
        return None
    position, velocity, force, missing = (
        np.concatenate([getattr(each, name)[:, axis] for each in evidence])
        for name in ("axis_position", "axis_velocity", "command", "axis_force")
    )
    known = np.isfinite(position) & np.isfinite(velocity) & np.isfinite(force) & np.isfinite(missing)
    used = known & np.concatenate([each.used > 0 for each in evidence])
    rate_hz = evidence[0].sample_rate_hz
    if not used.any() or not np.ptp(velocity[used]) > 0:
        return None
    seconds = np.arange(len(force)) / rate_hz
    parts = _slices([len(each.command) for each in evidence])
    return _AxisSeries(rate_hz, seconds, position, velocity, force, force + missing, None, used, parts)


def _maps(series: _AxisSeries, labels: tuple[str, str, str, str], length: str) -> StateMaps:
    """The maps of one axis. labels: axis, unit of the force, model, completed. length: unit of the position."""
    axis, unit, model, completed = labels
    # As the missing force on the device: friction then points against the motion.
    missing = series.before - series.force
    left = None if series.after is None else series.after - series.force
    views = tuple(
        _view(series, (along, its_unit), at, (missing, left))
        for along, its_unit, at in (
            ("position", length, series.position),
            ("velocity", f"{length}/s", series.velocity),
            ("command", unit, series.force),
            ("time", "s", series.seconds),
        )
    )
    signal = series.force[series.used] - series.force[series.used].mean()
    size = max(float(np.sqrt(np.mean(signal**2))), 1e-300)
    share = float(np.sqrt(np.mean(missing[series.used] ** 2))) / size
    return StateMaps(axis, unit, model, completed, share, views, _loops(series, length))


def _view(
    series: _AxisSeries, labels: tuple[str, str], at: FloatArray, missing: tuple[FloatArray, FloatArray | None]
) -> StateView:
    """The missing force over one variable. labels: its name and unit. missing: without and with completing laws."""
    before, after = missing
    places = np.flatnonzero(series.used)
    shown = places[:: max(len(places) // CLOUD, 1)]
    where, mean, error = bin_means(at, before, series.used, series.rate_hz)
    left = np.zeros(0) if after is None else bin_means(at, after, series.used, series.rate_hz)[1]
    return StateView(*labels, at[shown], before[shown], where, mean, error, left)


def _loops(series: _AxisSeries, length: str) -> tuple[Loop, ...]:
    """Loops over position and velocity."""
    part = _largest_period(series)
    after = np.zeros(0) if series.after is None else series.after[part]
    forces = series.force[part], series.before[part], after
    return tuple(
        Loop(along, unit, at[part], *forces)
        for along, unit, at in (("position", length, series.position), ("velocity", f"{length}/s", series.velocity))
    )


def _largest_period(series: _AxisSeries) -> slice:
    """About one period of the motion, where its travel is largest."""
    part = max(series.parts, key=lambda each: float(np.ptp(series.position[each])) if each.stop > each.start else 0.0)
    position = series.position[part]
    power = np.abs(np.fft.rfft(position - position.mean()))
    line = int(np.argmax(power[1:])) + 1 if len(power) > 1 else 1
    count = int(np.clip(LOOP_PERIODS * len(position) / line, min(40, len(position)), LOOP_SAMPLES))
    starts = range(0, max(len(position) - count, 0) + 1, max(count // 4, 1))
    best = max(starts, key=lambda begin: float(np.ptp(position[begin : begin + count])))
    return slice(part.start + best, part.start + min(best + count, len(position)))
