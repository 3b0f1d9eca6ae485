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
from analysis.diagnosis.result.curves.signature_bins import compute_bin_means
from analysis.diagnosis.types import Mask
from equalizer.effects.placing import shorten_axis_name
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from equalizer.signals.unit_system import determine_unit_system

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance
    from analysis.diagnosis.balance.motion import Motion
    from analysis.diagnosis.balance.regression import Regression


SCATTER_SAMPLES = 600
"""Approximate number of single samples that are drawn."""
LOOP_SAMPLES = 2000
"""Largest number of samples of a loop."""
LOOP_PERIODS = 1.1
"""Length of a loop in periods of the motion's strongest line, so that it closes."""
WITH_NAMED, WITH_CANDIDATES = "with the named effects", "with the best candidates, not confirmed"
"""Texts for the laws that complete the model."""


@dataclass(frozen=True, slots=True, eq=False)
class StateView:
    """The missing force against a state variable: single samples, and means per bin."""

    abscissa_name: str
    """Name of the abscissa: "position"."""
    unit: str
    """Unit of the abscissa, SI."""
    sample_abscissa: FloatArray
    """(samples,): abscissa of the single samples."""
    sample_force: FloatArray
    """(samples,): single samples of the missing force."""
    bin_abscissa: FloatArray
    """(bins,): mean abscissa."""
    mean: FloatArray
    """(bins,): mean of the missing force."""
    error: FloatArray
    """(bins,): standard error of the mean."""
    mean_residual: FloatArray
    """(bins,): mean residual of the completed model; empty without one."""


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """Forces (n,) over a state variable for about one period of the motion, in the order of time."""

    abscissa_name: str
    unit: str
    abscissa: FloatArray
    measured: FloatArray
    """Applied or measured force."""
    model_force: FloatArray
    """Force that the model without new physics needs for this motion."""
    completed_force: FloatArray
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
    """Kind of the laws that complete the model: WITH_NAMED, WITH_CANDIDATES; empty = none."""
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
    model_force: FloatArray
    completed_force: FloatArray | None
    used: Mask
    parts: tuple[slice, ...]


def compute_state_maps(
    diagnosis: Diagnosis, balances: "Sequence[Balance]", evidence: Sequence[Evidence], recording: Recording
) -> tuple[StateMaps, ...]:
    """Maps of all axes, in the order of drawing: the axis of the first named effect, then by missing force. From the
    force balances where there are any; else from the evidence of the re-tuned model."""
    channels = recording.command.channels
    letters = tuple(shorten_axis_name(channel, channels) for channel in channels)
    units = recording.command.units
    length_unit = determine_unit_system(units, recording.response.units).length
    maps = []
    for axis, letter in enumerate(letters):
        if balances:
            series, completed = _extract_balance_series(balances[axis], diagnosis, letter)
            has_prior = balances[axis].search.regression.prior is not None
            model = "the re-tuned model" if has_prior else "mass, damping and stiffness alone"
        else:
            series, completed, model = _extract_evidence_series(evidence, axis), "", "the re-tuned model"
        if series is not None:
            labels = (letter, units[axis], model, completed)
            maps.append(_make_maps(series, labels, length_unit))
    first_axis = diagnosis.effects[0].axis if diagnosis.effects else None
    return tuple(sorted(maps, key=lambda axis_map: (axis_map.axis != first_axis, -axis_map.share)))


def _extract_balance_series(balance: "Balance", diagnosis: Diagnosis, letter: str) -> tuple[_AxisSeries | None, str]:
    """The samples of one axis from its balance, None without any, and the text for the laws that complete the model:
    the named ones, else all that were chosen."""
    regression = balance.search.regression
    names = {effect.effect for effect in diagnosis.effects if effect.axis in (letter, None, "")}
    named_laws = [law.law_index for law in balance.laws if law.simulated_as in names]
    laws = named_laws or [law.law_index for law in balance.laws]
    linear, completed = (regression.compute_residuals(regression.select_columns(law_set)) for law_set in ((), laws))
    axis = min(regression.axis, len(regression.motions[0].channels) - 1)
    motions = regression.motions
    series = _AxisSeries(
        motions[0].rate_hz / motions[0].step,
        _compute_times_s(motions),
        np.concatenate([motion.position[:: motion.step, axis] for motion in motions]),
        np.concatenate([motion.velocity[:: motion.step, axis] for motion in motions]),
        np.concatenate(regression.force),
        np.concatenate(_subtract_remainder(regression, linear)),
        np.concatenate(_subtract_remainder(regression, completed)) if laws else None,
        np.concatenate([motion.mask_valid_samples(motion.fit | motion.test) for motion in motions]),
        _make_slices([len(force) for force in regression.force]),
    )
    return (series if series.used.any() else None), (WITH_NAMED if named_laws else WITH_CANDIDATES if laws else "")


def _subtract_remainder(regression: "Regression", remainder: Sequence[FloatArray]) -> list[FloatArray]:
    """Force that the model needs for the motion: the measured force less the residual, per motion."""
    return [force - residual for force, residual in zip(regression.force, remainder, strict=True)]


