"""One base model compared on two sets of recordings: reference (clean) and possibly faulty.

A base predicts one signal from others by least squares. Its rows are whitened by the same filter (autoregression of the
errors of both sets, Yule-Walker), so that sums of squares are log-likelihoods, and scaled to the error of each set, so
that both count alike. A fault is tested by undoing it in the rows of one set (`rows_with_fault_undone`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import solve_toeplitz

from analysis.diagnosis.contrast.autoregressive_base import AutoregressiveBase
from analysis.diagnosis.contrast.fault import EVERY, Curve, Fault, Variant
from analysis.diagnosis.contrast.force_base import ForceBase
from analysis.diagnosis.contrast.joint_products import Grams, Places, weights_of
from analysis.diagnosis.contrast.part import Part
from analysis.diagnosis.contrast.sensor_base import SensorBase
from analysis.diagnosis.data.correlated_residuals import lagged_products
from analysis.diagnosis.settings import CONTRAST_BLOCKS, CONTRAST_WHITENING_ORDER, LEAST_KEPT
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

Base = ForceBase | AutoregressiveBase | SensorBase
REACH = 2 * CONTRAST_WHITENING_ORDER
"""Rows left out at the ends of a part and near rare gaps: the range of the whitening filter, which starts from rest,
and of the differentiation. On real recordings, errors there were up to 20 times the rms."""
FEWEST_ROWS = CONTRAST_BLOCKS * REACH
"""Least rows of each set. A block must be longer than the correlation time of the errors: otherwise resampling is
invalid."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordingSet:
    """One set of recordings as rows of one base."""

    parts: tuple[Part, ...]
    rows: tuple[FloatArray, ...]
    """Per part (kept, 1 + columns): what is predicted, then its predictors."""
    masks: tuple[Mask, ...]
    scale: float
    """Rms of the whitened error of a base fitted to this set alone."""
    white: FloatArray
    """(valid samples, 1 + columns): the rows, whitened and scaled."""

    @property
    def count(self) -> int:
        return sum(int(mask.sum()) for mask in self.masks)


@dataclass(frozen=True, slots=True, eq=False)
class UndoneRows:
    """Rows with a fault of size 1 undone."""

    rows: tuple[FloatArray, ...]
    lost: tuple[Mask, ...] | None = None
    """Rows without known values after undoing, such as readings from before the part began: they keep their values,
    because leaving them out would be a gain where a part fits worst at its ends."""


@dataclass(frozen=True, slots=True, eq=False)
class ComparedBase:
    """One base on the clean and on the faulty set."""

    base: Base
    clean: RecordingSet
    faulty: RecordingSet
    """The recordings to diagnose."""
    whitening: FloatArray
    """Coefficients of the whitening filter of the errors."""
    columns: FloatArray
    """(1 + columns,): rms of each."""
    gap_reach: int
    """Rows beside a gap that are left out; see `_reach_of_gaps`."""

    @property
    def row_s(self) -> float:
        """Time from one row to the next, in s."""
        base = self.base
        return 1 / base.rate_hz if isinstance(base, ForceBase) else base.step / self.clean.parts[0].rate_hz

    def grams(self, side: RecordingSet, changed: Sequence[UndoneRows]) -> Grams:
        """Products of a side's rows and of their changes by undone faults; see `Grams`."""
        moved = [_changed_columns(each.rows, side.rows) for each in changed]
        kept = np.hstack([side.white, *(self._changes(side, *each) for each in zip(changed, moved, strict=True))])
        return Grams(
            np.array([block.T @ block for block in np.array_split(kept, CONTRAST_BLOCKS)]),
            tuple(moved),
            len(self.columns),
        )

    def _changes(self, side: RecordingSet, undone: UndoneRows, at: Places) -> FloatArray:
        """(valid samples, k): the changes of the columns `at`, whitened."""
        differences = [part[:, at] - plain[:, at] for part, plain in zip(undone.rows, side.rows, strict=True)]
        found = _whiten(self.whitening, differences, side.masks) / (self.columns[at] * side.scale)
        if undone.lost is not None:
            found[np.concatenate([gone[mask] for gone, mask in zip(undone.lost, side.masks, strict=True)])] = 0.0
        return np.asarray(found)


def _whiten(whitening: FloatArray, rows: Sequence[FloatArray], masks: Sequence[Mask]) -> FloatArray:
    """(valid samples, k): rows of all parts through the whitening filter."""
    return np.concatenate([apply_filter(whitening, part)[mask] for part, mask in zip(rows, masks, strict=True)])


