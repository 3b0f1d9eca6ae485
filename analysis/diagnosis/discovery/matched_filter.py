"""Matched filter of a fit's residuals for a force along one axis, and what re-tuning the model explains of its output.

For each spectral line, with the residuals r of all channels and their frequency response h to a force along the axis,

    y = h* r / |h|        a force f along the axis gives y = |h| f

so that only the part of r that such a force can cause is kept, white noise stays white, and inner products of filtered
forces equal those of the simulated responses h f. A candidate force then costs two Fourier transforms instead of a
simulation. Where forces are compared, h is minus the gain of the band's low pass; what is added to a reading is limited
to the band of the commands and not filtered otherwise. Called by `discover`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.discovery.evaluate_shape import name_signals
from analysis.diagnosis.discovery.grammar import AXES, Columns
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.output_error import DIFFERENCE_STEP, Fitted
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.forces.missing_force import compute_axis_transfer
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.limits import LAW_BLOCKS, LAW_POWER_KEPT, SETTLED_CONSTANTS
from equalizer.effects.starts.evidence import Evidence
from equalizer.laws.law import ActsOn
from equalizer.plant.linear_simulation import discretise_model
from equalizer.plant.mechanical_model import MechanicalModelError
from equalizer.signals.band_limited import compute_low_pass_gain
from equalizer.signals.signal import ComplexArray, FloatArray

_SETTLING_S = 2.0
"""Length (s) of the zeros appended to a record, against wrap-around of the response at its end. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class FilteredRecord:
    """Filters of one record with n samples, c channels and m driven axes. Its k + p outputs are the matched filters for
    forces along the first k axes, which have a letter in `AXES`, then p readings limited to the band."""

    columns: Columns
    """Signals by their names in a formula, (n,) each."""
    axis_motion: tuple[FloatArray, FloatArray]
    """(n, m) each: positions, m, and velocities, m/s, of all axes, with or without a letter."""
    missing_force: FloatArray
    """(n, m), N: the force that the model lacks."""
    rate_hz: float
    length: int
    """Length of the transforms, samples."""
    force_response: ComplexArray
    """(lines, c, m), 1/N: response h from a force to the residuals, up to the last line with command power."""
    strength: FloatArray
    """(lines, k), 1/N: norm of that response over the channels, |h|; at least 1e-9 of the axis's largest, so not 0."""
    reading_units: FloatArray
    """(p,): units of the residuals of the response channels; none where forces are compared."""
    block_slices: tuple[slice, ...]
    """Blocks of the cross-validation, as ranges of decimated samples."""

    def filter_residuals(self, residuals: FloatArray) -> FloatArray:
        """Compute (kept samples, k + p): output of each filter for residuals (n, c), decimated."""
        return self._filter_spectrum(rfft(residuals, self.length, axis=0)[: len(self.force_response)])

    def _filter_spectrum(self, spectrum: ComplexArray) -> FloatArray:
        """Compute (kept samples, k + p): output of each filter. spectrum: (lines, c), of residuals."""
        response = self.force_response[:, :, : self.strength.shape[1]]
        force_outputs = np.einsum("lcm,lc->lm", np.conj(response), spectrum) / self.strength
        return self._select_blocks(np.hstack([force_outputs, spectrum[:, : len(self.reading_units)]]))

    def filter_forces(self, forces: FloatArray) -> FloatArray:
        """Compute (kept samples, k + p): outputs for the residuals that forces (n, m), N, cause together."""
        spectrum = rfft(_average_over_steps(forces), self.length, axis=0)[: len(self.force_response)]
        return self._filter_spectrum(np.einsum("lcm,lm->lc", self.force_response, spectrum))

    def compute_column(self, signal: FloatArray, output: int) -> FloatArray:
        """Compute (kept samples,): output of one filter. signal: (n,), a force along its axis, N, or change of its
        reading."""
        lines, axes = self.strength.shape
        if output >= axes:
            spectrum = rfft(signal, self.length)[:lines] / self.reading_units[output - axes]
        else:
            spectrum = rfft(_average_over_steps(signal), self.length)[:lines] * self.strength[:, output]
        return self._select_blocks(spectrum[:, None])[:, 0]

    def _select_blocks(self, spectrum: ComplexArray) -> FloatArray:
        """Compute (kept samples, outputs): time series of a spectrum (lines, outputs), decimated to its band, in the
        blocks only. Sums of squares are those at the full rate."""
        sample_count = 2 * (len(spectrum) - 1)
        filtered = irfft(spectrum, sample_count, axis=0) * np.sqrt(sample_count / self.length)
        return np.concatenate([filtered[block] for block in self.block_slices])


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The filtered residual of one output, and the columns of a regression on the model's own parameters."""

    output: int
    """Index of the filter: see `FilteredRecord`."""
    acts_on: ActsOn
    """"force": its terms are forces; "response": they are added to a reading."""
    axis: int
    """Index of the driven axis, or of the response's channel."""
    records: tuple[FilteredRecord, ...]
    residual: FloatArray
    """(s,), over all records and blocks."""
    parameter_columns: FloatArray
    """(t + 1, s): change of the residual by one standard deviation of each of the model's t parameters, then by a
    constant force or reading of 1."""
    to_calibration: FloatArray
    """(t + 1,): the calibration's values of these parameters less the fitted ones, in standard deviations."""
    edges: tuple[int, ...]
    """Edges of the blocks in the s samples, (blocks + 1)."""
    noise: float
    """Mean square of the noise in a filtered sample."""