def _compute_times_s(motions: "Sequence[Motion]") -> FloatArray:
    """(n,): time of the decimated samples, as if the parts followed one another without a gap."""
    count = sum(len(motion.force[:: motion.step]) for motion in motions)
    return np.asarray(np.arange(count) * motions[0].step / motions[0].rate_hz)


def _make_slices(counts: Sequence[int]) -> tuple[slice, ...]:
    """Ranges of parts with these numbers of samples."""
    ends = np.cumsum([0, *counts]).tolist()
    return tuple(slice(start, end) for start, end in pairwise(ends))


def _extract_evidence_series(evidence: Sequence[Evidence], axis: int) -> _AxisSeries | None:
    """The samples of one axis from the evidence; None where its motion is not known."""
    if not evidence or any(axis >= record.axis_force.shape[1] for record in evidence):
        return None
    position, velocity, force, missing_force = (
        np.concatenate([getattr(record, name)[:, axis] for record in evidence])
        for name in ("axis_position", "axis_velocity", "command", "axis_force")
    )
    is_finite = np.isfinite(position) & np.isfinite(velocity) & np.isfinite(force) & np.isfinite(missing_force)
    used = is_finite & np.concatenate([record.used > 0 for record in evidence])
    rate_hz = evidence[0].sample_rate_hz
    if not used.any() or not np.ptp(velocity[used]) > 0:
        return None
    seconds = np.arange(len(force)) / rate_hz
    parts = _make_slices([len(record.command) for record in evidence])
    return _AxisSeries(rate_hz, seconds, position, velocity, force, force + missing_force, None, used, parts)


def _make_maps(series: _AxisSeries, labels: tuple[str, str, str, str], length_unit: str) -> StateMaps:
    """The maps of one axis. labels: axis, unit of the force, model, completed. length_unit: of the position."""
    axis, unit, model, completed = labels
    # As the missing force on the device: friction then points against the motion.
    missing_force = series.model_force - series.force
    residual = None if series.completed_force is None else series.completed_force - series.force
    views = tuple(
        _make_view(series, (abscissa, abscissa_unit), values, (missing_force, residual))
        for abscissa, abscissa_unit, values in (
            ("position", length_unit, series.position),
            ("velocity", f"{length_unit}/s", series.velocity),
            ("command", unit, series.force),
            ("time", "s", series.seconds),
        )
    )
    force_deviation = series.force[series.used] - series.force[series.used].mean()
    force_rms = max(float(np.sqrt(np.mean(force_deviation**2))), 1e-300)
    share = float(np.sqrt(np.mean(missing_force[series.used] ** 2))) / force_rms
    return StateMaps(axis, unit, model, completed, share, views, _make_loops(series, length_unit))


def _make_view(
    series: _AxisSeries, labels: tuple[str, str], abscissa: FloatArray, missing: tuple[FloatArray, FloatArray | None]
) -> StateView:
    """The missing force over one variable. labels: its name and unit. missing: without and with completing laws."""
    missing_force, residual = missing
    used_samples = np.flatnonzero(series.used)
    drawn_samples = used_samples[:: max(len(used_samples) // SCATTER_SAMPLES, 1)]
    bin_centres, mean, error = compute_bin_means(abscissa, missing_force, series.used, series.rate_hz)
    bin_residuals = (
        np.zeros(0) if residual is None else compute_bin_means(abscissa, residual, series.used, series.rate_hz)[1]
    )
    return StateView(
        *labels, abscissa[drawn_samples], missing_force[drawn_samples], bin_centres, mean, error, bin_residuals
    )


def _make_loops(series: _AxisSeries, length_unit: str) -> tuple[Loop, ...]:
    """Loops over position and velocity."""
    part = _find_largest_period(series)
    completed_force = np.zeros(0) if series.completed_force is None else series.completed_force[part]
    forces = series.force[part], series.model_force[part], completed_force
    return tuple(
        Loop(abscissa, unit, values[part], *forces)
        for abscissa, unit, values in (
            ("position", length_unit, series.position),
            ("velocity", f"{length_unit}/s", series.velocity),
        )
    )


def _find_largest_period(series: _AxisSeries) -> slice:
    """About one period of the motion, where its travel is largest."""
    part = max(
        series.parts,
        key=lambda samples: float(np.ptp(series.position[samples])) if samples.stop > samples.start else 0.0,
    )
    position = series.position[part]
    power = np.abs(np.fft.rfft(position - position.mean()))
    strongest_line = int(np.argmax(power[1:])) + 1 if len(power) > 1 else 1
    count = int(np.clip(LOOP_PERIODS * len(position) / strongest_line, min(40, len(position)), LOOP_SAMPLES))
    starts = range(0, max(len(position) - count, 0) + 1, max(count // 4, 1))
    best_start = max(starts, key=lambda start: float(np.ptp(position[start : start + count])))
    return slice(part.start + best_start, part.start + min(best_start + count, len(position)))