def apply_filter(steps: FloatArray, samples: FloatArray) -> FloatArray:
    """(n, k): samples through a finite impulse response `steps`, from rest."""
    room = next_fast_len(len(samples) + len(steps) - 1, True)
    return np.asarray(irfft(rfft(samples, room, axis=0) * rfft(steps, room)[:, None], room, axis=0)[: len(samples)])


def _changed_columns(rows: Sequence[FloatArray], plain: Sequence[FloatArray]) -> Places:
    """Numbers of the columns in which the rows differ."""
    largest = np.array([np.abs(a - b).max(axis=0) for a, b in zip(rows, plain, strict=True)])
    return np.flatnonzero(largest.max(axis=0) > 0.0)


def compare_base(base: Base, clean: Sequence[Part], faulty: Sequence[Part]) -> ComparedBase:
    """The base fitted to both sets, whitened and scaled. Raises ValueError where too few rows of a set are left,
    numpy.linalg.LinAlgError where no base can be fitted."""
    if isinstance(base, AutoregressiveBase):
        least = (base.order + 2 * REACH) * base.step
        clean, faulty = ([part for part in parts if len(part.known) > least] for parts in (clean, faulty))
    rows = base.rows(clean), base.rows(faulty)
    valid = tuple(base.valid_samples(parts) for parts in (clean, faulty))
    gap_reach = min(_reach_of_gaps(side) for side in valid)
    masks = tuple(tuple(_keep_settled(mask, gap_reach) for mask in side) for side in valid)
    fewest = max(FEWEST_ROWS, 2 * rows[0][0].shape[1])
    if any(sum(int(mask.sum()) for mask in side) < fewest for side in masks):
        raise ValueError("too few rows are left of one set to be compared by")
    everything = np.vstack([part[mask] for side in (0, 1) for part, mask in zip(rows[side], masks[side], strict=True)])
    columns = np.sqrt(np.mean(everything**2, axis=0))
    columns = np.where(columns > 0, columns, 1.0)
    residuals = [_residuals(rows[side], masks[side], columns) for side in (0, 1)]
    whitening = _whitening_filter([*residuals[0], *residuals[1]], [*masks[0], *masks[1]])
    sides = []
    for parts, own, kept in zip((clean, faulty), rows, masks, strict=True):
        white = _whiten(whitening, own, kept) / columns
        scale = _white_error(white)
        sides.append(RecordingSet(tuple(parts), own, kept, scale, white / scale))
    return ComparedBase(base, sides[0], sides[1], whitening, columns, gap_reach)


def _keep_settled(valid: Mask, gap_reach: int) -> Mask:
    """Valid rows that neither the ends of a part nor gaps reach."""
    around = np.pad(~valid, gap_reach)
    kept = np.array(np.convolve(around, np.ones(2 * gap_reach + 1), "valid") == 0)
    places = np.flatnonzero(valid)
    if len(places):
        kept[: places[0] + REACH] = False
        kept[max(places[-1] + 1 - REACH, 0) :] = False
    return kept


def _reach_of_gaps(valid: Sequence[Mask]) -> int:
    """`REACH`; 0 where single losses are so frequent that most of a set's rows would be lost: interpolation over a
    sample or two is then good enough."""
    whole, kept = (sum(int(_keep_settled(mask, reach).sum()) for mask in valid) for reach in (0, REACH))
    return REACH if kept >= LEAST_KEPT * whole else 0


def _residuals(rows: Sequence[FloatArray], masks: Sequence[Mask], columns: FloatArray) -> list[FloatArray]:
    whole = np.vstack([part[mask] for part, mask in zip(rows, masks, strict=True)]) / columns
    weights = weights_of(whole.T @ whole)
    return [part @ (weights / columns) * columns[0] for part in rows]


def _white_error(white: FloatArray) -> float:
    """Rms error of a base fitted to these whitened rows alone, over the rms of what is predicted."""
    gram = white.T @ white / len(white)
    weights = weights_of(gram)
    return max(float(np.sqrt(max(float(weights @ gram @ weights), 0.0))), 1e-9)


def _whitening_filter(errors: Sequence[FloatArray], masks: Sequence[Mask]) -> FloatArray:
    masked = [np.where(mask, error, np.nan)[:, None] for error, mask in zip(errors, masks, strict=True)]
    power = np.sum(
        [
            lagged_products(series, CONTRAST_WHITENING_ORDER)[:, 0]
            for series in masked
            if len(series) > CONTRAST_WHITENING_ORDER
        ],
        axis=0,
    )
    if not np.any(power > 0):
        return np.array([1.0])
    power[0] *= 1 + 1e-6
    return np.asarray(np.concatenate([[1.0], -np.asarray(solve_toeplitz(power[:-1], power[1:]))]))


