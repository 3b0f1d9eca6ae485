"""A fit's residuals as seen by a force along one axis, whitened, with what re-tuning the model does to them.

A matched filter: of all channels only what such a force could have made is kept, scaled so that noise stays white and
products of columns are those of the simulated responses. A column of force costs two Fourier transforms instead of a
simulation. Where forces are compared, the filter is the band alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.discovery.grammar import AXES, Columns
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.output_error import MOVED, Fitted
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.forces.transfer import axis_transfer
from analysis.diagnosis.settings import LAW_BLOCKS, LAW_POWER_KEPT, SETTLED_CONSTANTS
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.linear_simulation import linear_steps
from equalizer.plant.mechanical_model import MechanicalModelError
from equalizer.signals.band_limited import low_pass_gain
from equalizer.signals.lockin import ComplexArray
from equalizer.signals.signal import FloatArray

_SETTLING_S = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """One record as a force along the driven axes would show in it."""

    columns: Columns
    left: FloatArray
    """(n, m), N: what is missing, as a force."""
    rate_hz: float
    length: int
    """Of the transforms, samples."""
    through: ComplexArray
    """(lines, c, m): from a force to the residuals; as many lines as count."""
    strength: FloatArray
    """(lines, m)"""
    kept: tuple[slice, ...]
    """Blocks, in thinned samples."""

    def matched(self, residuals: FloatArray) -> FloatArray:
        """(kept samples, m). residuals: (n, c)"""
        spectrum = rfft(residuals, self.length, axis=0)[: len(self.through)]
        found = np.einsum("lcm,lc->lm", np.conj(self.through), spectrum) / self.strength
        return self._thinned(found)

    def forced(self, forces: FloatArray) -> FloatArray:
        """(kept samples, m), as `matched` what they make of the residuals. forces: (n, m), N, as in `column`."""
        mean = forces.copy()
        mean[:-1] = 0.5 * (forces[1:] + forces[:-1])
        spectrum = rfft(mean, self.length, axis=0)[: len(self.through)]
        seen = np.einsum("lcm,lm->lc", self.through, spectrum)
        return self._thinned(np.einsum("lcm,lc->lm", np.conj(self.through), seen) / self.strength)

    def column(self, force: FloatArray, axis: int) -> FloatArray:
        """(kept samples,). force: (n,), N, at each sample; it acts as the mean over the time that begins there."""
        mean = force.copy()
        mean[:-1] = 0.5 * (force[1:] + force[:-1])
        spectrum = rfft(mean, self.length)[: len(self.through)] * self.strength[:, axis]
        return self._thinned(spectrum[:, None])[:, 0]

    def _thinned(self, spectrum: ComplexArray) -> FloatArray:
        count = 2 * (len(spectrum) - 1)
        course = irfft(spectrum, count, axis=0) * np.sqrt(count / self.length)
        return np.concatenate([course[part] for part in self.kept])


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Along one axis."""

    axis: int
    records: tuple[Seen, ...]
    residual: FloatArray
    """(s,), over all records and blocks,"""
    tuned: FloatArray
    """(t + 1, s): what one standard deviation of each of the model's own numbers would explain of it, and a constant
    force,"""
    pull: FloatArray
    """(t + 1,): where the calibration wants them, from where they are."""
    edges: tuple[int, ...]
    """of the blocks;"""
    noise: float
    """mean square of what noise leaves of a sample."""


def views_of(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted) -> tuple[View, ...]:
    """One per driven axis; none where the measure cannot tell forces."""
    model, placed = tuning.tuned(fitted.deviations), fitted.hypothesis.placed()
    evidence = measure.evidence(model, placed, fitted.residuals)
    seen = tuple(_seen(measure, record, told) for record, told in zip(measure.records, evidence, strict=True))
    residual = np.concatenate([each.matched(_known(left)) for each, left in zip(seen, fitted.residuals, strict=True)])
    columns = np.array([_moved(measure, tuning, fitted, seen, number) for number in range(len(fitted.deviations))])
    edges = _edges(seen)
    pull = np.append(-fitted.deviations, 0.0)
    views = []
    for axis in range(model.inputs):
        constant = np.concatenate([each.column(np.ones(len(each.left)), axis) for each in seen])
        tuned = np.vstack([columns[:, :, axis].reshape(-1, len(residual)), constant])
        noise = _noise(measure, seen, axis)
        views.append(View(axis, seen, residual[:, axis], tuned, pull, edges, noise))
    return tuple(views)


def _known(left: FloatArray) -> FloatArray:
    return np.where(np.isfinite(left), left, 0.0)


