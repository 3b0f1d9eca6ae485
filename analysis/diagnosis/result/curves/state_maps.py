"""Compute maps of the missing force along each axis against position, velocity, command and time, and hysteresis loops.

With force balances, the missing force is the residual of mass, damping and stiffness, or, where a model was given, of
the re-tuned model; without balances, that of the re-tuned model, from its evidence. Its sign is that of a force on the
device. Where laws complete the model, the residual with them is computed, too.
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
"""Least number of single samples that are drawn, where there are as many; up to twice as many are drawn. Chosen."""
LOOP_SAMPLES = 2000
"""Largest number of samples of a loop. Chosen."""
LOOP_PERIODS = 1.1
"""Length of a loop in periods of the motion's strongest line. Chosen above 1, for a closed loop."""
WITH_NAMED, WITH_CANDIDATES = "with the named effects", "with the best candidates, not confirmed"
"""Texts for the laws that complete the model."""


@dataclass(frozen=True, slots=True, eq=False)
class StateView:
    """The missing force against a state variable: single samples, and means per bin."""

    abscissa_name: str
    """Name of the abscissa, such as "position"."""
    unit: str
    """Unit of the abscissa."""
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
    """Unit of the force: that of the command."""
    model: str
    """The model that lacks the force, in words."""
    completed: str
    """Kind of the laws that complete the model: WITH_NAMED, WITH_CANDIDATES; empty = none."""
    share: float
    """Missing force, rms, over the standard deviation of the force."""
    views: tuple[StateView, ...]
    loops: tuple[Loop, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _AxisSeries:
    """Samples (n,) of one axis, all parts one after another, in the units of the recording."""

    rate_hz: float
    time_s: FloatArray
    position: FloatArray
    velocity: FloatArray
    force: FloatArray
    model_force: FloatArray
    completed_force: FloatArray | None
    is_used: Mask
    parts: tuple[slice, ...]


def compute_state_maps(
    diagnosis: Diagnosis, balances: "Sequence[Balance]", evidence: Sequence[Evidence], recording: Recording
) -> tuple[StateMaps, ...]:
    """Compute the maps of all axes, in the order of drawing: the axis of the first named effect, then by the share of
    the missing force. From the force balances where there are any; else from the evidence of the re-tuned model. Axes
    without usable samples are left out."""
    channels = recording.command.channels
    axis_letters = tuple(shorten_axis_name(channel, channels) for channel in channels)
    units = recording.command.units
    length_unit = determine_unit_system(units, recording.response.units).length
    maps = []
    for axis, letter in enumerate(axis_letters):
        if balances:
            series, completion = _extract_balance_series(balances[axis], diagnosis, letter)
            has_prior = balances[axis].search.regression.prior is not None
            model_text = "the re-tuned model" if has_prior else "mass, damping and stiffness alone"
        else:
            series, completion, model_text = _extract_evidence_series(evidence, axis), "", "the re-tuned model"
        if series is not None:
            labels = (letter, units[axis], model_text, completion)
            maps.append(_make_maps(series, labels, length_unit))
    first_axis = diagnosis.effects[0].axis if diagnosis.effects else None
    return tuple(sorted(maps, key=lambda axis_map: (axis_map.axis != first_axis, -axis_map.share)))


def _extract_balance_series(balance: "Balance", diagnosis: Diagnosis, letter: str) -> tuple[_AxisSeries | None, str]:
    """Extract the samples of one axis from its balance, None without usable ones, and the text for the laws that
    complete the model: the named ones, else all that the balance contains."""
    regression = balance.search.regression
    named_effects = {effect.effect for effect in diagnosis.effects if effect.axis in (letter, None, "")}
    named_indices = [law.law_index for law in balance.laws if law.simulated_as in named_effects]
    law_indices = named_indices or [law.law_index for law in balance.laws]
    linear_residuals, completed_residuals = (
        regression.compute_residuals(regression.select_columns(indices)) for indices in ((), law_indices)
    )
    axis = min(regression.axis, len(regression.motions[0].channels) - 1)
    motions = regression.motions
    series = _AxisSeries(
        motions[0].rate_hz / motions[0].step,
        _compute_times_s(motions),
        np.concatenate([motion.position[:: motion.step, axis] for motion in motions]),
        np.concatenate([motion.velocity[:: motion.step, axis] for motion in motions]),
        np.concatenate(regression.force),
        np.concatenate(_compute_model_forces(regression, linear_residuals)),
        np.concatenate(_compute_model_forces(regression, completed_residuals)) if law_indices else None,
        np.concatenate([motion.mask_valid_samples(motion.fit | motion.test) for motion in motions]),
        _make_slices([len(force) for force in regression.force]),
    )
    return (series if series.is_used.any() else None), (
        WITH_NAMED if named_indices else WITH_CANDIDATES if law_indices else ""
    )


def _compute_model_forces(regression: "Regression", residuals: Sequence[FloatArray]) -> list[FloatArray]:
    """Compute the force that the model requires for the motion: the measured force less the residual, per motion."""
    return [force - residual for force, residual in zip(regression.force, residuals, strict=True)]


def _compute_times_s(motions: "Sequence[Motion]") -> FloatArray:
    """Compute (n,): time of the decimated samples, as if the parts followed one another without a gap."""
    sample_count = sum(len(motion.force[:: motion.step]) for motion in motions)
    return np.asarray(np.arange(sample_count) * motions[0].step / motions[0].rate_hz)


def _make_slices(sample_counts: Sequence[int]) -> tuple[slice, ...]:
    """Make the index ranges of parts with these numbers of samples, one after another."""
    ends = np.cumsum([0, *sample_counts]).tolist()
    return tuple(slice(start, end) for start, end in pairwise(ends))


def _extract_evidence_series(evidence: Sequence[Evidence], axis: int) -> _AxisSeries | None:
    """Extract the samples of one axis from the evidence; None where its motion is not known, no sample is
    usable, or its velocity is constant."""
    if not evidence or any(axis >= record.axis_force.shape[1] for record in evidence):
        return None
    position, velocity, force, missing_force = (
        np.concatenate([getattr(record, name)[:, axis] for record in evidence])
        for name in ("axis_position", "axis_velocity", "command", "axis_force")
    )
    is_finite = np.isfinite(position) & np.isfinite(velocity) & np.isfinite(force) & np.isfinite(missing_force)
    is_used = is_finite & np.concatenate([record.used > 0 for record in evidence])
    rate_hz = evidence[0].sample_rate_hz
    if not is_used.any() or not np.ptp(velocity[is_used]) > 0:
        return None
    time_s = np.arange(len(force)) / rate_hz
    parts = _make_slices([len(record.command) for record in evidence])
    return _AxisSeries(rate_hz, time_s, position, velocity, force, force + missing_force, None, is_used, parts)


def _make_maps(series: _AxisSeries, labels: tuple[str, str, str, str], length_unit: str) -> StateMaps:
    """Make the maps of one axis. labels: axis, unit of the force, model, completed. length_unit: of the position."""
    axis, unit, model, completed = labels
    # The sign is that of a force on the device, so that friction is opposite to the motion.
    missing_force = series.model_force - series.force
    residual = None if series.completed_force is None else series.completed_force - series.force
    views = tuple(
        _make_view(series, (abscissa, abscissa_unit), values, (missing_force, residual))
        for abscissa, abscissa_unit, values in (
            ("position", length_unit, series.position),
            ("velocity", f"{length_unit}/s", series.velocity),
            ("command", unit, series.force),
            ("time", "s", series.time_s),
        )
    )
    force_deviation = series.force[series.is_used] - series.force[series.is_used].mean()
    force_rms = max(float(np.sqrt(np.mean(force_deviation**2))), 1e-300)
    share = float(np.sqrt(np.mean(missing_force[series.is_used] ** 2))) / force_rms
    return StateMaps(axis, unit, model, completed, share, views, _make_loops(series, length_unit))


def _make_view(
    series: _AxisSeries,
    labels: tuple[str, str],
    abscissa: FloatArray,
    force_and_residual: tuple[FloatArray, FloatArray | None],
) -> StateView:
    """Make the view of the missing force over one variable. labels: its name and unit. force_and_residual: the missing
    force, and the residual with the laws that complete the model; None without such laws."""
    missing_force, residual = force_and_residual
    used_samples = np.flatnonzero(series.is_used)
    drawn_samples = used_samples[:: max(len(used_samples) // SCATTER_SAMPLES, 1)]
    bin_centres, mean, error = compute_bin_means(abscissa, missing_force, series.is_used, series.rate_hz)
    bin_residuals = (
        np.zeros(0) if residual is None else compute_bin_means(abscissa, residual, series.is_used, series.rate_hz)[1]
    )
    return StateView(
        *labels, abscissa[drawn_samples], missing_force[drawn_samples], bin_centres, mean, error, bin_residuals
    )


def _make_loops(series: _AxisSeries, length_unit: str) -> tuple[Loop, ...]:
    """Make the loops over position and velocity."""
    period = _find_largest_period(series)
    completed_force = np.zeros(0) if series.completed_force is None else series.completed_force[period]
    forces = series.force[period], series.model_force[period], completed_force
    return tuple(
        Loop(abscissa, unit, values[period], *forces)
        for abscissa, unit, values in (
            ("position", length_unit, series.position),
            ("velocity", f"{length_unit}/s", series.velocity),
        )
    )


def _find_largest_period(series: _AxisSeries) -> slice:
    """Find about one period of the motion where its travel is largest, at least 40 samples (chosen) where the part has
    as many; starts a quarter of that length apart are tried."""
    widest_part = max(
        series.parts,
        key=lambda samples: float(np.ptp(series.position[samples])) if samples.stop > samples.start else 0.0,
    )
    position = series.position[widest_part]
    power = np.abs(np.fft.rfft(position - position.mean()))
    strongest_line = int(np.argmax(power[1:])) + 1 if len(power) > 1 else 1
    period_samples = int(np.clip(LOOP_PERIODS * len(position) / strongest_line, min(40, len(position)), LOOP_SAMPLES))
    starts = range(0, max(len(position) - period_samples, 0) + 1, max(period_samples // 4, 1))
    best_start = max(starts, key=lambda start: float(np.ptp(position[start : start + period_samples])))
    return slice(widest_part.start + best_start, widest_part.start + min(best_start + period_samples, len(position)))
