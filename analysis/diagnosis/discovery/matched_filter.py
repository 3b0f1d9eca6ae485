"""Matched filter of a fit's residuals for a force along one axis, and what re-tuning the model explains of its output.

For each spectral line, with the residuals r of all channels and their frequency response h to a force along the axis,

    y = h* r / |h|        a force f along the axis gives y = |h| f

so that only the part of r that such a force can cause is kept, white noise stays white, and inner products of filtered
forces equal those of the simulated responses h f. A candidate force then costs two Fourier transforms instead of a
simulation. Where forces are compared, h is minus the gain of the band's low pass; what is added to a reading is limited
to the band of the commands and not filtered otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.discovery.evaluate_shape import columns_of
from analysis.diagnosis.discovery.grammar import AXES, Columns
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.output_error import DIFFERENCE_STEP, Fitted
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.forces.missing_force import compute_axis_transfer
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.settings import LAW_BLOCKS, LAW_POWER_KEPT, SETTLED_CONSTANTS
from equalizer.effects.starts.evidence import Evidence
from equalizer.laws.law import ActsOn
from equalizer.plant.linear_simulation import discretise_model
from equalizer.plant.mechanical_model import MechanicalModelError
from equalizer.signals.band_limited import compute_low_pass_gain
from equalizer.signals.signal import ComplexArray, FloatArray

_SETTLING_S = 2.0
"""Length (s) of the zeros appended to a record, so that the response at its end does not wrap around to the start."""


@dataclass(frozen=True, slots=True, eq=False)
class FilteredRecord:
    """Filters of one record with n samples and c channels. Its m + p outputs are the matched filters for forces along
    the m driven axes, then p readings limited to the band."""

    columns: Columns
    """Signals by their names in a formula, (n,) each."""
    missing_force: FloatArray
    """(n, m), N: the force that the model lacks."""
    rate_hz: float
    length: int
    """Length of the transforms, samples."""
    force_response: ComplexArray
    """(lines, c, m), 1/N: response h from a force to the residuals, up to the last line with command power."""
    strength: FloatArray
    """(lines, m), 1/N: norm of that response over the channels, |h|; limited from below to avoid a division by zero."""
    reading_units: FloatArray
    """(p,): units of the residuals of the response channels; none where forces are compared."""
    block_slices: tuple[slice, ...]
    """Blocks of the cross-validation, as ranges of decimated samples."""

    def filter_residuals(self, residuals: FloatArray) -> FloatArray:
        """(kept samples, m + p): output of each filter for residuals (n, c), decimated."""
        return self._filter_spectrum(rfft(residuals, self.length, axis=0)[: len(self.force_response)])

    def _filter_spectrum(self, spectrum: ComplexArray) -> FloatArray:
        """(kept samples, m + p): output of each filter. spectrum: (lines, c), of residuals."""
        force_outputs = np.einsum("lcm,lc->lm", np.conj(self.force_response), spectrum) / self.strength
        return self._select_blocks(np.hstack([force_outputs, spectrum[:, : len(self.reading_units)]]))

    def filter_forces(self, forces: FloatArray) -> FloatArray:
        """(kept samples, m + p): outputs for the residuals that forces (n, m), N, cause together. A force acts as in
        `column`."""
        mean = forces.copy()
        mean[:-1] = 0.5 * (forces[1:] + forces[:-1])
        spectrum = rfft(mean, self.length, axis=0)[: len(self.force_response)]
        return self._filter_spectrum(np.einsum("lcm,lm->lc", self.force_response, spectrum))

    def column(self, added: FloatArray, output: int) -> FloatArray:
        """(kept samples,): output of one filter. added: (n,), a force along its axis, N, or a change of its reading.
        The force between two samples is the mean of both, because the model's commands are held over a step."""
        lines, axes = self.strength.shape
        if output >= axes:
            spectrum = rfft(added, self.length)[:lines] / self.reading_units[output - axes]
        else:
            mean = added.copy()
            mean[:-1] = 0.5 * (added[1:] + added[:-1])
            spectrum = rfft(mean, self.length)[:lines] * self.strength[:, output]
        return self._select_blocks(spectrum[:, None])[:, 0]

    def _select_blocks(self, spectrum: ComplexArray) -> FloatArray:
        """(kept samples, outputs): time series of a spectrum (lines, outputs), decimated to its band, in the blocks
        only. Sums of squares are those at the full rate."""
        count = 2 * (len(spectrum) - 1)
        filtered = irfft(spectrum, count, axis=0) * np.sqrt(count / self.length)
        return np.concatenate([filtered[part] for part in self.block_slices])


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


