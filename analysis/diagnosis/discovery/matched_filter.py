"""A matched filter of a fit's residuals for a force along one axis, and the effect of re-tuning on its output.

Of all channels only what such a force could have caused is kept, scaled so that noise stays white and inner products of
columns are those of the simulated responses. A column of force costs two Fourier transforms instead of a simulation.
Where forces are compared, and for what is added to a reading, the filter is the band alone.
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
from analysis.diagnosis.forces.missing_force import axis_transfer
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.settings import LAW_BLOCKS, LAW_POWER_KEPT, SETTLED_CONSTANTS
from equalizer.effects.starts.evidence import Evidence
from equalizer.laws.law import ActsOn
from equalizer.plant.linear_simulation import linear_steps
from equalizer.plant.mechanical_model import MechanicalModelError
from equalizer.signals.band_limited import low_pass_gain
from equalizer.signals.signal import ComplexArray, FloatArray

_SETTLING_S = 2.0
"""Zero padding for the filter's transient (s)."""


@dataclass(frozen=True, slots=True, eq=False)
class FilteredRecord:
    """One record's filters: matched ones for forces along the m driven axes, then the band alone for p readings. An
    output is one of these m + p."""

    columns: Columns
    missing_force: FloatArray
    """(n, m), N: the force that the model lacks."""
    rate_hz: float
    length: int
    """Length of the transforms, samples."""
    force_response: ComplexArray
    """(lines, c, m): frequency response from a force to the residuals, up to the last line with command power."""
    strength: FloatArray
    """(lines, m)"""
    reading_units: FloatArray
    """(p,): units of the residuals of the response channels; none where forces are compared."""
    block_slices: tuple[slice, ...]
    """Blocks, in decimated samples."""

    def filter_residuals(self, residuals: FloatArray) -> FloatArray:
        """(kept samples, m + p): residuals (n, c) through the filter of each output."""
        return self._filter_spectrum(rfft(residuals, self.length, axis=0)[: len(self.force_response)])

    def _filter_spectrum(self, spectrum: ComplexArray) -> FloatArray:
        """spectrum: (lines, c) of residuals."""
        along = np.einsum("lcm,lc->lm", np.conj(self.force_response), spectrum) / self.strength
        return self._select_blocks(np.hstack([along, spectrum[:, : len(self.reading_units)]]))

    def filter_forces(self, forces: FloatArray) -> FloatArray:
        """(kept samples, m + p): the residuals that forces (n, m), N, cause, through the same filters. Each force acts
        as in `column`."""
        mean = forces.copy()
        mean[:-1] = 0.5 * (forces[1:] + forces[:-1])
        spectrum = rfft(mean, self.length, axis=0)[: len(self.force_response)]
        return self._filter_spectrum(np.einsum("lcm,lm->lc", self.force_response, spectrum))

    def column(self, added: FloatArray, output: int) -> FloatArray:
        """(kept samples,): one filter's output for a force (n,), N, along its axis, or for what is added to its
        reading. Sampled at each sample, a force acts as the mean over the step that begins there."""
        lines, axes = self.strength.shape
        if output >= axes:
            spectrum = rfft(added, self.length)[:lines] / self.reading_units[output - axes]
        else:
            mean = added.copy()
            mean[:-1] = 0.5 * (added[1:] + added[:-1])
            spectrum = rfft(mean, self.length)[:lines] * self.strength[:, output]
        return self._select_blocks(spectrum[:, None])[:, 0]

    def _select_blocks(self, spectrum: ComplexArray) -> FloatArray:
        count = 2 * (len(spectrum) - 1)
        filtered = irfft(spectrum, count, axis=0) * np.sqrt(count / self.length)
        return np.concatenate([filtered[part] for part in self.block_slices])


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The filtered residual of one output, with what the model's own parameters would explain of it."""

    output: int
    acts_on: ActsOn
    """What a term of it is: a force, or what is added to a response."""
    axis: int
    """The driven axis, or the channel of the response."""
    records: tuple[FilteredRecord, ...]
    residual: FloatArray
    """(s,), over all records and blocks."""
    parameter_columns: FloatArray
    """(t + 1, s): what one standard deviation of each of the model's own parameters would explain of it, and a constant
    force or reading."""
    to_calibration: FloatArray
    """(t + 1,): the calibration's values of these parameters less the present ones, in standard deviations."""
    edges: tuple[int, ...]
    """Edges of the blocks."""
    noise: float
    """Mean square of the noise in a sample."""