def _moved(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted, seen: Sequence[Seen], number: int) -> FloatArray:
    """(s, m): of mass, damping and stiffness by the force along the measured motion, which is exact however far the
    model is off; of modes by the model without the hypothesis."""
    m = tuning.model.inputs
    pairs = [(i, j) for i in range(m) for j in range(i, m)]
    if number < 3 * len(pairs):
        return np.concatenate([each.forced(_resisting(each, tuning, pairs, number)) for each in seen])
    base = measure.residuals(tuning.tuned(fitted.deviations), ())
    for move in (MOVED, -MOVED):
        there = fitted.deviations.copy()
        there[number] += move
        try:
            moved = measure.residuals(tuning.tuned(there), ())
        except (MechanicalModelError, np.linalg.LinAlgError):
            continue
        change = [
            each.matched(_known((before - after) / move)) for each, before, after in zip(seen, base, moved, strict=True)
        ]
        return np.concatenate(change)
    return np.zeros((sum(part.stop - part.start for each in seen for part in each.kept), m))


def _resisting(one: Seen, tuning: Tuning, pairs: Sequence[tuple[int, int]], number: int) -> FloatArray:
    """(n, m), N, of one standard deviation of a mass, a damping or a stiffness of a pair of axes."""
    order, (i, j) = number // len(pairs), pairs[number % len(pairs)]
    forces = np.zeros_like(one.left)
    for axis, other in {(i, j), (j, i)}:
        name = AXES[other]
        motion = (np.gradient(one.columns[f"v{name}"]) * one.rate_hz, one.columns[f"v{name}"], one.columns[name])
        forces[:, axis] -= tuning.deviation[number] * motion[order]
    return forces


def _seen(measure: ErrorMeasure, record: Observed, told: Evidence) -> Seen:
    rate_hz, n = told.sample_rate_hz, len(told.command)
    length = next_fast_len(n + int(_SETTLING_S * rate_hz), real=True)
    lines = rfftfreq(length, 1 / rate_hz)
    power = np.cumsum(np.sum(np.abs(rfft(told.command, length, axis=0)) ** 2, axis=1))
    last = int(1.1 * np.searchsorted(power, LAW_POWER_KEPT * power[-1])) + 8
    last = min(next_fast_len(last, real=True) + 1, len(lines))
    through = _through(measure, told, lines[:last])
    strength = np.sqrt(np.sum(np.abs(through) ** 2, axis=1))
    strength = np.maximum(strength, 1e-9 * strength.max(axis=0))
    share = 2 * (last - 1) / length
    # What a force does near the end is cut off there.
    end = n - min(_settling(measure, told), n // 4)
    kept = tuple(slice(int(a * share), int(min(b, end) * share)) for a, b in _blocks(record) if a < end)
    return Seen(columns_of(told), told.axis_force, rate_hz, length, through, strength, kept)


def _through(measure: ErrorMeasure, told: Evidence, lines: FloatArray) -> ComplexArray:
    if isinstance(measure, PredictedForce):
        m = told.command.shape[1]
        within = low_pass_gain(lines, measure.band_hz)[:, None, None] if np.isfinite(measure.band_hz) else 1.0
        return np.asarray(-np.ones((len(lines), 1, 1)) * np.eye(m) * within / measure.unit[:, None], dtype=complex)
    seen = axis_transfer(told.model, told.sample_rate_hz, lines)
    c = len(measure.unit)
    return np.asarray(np.concatenate([seen.response, seen.position], axis=1)[:, :c] / measure.unit[:, None])


def _settling(measure: ErrorMeasure, told: Evidence) -> int:
    """Samples, until what a force did is gone."""
    if isinstance(measure, PredictedForce):
        return 0
    slowest = float(np.abs(np.linalg.eigvals(linear_steps(told.model, 1 / told.sample_rate_hz).advance)).max())
    return int(SETTLED_CONSTANTS / -np.log(slowest)) if slowest < 1 else len(told.command)


def columns_of(told: Evidence) -> Columns:
    m = told.command.shape[1]
    found = {"t": np.arange(len(told.command)) / told.sample_rate_hz}
    for axis, name in zip(range(m), AXES, strict=False):
        found[name] = told.axis_position[:, axis]
        found[f"v{name}"] = told.axis_velocity[:, axis]
        found[f"f{name}"] = told.command[:, axis]
    return {name: np.ascontiguousarray(column) for name, column in found.items()}


def _blocks(record: Observed) -> list[tuple[int, int]]:
    """Segments, as far as they are not sealed; where there are few, equal parts."""
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


def _edges(seen: Sequence[Seen]) -> tuple[int, ...]:
    sizes = [part.stop - part.start for each in seen for part in each.kept]
    return tuple(np.cumsum([0, *sizes]).tolist())


def _noise(measure: ErrorMeasure, seen: Sequence[Seen], axis: int) -> float:
    left = (measure.noise / measure.unit) ** 2
    shares = [
        np.sum(np.abs(each.through[:, :, axis]) ** 2 * left[None, :], axis=1) / each.strength[:, axis] ** 2
        for each in seen
    ]
    return float(np.mean(np.concatenate(shares)))