def build_views(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted) -> tuple[View, ...]:
    """One view per driven axis, then one per response channel (up to the three that the grammar has names for)."""
    model, placed_effects = tuning.tune(fitted.deviations), fitted.hypothesis.list_placed_effects()
    evidence = measure.evidence(model, placed_effects, fitted.residuals)
    filtered_records = tuple(
        _filter_record(measure, record, record_evidence)
        for record, record_evidence in zip(measure.records, evidence, strict=True)
    )
    residual = np.concatenate(
        [
            filtered.filter_residuals(_zero_missing(record_residuals))
            for filtered, record_residuals in zip(filtered_records, fitted.residuals, strict=True)
        ]
    )
    columns = np.array(
        [
            _compute_parameter_columns(measure, tuning, fitted, filtered_records, number)
            for number in range(len(fitted.deviations))
        ]
    )
    edges = _compute_block_edges(filtered_records)
    to_calibration = np.append(-fitted.deviations, 0.0)
    views = []
    for output in range(min(residual.shape[1], model.inputs + len(AXES))):
        acts_on: ActsOn = "force" if output < model.inputs else "response"
        axis = output if output < model.inputs else output - model.inputs
        constant = np.concatenate(
            [filtered.column(np.ones(len(filtered.missing_force)), output) for filtered in filtered_records]
        )
        tuned = np.vstack([columns[:, :, output].reshape(-1, len(residual)), constant])
        noise = (
            _compute_noise(measure, filtered_records, axis)
            if acts_on == "force"
            else float((measure.noise / measure.unit)[axis] ** 2)
        )
        views.append(
            View(output, acts_on, axis, filtered_records, residual[:, output], tuned, to_calibration, edges, noise)
        )
    return tuple(views)


def _zero_missing(residuals: FloatArray) -> FloatArray:
    """Residuals with 0 where a reading is missing."""
    return np.where(np.isfinite(residuals), residuals, 0.0)


def _compute_parameter_columns(
    measure: ErrorMeasure, tuning: Tuning, fitted: Fitted, filtered_records: Sequence[FilteredRecord], number: int
) -> FloatArray:
    """(s, m + p): change of all outputs by one standard deviation of one of the model's parameters, by its number. For
    mass, damping and stiffness it is that of their force along the measured motion, exact even for a wrong model; for
    modes, a finite difference of simulations without the hypothesis; 0 where no such model is valid."""
    m = tuning.model.inputs
    pairs = [(i, j) for i in range(m) for j in range(i, m)]
    if number < 3 * len(pairs):
        return np.concatenate(
            [
                filtered.filter_forces(_compute_parameter_force(filtered, tuning, pairs, number))
                for filtered in filtered_records
            ]
        )
    base_residuals = measure.residuals(tuning.tune(fitted.deviations), ())
    for step in (DIFFERENCE_STEP, -DIFFERENCE_STEP):
        shifted_deviations = fitted.deviations.copy()
        shifted_deviations[number] += step
        try:
            shifted_residuals = measure.residuals(tuning.tune(shifted_deviations), ())
        except (MechanicalModelError, np.linalg.LinAlgError):
            continue
        change = [
            filtered.filter_residuals(_zero_missing((base_record - shifted_record) / step))
            for filtered, base_record, shifted_record in zip(
                filtered_records, base_residuals, shifted_residuals, strict=True
            )
        ]
        return np.concatenate(change)
    sample_count = sum(part.stop - part.start for filtered in filtered_records for part in filtered.block_slices)
    return np.zeros((sample_count, m + len(filtered_records[0].reading_units)))


def _compute_parameter_force(
    record: FilteredRecord, tuning: Tuning, pairs: Sequence[tuple[int, int]], number: int
) -> FloatArray:
    """(n, m), N: external force equivalent to one standard deviation more of a mass, damping or stiffness entry."""
    order, (i, j) = number // len(pairs), pairs[number % len(pairs)]
    forces = np.zeros_like(record.missing_force)
    for axis, motion_axis in {(i, j), (j, i)}:
        name = AXES[motion_axis]
        motion = (
            np.gradient(record.columns[f"v{name}"]) * record.rate_hz,
            record.columns[f"v{name}"],
            record.columns[name],
        )
        forces[:, axis] -= tuning.deviation[number] * motion[order]
    return forces