def views_of(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted) -> tuple[View, ...]:
    """One view per driven axis, then one per channel of the response that the grammar has a name for."""
    model, placed = tuning.tune(fitted.deviations), fitted.hypothesis.list_placed_effects()
    evidence = measure.evidence(model, placed, fitted.residuals)
    seen = tuple(_filter_record(measure, record, own) for record, own in zip(measure.records, evidence, strict=True))
    residual = np.concatenate(
        [each.filter_residuals(_zero_missing(left)) for each, left in zip(seen, fitted.residuals, strict=True)]
    )
    columns = np.array(
        [_parameter_columns(measure, tuning, fitted, seen, number) for number in range(len(fitted.deviations))]
    )
    edges = _edges(seen)
    to_calibration = np.append(-fitted.deviations, 0.0)
    views = []
    for output in range(min(residual.shape[1], model.inputs + len(AXES))):
        acts_on: ActsOn = "force" if output < model.inputs else "response"
        axis = output if output < model.inputs else output - model.inputs
        constant = np.concatenate([each.column(np.ones(len(each.missing_force)), output) for each in seen])
        tuned = np.vstack([columns[:, :, output].reshape(-1, len(residual)), constant])
        noise = _noise(measure, seen, axis) if acts_on == "force" else float((measure.noise / measure.unit)[axis] ** 2)
        views.append(View(output, acts_on, axis, seen, residual[:, output], tuned, to_calibration, edges, noise))
    return tuple(views)


def _zero_missing(left: FloatArray) -> FloatArray:
    return np.where(np.isfinite(left), left, 0.0)


def _parameter_columns(
    measure: ErrorMeasure, tuning: Tuning, fitted: Fitted, seen: Sequence[FilteredRecord], number: int
) -> FloatArray:
    """(s, m + p): effect of one standard deviation of one of the model's parameters. That of mass, damping and
    stiffness follows from the force along the measured motion, exact however wrong the model is; that of modes from the
    model without the hypothesis."""
    m = tuning.model.inputs
    pairs = [(i, j) for i in range(m) for j in range(i, m)]
    if number < 3 * len(pairs):
        return np.concatenate([each.filter_forces(_parameter_force(each, tuning, pairs, number)) for each in seen])
    base = measure.residuals(tuning.tune(fitted.deviations), ())
    for move in (DIFFERENCE_STEP, -DIFFERENCE_STEP):
        there = fitted.deviations.copy()
        there[number] += move
        try:
            moved = measure.residuals(tuning.tune(there), ())
        except (MechanicalModelError, np.linalg.LinAlgError):
            continue
        change = [
            each.filter_residuals(_zero_missing((before - after) / move))
            for each, before, after in zip(seen, base, moved, strict=True)
        ]
        return np.concatenate(change)
    kept = sum(part.stop - part.start for each in seen for part in each.block_slices)
    return np.zeros((kept, m + len(seen[0].reading_units)))


def _parameter_force(
    record: FilteredRecord, tuning: Tuning, pairs: Sequence[tuple[int, int]], number: int
) -> FloatArray:
    """(n, m), N: force of one standard deviation of a mass, a damping or a stiffness of a pair of axes."""
    order, (i, j) = number // len(pairs), pairs[number % len(pairs)]
    forces = np.zeros_like(record.missing_force)
    for axis, other in {(i, j), (j, i)}:
        name = AXES[other]
        motion = (
            np.gradient(record.columns[f"v{name}"]) * record.rate_hz,
            record.columns[f"v{name}"],
            record.columns[name],
        )
        forces[:, axis] -= tuning.deviation[number] * motion[order]
    return forces