def rows_with_fault_undone(
    compared: ComparedBase, side: RecordingSet, fault: Fault, variant: Variant
) -> list[UndoneRows]:
    """Rows with a fault of size 1 undone, one set of rows per size of the variant.

    Undoing a fault of the signal that the base predicts also scales the errors of the base. The rows are scaled back,
    as a Jacobian does in a likelihood: otherwise a fault would win that only makes all errors smaller.
    """
    found = []
    place, site = _source_of(compared.base)
    is_predicted = fault.place == place and fault.site in (site, EVERY)
    if is_predicted and variant.column_change is not None and isinstance(compared.base, ForceBase):
        rate_hz = compared.base.rate_hz
        changed = (
            variant.column_change(rows[:, 1:], rate_hz, part) for rows, part in zip(side.rows, side.parts, strict=True)
        )
        return [
            UndoneRows(tuple(np.hstack([rows[:, :1], more]) for rows, more in zip(side.rows, changed, strict=True)))
        ]
    for undo in variant.undo:
        undone = tuple(undo(part) for part in side.parts)
        still = all(a.response is b.response for a, b in zip(undone, side.parts, strict=True))
        rows = compared.base.rows(undone, side.rows if still else None)
        unit = _unit_of_errors(compared, side, (fault, variant), rows) if is_predicted else 1.0
        known = all(a.known is b.known for a, b in zip(undone, side.parts, strict=True))
        lost = None if known else _lost_rows(compared, side, undone)
        found.append(UndoneRows(rows if unit == 1.0 else tuple(unit * part for part in rows), lost))
    return found


def _unit_of_errors(
    compared: ComparedBase, side: RecordingSet, tried: tuple[Fault, Variant], rows: Sequence[FloatArray]
) -> float:
    """Factor on the rows that takes out what undoing a fault of the predicted signal does to errors that the fault did
    not cause: a smaller gain, a flat curve, interpolation between samples, a weaker actuator."""
    fault, variant = tried
    unit = variant.unit
    if variant.curve is not None:
        unit *= _unit_of_curve(compared, side, variant.curve)
    if isinstance(compared.base, AutoregressiveBase) and compared.base.step == 1:
        unit /= variant.passed
    return unit * _spread_ratio(side, rows) if fault.place == "actuator" else unit


def _lost_rows(compared: ComparedBase, side: RecordingSet, undone: Sequence[Part]) -> tuple[Mask, ...]:
    """Rows that were known, and that what is unknown now reaches."""
    valid = compared.base.valid_samples(undone)
    return tuple(mask & ~_keep_settled(now, compared.gap_reach) for mask, now in zip(side.masks, valid, strict=True))


def _unit_of_curve(compared: ComparedBase, side: RecordingSet, curve: Curve) -> float:
    """The factor that corrects for the slope of a curve, which scales errors and is no gain: by the geometric mean of
    the slope for errors of constant size, or by its effect on the errors of the side's own base, if that is larger.
    Otherwise a curve would win that is flat where errors are large, or steep where the sets differ least."""
    weights = weights_of(side.white.T @ side.white) * compared.columns[0] / compared.columns
    rows = np.concatenate([part[mask] for part, mask in zip(side.rows, side.masks, strict=True)])
    errors = rows @ weights
    predicted = (compared.base.values(rows) if isinstance(compared.base, AutoregressiveBase) else rows[:, 0]) - errors
    size = max(float(np.sqrt(np.mean(errors**2))), 1e-300)
    slope = np.maximum(np.abs(curve(predicted + size) - curve(predicted - size)) / (2 * size), 1e-6)
    bent = max(float(np.mean((curve(predicted + errors) - curve(predicted)) ** 2)), 1e-300)
    return max(float(np.exp(-np.mean(np.log(slope)))), size / float(np.sqrt(bent)))


def _source_of(base: Base) -> tuple[str, int]:
    """Place and channel of the component that makes the signal that a base predicts."""
    return ("actuator", base.axis) if isinstance(base, ForceBase) else ("sensor", base.channel)


def _spread_ratio(side: RecordingSet, rows: Sequence[FloatArray]) -> float:
    """Ratio of the standard deviations of the predicted signal before and after: a weaker actuator must not reduce all
    errors."""
    before, after = (float(np.std(np.concatenate([part[:, 0] for part in each]))) for each in (side.rows, rows))
    return before / after if after > 0 else 1.0