def _filter_record(measure: ErrorMeasure, record: Observed, evidence: Evidence) -> FilteredRecord:
    """The filters of one record, up to the line below which `LAW_POWER_KEPT` of the commands' power lies."""
    rate_hz, n = evidence.sample_rate_hz, len(evidence.command)
    length = next_fast_len(n + int(_SETTLING_S * rate_hz), real=True)
    lines = rfftfreq(length, 1 / rate_hz)
    power = np.cumsum(np.sum(np.abs(rfft(evidence.command, length, axis=0)) ** 2, axis=1))
    last = int(1.1 * np.searchsorted(power, LAW_POWER_KEPT * power[-1])) + 8
    last = min(next_fast_len(last, real=True) + 1, len(lines))
    force_response = _compute_force_response(measure, evidence, lines[:last])
    strength = np.sqrt(np.sum(np.abs(force_response) ** 2, axis=1))
    strength = np.maximum(strength, 1e-9 * strength.max(axis=0))
    share = 2 * (last - 1) / length
    # The response to a force near the record's end is not recorded to its end, so that the last samples are left out.
    end = n - min(_count_settling_samples(measure, evidence), n // 4)
    block_slices = tuple(slice(int(a * share), int(min(b, end) * share)) for a, b in _list_blocks(record) if a < end)
    forces = isinstance(measure, PredictedForce)
    units = measure.unit[: 0 if forces else evidence.response.shape[1]]
    return FilteredRecord(
        columns_of(evidence), evidence.axis_force, rate_hz, length, force_response, strength, units, block_slices
    )


def _compute_force_response(measure: ErrorMeasure, evidence: Evidence, lines: FloatArray) -> ComplexArray:
    """(lines, c, m), 1/N: see `FilteredRecord`. lines: frequencies, Hz."""
    if isinstance(measure, PredictedForce):
        m = evidence.command.shape[1]
        band_gain = (
            compute_low_pass_gain(lines, measure.band_hz)[:, None, None] if np.isfinite(measure.band_hz) else 1.0
        )
        return np.asarray(-np.ones((len(lines), 1, 1)) * np.eye(m) * band_gain / measure.unit[:, None], dtype=complex)
    transfer = compute_axis_transfer(evidence.model, evidence.sample_rate_hz, lines)
    c = len(measure.unit)
    return np.asarray(np.concatenate([transfer.response, transfer.position], axis=1)[:, :c] / measure.unit[:, None])


def _count_settling_samples(measure: ErrorMeasure, evidence: Evidence) -> int:
    """Samples until the response to a force has decayed (`SETTLED_CONSTANTS` of the slowest time constant)."""
    if isinstance(measure, PredictedForce):
        return 0
    slowest = float(
        np.abs(np.linalg.eigvals(discretise_model(evidence.model, 1 / evidence.sample_rate_hz).transition)).max()
    )
    return int(SETTLED_CONSTANTS / -np.log(slowest)) if slowest < 1 else len(evidence.command)


def _list_blocks(record: Observed) -> list[tuple[int, int]]:
    """Start and stop of the segments that are not held out; with fewer than `LAW_BLOCKS` of them, of as many equal
    parts of the samples."""
    used = record.fit | record.choose
    edges = [
        (segment.start, min(segment.stop, len(used)))
        for segment in record.recording.segments
        if segment.start < len(used) and used[segment.start : segment.stop].mean() > 0.5
    ]
    if len(edges) >= LAW_BLOCKS:
        return edges
    used_indices = np.flatnonzero(used)
    cuts = (
        np.linspace(used_indices[0], used_indices[-1] + 1, LAW_BLOCKS + 1).astype(int).tolist()
        if len(used_indices)
        else []
    )
    return list(pairwise(cuts))


def _compute_block_edges(filtered_records: Sequence[FilteredRecord]) -> tuple[int, ...]:
    """Edges of all blocks where the kept samples of the records follow one another."""
    sizes = [part.stop - part.start for filtered in filtered_records for part in filtered.block_slices]
    return tuple(np.cumsum([0, *sizes]).tolist())


def _compute_noise(measure: ErrorMeasure, filtered_records: Sequence[FilteredRecord], axis: int) -> float:
    """Mean square of the noise in the output of an axis's matched filter."""
    noise_power = (measure.noise / measure.unit) ** 2
    shares = [
        np.sum(np.abs(filtered.force_response[:, :, axis]) ** 2 * noise_power[None, :], axis=1)
        / filtered.strength[:, axis] ** 2
        for filtered in filtered_records
    ]
    return float(np.mean(np.concatenate(shares)))