def _filter_record(measure: ErrorMeasure, record: Observed, evidence: Evidence) -> FilteredRecord:
    rate_hz, n = evidence.sample_rate_hz, len(evidence.command)
    length = next_fast_len(n + int(_SETTLING_S * rate_hz), real=True)
    lines = rfftfreq(length, 1 / rate_hz)
    power = np.cumsum(np.sum(np.abs(rfft(evidence.command, length, axis=0)) ** 2, axis=1))
    last = int(1.1 * np.searchsorted(power, LAW_POWER_KEPT * power[-1])) + 8
    last = min(next_fast_len(last, real=True) + 1, len(lines))
    through = _force_response(measure, evidence, lines[:last])
    strength = np.sqrt(np.sum(np.abs(through) ** 2, axis=1))
    strength = np.maximum(strength, 1e-9 * strength.max(axis=0))
    share = 2 * (last - 1) / length
    # What a force does near the end is cut off there.
    end = n - min(_count_settling_samples(measure, evidence), n // 4)
    kept = tuple(slice(int(a * share), int(min(b, end) * share)) for a, b in _blocks(record) if a < end)
    forces = isinstance(measure, PredictedForce)
    units = measure.unit[: 0 if forces else evidence.response.shape[1]]
    return FilteredRecord(columns_of(evidence), evidence.axis_force, rate_hz, length, through, strength, units, kept)


def _force_response(measure: ErrorMeasure, evidence: Evidence, lines: FloatArray) -> ComplexArray:
    if isinstance(measure, PredictedForce):
        m = evidence.command.shape[1]
        within = low_pass_gain(lines, measure.band_hz)[:, None, None] if np.isfinite(measure.band_hz) else 1.0
        return np.asarray(-np.ones((len(lines), 1, 1)) * np.eye(m) * within / measure.unit[:, None], dtype=complex)
    seen = axis_transfer(evidence.model, evidence.sample_rate_hz, lines)
    c = len(measure.unit)
    return np.asarray(np.concatenate([seen.response, seen.position], axis=1)[:, :c] / measure.unit[:, None])


def _count_settling_samples(measure: ErrorMeasure, evidence: Evidence) -> int:
    """Samples until the response to a force has decayed."""
    if isinstance(measure, PredictedForce):
        return 0
    slowest = float(np.abs(np.linalg.eigvals(linear_steps(evidence.model, 1 / evidence.sample_rate_hz).advance)).max())
    return int(SETTLED_CONSTANTS / -np.log(slowest)) if slowest < 1 else len(evidence.command)


def _blocks(record: Observed) -> list[tuple[int, int]]:
    """Segments that are not held out; where there are few, equal parts."""
    used = record.fit | record.choose
    edges = [
        (segment.start, min(segment.stop, len(used)))
        for segment in record.recording.segments
        if segment.start < len(used) and used[segment.start : segment.stop].mean() > 0.5
    ]
    if len(edges) >= LAW_BLOCKS:
        return edges
    places = np.flatnonzero(used)
    cuts = np.linspace(places[0], places[-1] + 1, LAW_BLOCKS + 1).astype(int).tolist() if len(places) else []
    return list(pairwise(cuts))


def _edges(seen: Sequence[FilteredRecord]) -> tuple[int, ...]:
    sizes = [part.stop - part.start for each in seen for part in each.block_slices]
    return tuple(np.cumsum([0, *sizes]).tolist())


def _noise(measure: ErrorMeasure, seen: Sequence[FilteredRecord], axis: int) -> float:
    left = (measure.noise / measure.unit) ** 2
    shares = [
        np.sum(np.abs(each.force_response[:, :, axis]) ** 2 * left[None, :], axis=1) / each.strength[:, axis] ** 2
        for each in seen
    ]
    return float(np.mean(np.concatenate(shares)))