def _average_over_steps(forces: FloatArray) -> FloatArray:
    """Average forces (n, ...) over each step, because the model's commands are held over a step."""
    return np.concatenate([0.5 * (forces[1:] + forces[:-1]), forces[-1:]])


def build_views(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted) -> tuple[View, ...]:
    """Build one view per driven axis, then one per response channel (three of each at most: names of the grammar)."""
    model, placed_effects = tuning.tune(fitted.deviations), fitted.hypothesis.list_placed_effects()
    evidence = measure.evidence(model, placed_effects, fitted.residuals)
    filtered_records = tuple(
        _filter_record(measure, record, record_evidence)
        for record, record_evidence in zip(measure.records, evidence, strict=True)
    )
    residual = np.concatenate(
        [
            filtered.filter_residuals(_set_missing_to_zero(record_residuals))
            for filtered, record_residuals in zip(filtered_records, fitted.residuals, strict=True)
        ]
    )
    changes = np.array(
        [
            _compute_parameter_columns(measure, tuning, fitted, filtered_records, index)
            for index in range(len(fitted.deviations))
        ]
    )
    edges, axis_count = _compute_block_edges(filtered_records), filtered_records[0].strength.shape[1]
    to_calibration = np.append(-fitted.deviations, 0.0)
    views = []
    for output in range(min(residual.shape[1], axis_count + len(AXES))):
        acts_on: ActsOn = "force" if output < axis_count else "response"
        axis = output if output < axis_count else output - axis_count
        constant = np.concatenate(
            [filtered.compute_column(np.ones(len(filtered.missing_force)), output) for filtered in filtered_records]
        )
        columns = np.vstack([changes[:, :, output].reshape(-1, len(residual)), constant])
        noise = (
            _compute_noise(measure, filtered_records, axis)
            if acts_on == "force"
            else float((measure.noise / measure.unit)[axis] ** 2)
        )
        views.append(
            View(output, acts_on, axis, filtered_records, residual[:, output], columns, to_calibration, edges, noise)
        )
    return tuple(views)


def _set_missing_to_zero(residuals: FloatArray) -> FloatArray:
    """Replace missing residuals (NaN or infinite) by 0."""
    return np.where(np.isfinite(residuals), residuals, 0.0)


def _compute_parameter_columns(
    measure: ErrorMeasure, tuning: Tuning, fitted: Fitted, filtered_records: Sequence[FilteredRecord], index: int
) -> FloatArray:
    """Compute (s, k + p): change of all outputs by one standard deviation of one of the model's parameters, by its
    index. For mass, damping and stiffness it is that of their force along the measured motion, exact even for a wrong
    model; for modes, a finite difference of simulations without the hypothesis; 0 where no such model is valid."""
    m = tuning.model.inputs
    axis_pairs = [(i, j) for i in range(m) for j in range(i, m)]
    if index < 3 * len(axis_pairs):
        return np.concatenate(
            [
                filtered.filter_forces(_compute_parameter_force(filtered, tuning, axis_pairs, index))
                for filtered in filtered_records
            ]
        )
    base_residuals = measure.residuals(tuning.tune(fitted.deviations), ())
    for step in (DIFFERENCE_STEP, -DIFFERENCE_STEP):
        shifted_deviations = fitted.deviations.copy()
        shifted_deviations[index] += step
        try:
            shifted_residuals = measure.residuals(tuning.tune(shifted_deviations), ())
        except (MechanicalModelError, np.linalg.LinAlgError):
            continue
        output_changes = [
            filtered.filter_residuals(_set_missing_to_zero((base_record - shifted_record) / step))
            for filtered, base_record, shifted_record in zip(
                filtered_records, base_residuals, shifted_residuals, strict=True
            )
        ]
        return np.concatenate(output_changes)
    output_count = filtered_records[0].strength.shape[1] + len(filtered_records[0].reading_units)
    return np.zeros((_compute_block_edges(filtered_records)[-1], output_count))


def _compute_parameter_force(
    record: FilteredRecord, tuning: Tuning, axis_pairs: Sequence[tuple[int, int]], parameter_index: int
) -> FloatArray:
    """Compute (n, m), N: external force equivalent to one standard deviation of a mass, damping or stiffness entry."""
    order, (i, j) = parameter_index // len(axis_pairs), axis_pairs[parameter_index % len(axis_pairs)]
    forces = np.zeros_like(record.missing_force)
    for axis, motion_axis in {(i, j), (j, i)}:
        position, velocity = (motion[:, motion_axis] for motion in record.axis_motion)
        motion_by_order = np.gradient(velocity) * record.rate_hz, velocity, position
        forces[:, axis] -= tuning.deviation[parameter_index] * motion_by_order[order]
    return forces


def _filter_record(measure: ErrorMeasure, record: Observed, evidence: Evidence) -> FilteredRecord:
    """Build the filters of one record, up to a line about 10 % and 8 lines (chosen) above that below which
    `LAW_POWER_KEPT` of the command power lies."""
    rate_hz, n = evidence.sample_rate_hz, len(evidence.command)
    length = next_fast_len(n + int(_SETTLING_S * rate_hz), real=True)
    lines_hz = rfftfreq(length, 1 / rate_hz)
    cumulative_power = np.cumsum(np.sum(np.abs(rfft(evidence.command, length, axis=0)) ** 2, axis=1))
    line_count = int(1.1 * np.searchsorted(cumulative_power, LAW_POWER_KEPT * cumulative_power[-1])) + 8
    line_count = min(next_fast_len(line_count, real=True) + 1, len(lines_hz))
    force_response = _compute_force_response(measure, evidence, lines_hz[:line_count])
    strength = np.sqrt(np.sum(np.abs(force_response[:, :, : len(AXES)]) ** 2, axis=1))
    strength = np.maximum(strength, 1e-9 * strength.max(axis=0))
    ratio = 2 * (line_count - 1) / length
    # The response to a force near the record's end is cut off: the last samples, a quarter at most, are left out.
    end = n - min(_count_settling_samples(measure, evidence), n // 4)
    block_slices = tuple(
        slice(int(start * ratio), int(min(stop, end) * ratio)) for start, stop in _list_blocks(record) if start < end
    )
    compares_forces = isinstance(measure, PredictedForce)
    units = measure.unit[: 0 if compares_forces else evidence.response.shape[1]]
    motion = evidence.axis_position, evidence.axis_velocity
    return FilteredRecord(
        name_signals(evidence), motion, evidence.axis_force, rate_hz, length, force_response, strength, units,
        block_slices,
    )  # fmt: skip


def _compute_force_response(measure: ErrorMeasure, evidence: Evidence, f_hz: FloatArray) -> ComplexArray:
    """Compute (lines, c, m), 1/N: `FilteredRecord.force_response` at the frequencies f_hz (lines,)."""
    if isinstance(measure, PredictedForce):
        m = evidence.command.shape[1]
        band_gain = compute_low_pass_gain(f_hz, measure.band_hz)[:, None, None] if np.isfinite(measure.band_hz) else 1.0
        return np.asarray(-np.ones((len(f_hz), 1, 1)) * np.eye(m) * band_gain / measure.unit[:, None], dtype=complex)
    transfer = compute_axis_transfer(evidence.model, evidence.sample_rate_hz, f_hz)
    c = len(measure.unit)
    return np.asarray(np.concatenate([transfer.response, transfer.position], axis=1)[:, :c] / measure.unit[:, None])


def _count_settling_samples(measure: ErrorMeasure, evidence: Evidence) -> int:
    """Count the samples until the response to a force has decayed: `SETTLED_CONSTANTS` slowest time constants."""
    if isinstance(measure, PredictedForce):
        return 0
    largest_eigenvalue = float(
        np.abs(np.linalg.eigvals(discretise_model(evidence.model, 1 / evidence.sample_rate_hz).transition)).max()
    )
    return int(SETTLED_CONSTANTS / -np.log(largest_eigenvalue)) if largest_eigenvalue < 1 else len(evidence.command)


def _list_blocks(record: Observed) -> list[tuple[int, int]]:
    """List start and stop of the segments of which more than half is in `fit` or `choose`; with fewer than `LAW_BLOCKS`
    of them, of as many equal parts of the samples."""
    is_used = record.fit | record.choose
    blocks = [
        (segment.start, min(segment.stop, len(is_used)))
        for segment in record.recording.segments
        if segment.start < len(is_used) and is_used[segment.start : segment.stop].mean() > 0.5
    ]
    if len(blocks) >= LAW_BLOCKS:
        return blocks
    used_indices = np.flatnonzero(is_used)
    block_edges = (
        np.linspace(used_indices[0], used_indices[-1] + 1, LAW_BLOCKS + 1).astype(int).tolist()
        if len(used_indices)
        else []
    )
    return list(pairwise(block_edges))


def _compute_block_edges(filtered_records: Sequence[FilteredRecord]) -> tuple[int, ...]:
    """Compute the edges of all blocks where the kept samples of the records follow one another."""
    block_lengths = [block.stop - block.start for filtered in filtered_records for block in filtered.block_slices]
    return tuple(np.cumsum([0, *block_lengths]).tolist())


def _compute_noise(measure: ErrorMeasure, filtered_records: Sequence[FilteredRecord], axis: int) -> float:
    """Compute the mean square of the noise in the output of an axis's matched filter."""
    noise_power = (measure.noise / measure.unit) ** 2
    noise_shares = [
        np.sum(np.abs(filtered.force_response[:, :, axis]) ** 2 * noise_power[None, :], axis=1)
        / filtered.strength[:, axis] ** 2
        for filtered in filtered_records
    ]
    return float(np.mean(np.concatenate(noise_shares)))
