"""A base model fitted to two sets of recordings, clean and possibly faulty, for `fit_faults` and `rank_faults`.

A base predicts a signal y from regressors x, y(t) = x(t)' w + e(t); a row is (y, x). The errors are correlated in time:
one autoregressive filter A(q) for both sets, fitted to their errors (Yule-Walker), makes them white. With s the rms of
A e of a set whose own w is fitted, the rows A (y, x) / s give sums of squares that are -2 log-likelihoods of Gaussian
errors up to a constant (Ljung, System Identification, 2nd ed., section 7.4), and both sets count alike.

A fault is tested by undoing it in the rows of one set. Where it lies in the predicted signal itself, undoing maps y to
g(y), and the likelihood of the y that was recorded is that of g(y) times |g'| (change of variables). Therefore the
errors are divided by |g'| (`_compute_error_factor`): otherwise a map that shrinks the signal, and with it every error,
would have the highest likelihood.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import solve_toeplitz

from analysis.diagnosis.contrast.autoregressive_base import AutoregressiveBase
from analysis.diagnosis.contrast.fault import ALL_CHANNELS, ColumnChange, Curve, Fault, Undo, Variant
from analysis.diagnosis.contrast.force_base import ForceBase
from analysis.diagnosis.contrast.joint_products import ColumnIndices, GramBlocks, solve_residual_weights
from analysis.diagnosis.contrast.recording_part import Part
from analysis.diagnosis.contrast.sensor_base import SensorBase
from analysis.diagnosis.data.correlated_residuals import compute_lagged_products
from analysis.diagnosis.limits import CONTRAST_BLOCKS, CONTRAST_WHITENING_ORDER, LEAST_GAPLESS_SHARE
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

Base = ForceBase | AutoregressiveBase | SensorBase  # model that predicts one signal
REACH = 2 * CONTRAST_WHITENING_ORDER
"""Rows left out at the ends of a part and near rare gaps: the range of the whitening filter, which starts from rest,
and of the differentiation. On real recordings, errors there were up to 20 times the rms."""
LEAST_ROWS = CONTRAST_BLOCKS * REACH
"""Smallest number of rows of a set. A block must be longer than the correlation time of the errors: otherwise
resampling is invalid."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordingSet:
    """One set of recordings (clean or faulty) as rows of one base."""

    parts: tuple[Part, ...]
    rows: tuple[FloatArray, ...]
    """Per part (n, 1 + columns): the predicted signal, then its regressors."""
    masks: tuple[Mask, ...]
    """Per part (n,): rows that are valid, and beyond the reach of gaps and ends."""
    scale: float
    """s: rms of the whitened error of a base fitted to this set alone, relative to the rms of the predicted signal."""
    whitened: FloatArray
    """(valid samples, 1 + columns): the rows, whitened and scaled."""

    @property
    def valid_row_count(self) -> int:
        """Number of valid rows, over all parts."""
        return sum(int(mask.sum()) for mask in self.masks)


@dataclass(frozen=True, slots=True, eq=False)
class UndoneRows:
    """Rows of one set with a fault of size 1 undone."""

    rows: tuple[FloatArray, ...]
    """As `RecordingSet.rows`."""
    lost: tuple[Mask, ...] | None = None
    """Rows without known values after undoing, such as readings from before the part began: they keep their values,
    because leaving them out would be a gain where a part fits worst at its ends."""


@dataclass(frozen=True, slots=True, eq=False)
class ComparedBase:
    """One base with the rows of the clean and of the faulty set, whitened by the same filter."""

    base: Base
    clean: RecordingSet
    faulty: RecordingSet
    """The recordings to diagnose."""
    whitening: FloatArray
    """(k,): impulse response of the whitening filter A(q); the first is 1."""
    column_rms: FloatArray
    """(1 + columns,): rms of each column, by which the rows are divided before products are formed."""
    gap_reach: int
    """Number of rows next to a gap that are left out: `REACH`, or 0 where gaps are frequent."""

    @property
    def step_s(self) -> float:
        """Time from one row to the next, in s."""
        base = self.base
        return 1 / base.rate_hz if isinstance(base, ForceBase) else base.step / self.clean.parts[0].rate_hz

    def compute_grams(self, data: RecordingSet, changed: Sequence[UndoneRows]) -> GramBlocks:
        """Compute the Gram matrices of a set's rows and of their changes by undone faults. data: the set."""
        changed_columns = [_find_changed_columns(undone.rows, data.rows) for undone in changed]
        joint_rows = np.hstack(
            [data.whitened, *(self._whiten_changes(data, *pair) for pair in zip(changed, changed_columns, strict=True))]
        )
        return GramBlocks(
            np.array([block.T @ block for block in np.array_split(joint_rows, CONTRAST_BLOCKS)]),
            tuple(changed_columns),
            len(self.column_rms),
        )

    def _whiten_changes(self, data: RecordingSet, undone: UndoneRows, columns: ColumnIndices) -> FloatArray:
        """Compute (valid samples, k): the changes of the columns `columns`, whitened."""
        differences = [
            part[:, columns] - original[:, columns] for part, original in zip(undone.rows, data.rows, strict=True)
        ]
        white = _whiten(self.whitening, differences, data.masks) / (self.column_rms[columns] * data.scale)
        if undone.lost is not None:
            white[np.concatenate([lost[mask] for lost, mask in zip(undone.lost, data.masks, strict=True)])] = 0.0
        return np.asarray(white)


def _whiten(whitening: FloatArray, rows: Sequence[FloatArray], masks: Sequence[Mask]) -> FloatArray:
    """Filter the rows of all parts by the whitening filter: (valid samples, k)."""
    return np.concatenate([apply_filter(whitening, part)[mask] for part, mask in zip(rows, masks, strict=True)])


def apply_filter(impulse_response: FloatArray, samples: FloatArray) -> FloatArray:
    """Filter samples (n, k) by a finite impulse response (m,), from rest."""
    length = next_fast_len(len(samples) + len(impulse_response) - 1, True)  # a linear, not a circular, convolution
    product = rfft(samples, length, axis=0) * rfft(impulse_response, length)[:, None]
    return np.asarray(irfft(product, length, axis=0)[: len(samples)])


def _find_changed_columns(rows: Sequence[FloatArray], original: Sequence[FloatArray]) -> ColumnIndices:
    """Find the indices of the columns in which the rows differ."""
    changes = np.array([np.abs(new - old).max(axis=0) for new, old in zip(rows, original, strict=True)])
    return np.flatnonzero(changes.max(axis=0) > 0.0)


def compare_base(base: Base, clean: Sequence[Part], faulty: Sequence[Part]) -> ComparedBase:
    """Compare both sets as whitened and scaled rows of a base. Raises ValueError where a set has too few valid rows,
    numpy.linalg.LinAlgError where the base cannot be fitted."""
    if isinstance(base, AutoregressiveBase):
        least_samples = (base.order + 2 * REACH) * base.step
        clean, faulty = ([part for part in parts if len(part.known) > least_samples] for parts in (clean, faulty))
    rows = base.build_rows(clean), base.build_rows(faulty)
    valid = tuple(base.mask_valid_samples(parts) for parts in (clean, faulty))
    gap_reach = min(_choose_gap_reach(part_masks) for part_masks in valid)
    masks = tuple(tuple(_mask_interior(mask, gap_reach) for mask in part_masks) for part_masks in valid)
    least_rows = max([LEAST_ROWS, *(2 * part.shape[1] for part in rows[0])])
    if any(sum(int(mask.sum()) for mask in part_masks) < least_rows for part_masks in masks):
        raise ValueError("too few samples of one of the two sets remain for a comparison")
    all_rows = np.vstack([part[mask] for index in (0, 1) for part, mask in zip(rows[index], masks[index], strict=True)])
    column_rms = np.sqrt(np.mean(all_rows**2, axis=0))
    column_rms = np.where(column_rms > 0, column_rms, 1.0)
    residuals = [_compute_residuals(rows[index], masks[index], column_rms) for index in (0, 1)]
    whitening = _fit_whitening_filter([*residuals[0], *residuals[1]], [*masks[0], *masks[1]])
    recording_sets = []
    for parts, set_rows, set_masks in zip((clean, faulty), rows, masks, strict=True):
        white = _whiten(whitening, set_rows, set_masks) / column_rms
        scale = _compute_white_error(white)
        recording_sets.append(RecordingSet(tuple(parts), set_rows, set_masks, scale, white / scale))
    return ComparedBase(base, recording_sets[0], recording_sets[1], whitening, column_rms, gap_reach)


def _mask_interior(valid: Mask, gap_reach: int) -> Mask:
    """Mask the valid rows (n,) over `gap_reach` rows from gaps and at least `REACH` from the ends of the valid rows."""
    invalid = np.pad(~valid, gap_reach)
    settled = np.array(np.convolve(invalid, np.ones(2 * gap_reach + 1), "valid") == 0)
    indices = np.flatnonzero(valid)
    if len(indices):
        settled[: indices[0] + REACH] = False
        settled[max(indices[-1] + 1 - REACH, 0) :] = False
    return settled


def _choose_gap_reach(valid: Sequence[Mask]) -> int:
    """Choose `REACH`; 0 where single losses are so frequent that most of a set's rows would be lost: interpolation over
    a sample or two is then good enough."""
    all_rows, settled_rows = (sum(int(_mask_interior(mask, reach).sum()) for mask in valid) for reach in (0, REACH))
    return REACH if settled_rows >= LEAST_GAPLESS_SHARE * all_rows else 0


def _compute_residuals(rows: Sequence[FloatArray], masks: Sequence[Mask], column_rms: FloatArray) -> list[FloatArray]:
    """Compute per part (n,): errors of a base fitted to the masked rows by ordinary least squares, in units of y."""
    scaled = np.vstack([part[mask] for part, mask in zip(rows, masks, strict=True)]) / column_rms
    weights = solve_residual_weights(scaled.T @ scaled)
    return [part @ (weights / column_rms) * column_rms[0] for part in rows]


def _compute_white_error(white: FloatArray) -> float:
    """Compute the rms error of a base fitted to these whitened rows alone, over the rms of the predicted signal; at
    least 1e-9."""
    gram = white.T @ white / len(white)
    weights = solve_residual_weights(gram)
    return max(float(np.sqrt(max(float(weights @ gram @ weights), 0.0))), 1e-9)


def _fit_whitening_filter(errors: Sequence[FloatArray], masks: Sequence[Mask]) -> FloatArray:
    """Fit (k,): prediction-error filter of the autoregression of these errors, by the Yule-Walker equations; (1,) where
    all errors are zero."""
    masked = [np.where(mask, error, np.nan)[:, None] for error, mask in zip(errors, masks, strict=True)]
    autocovariance = np.sum(
        [
            compute_lagged_products(series, CONTRAST_WHITENING_ORDER)[:, 0]
            for series in masked
            if len(series) > CONTRAST_WHITENING_ORDER
        ],
        axis=0,
    )
    if not np.any(autocovariance > 0):
        return np.array([1.0])
    autocovariance[0] *= 1 + 1e-6  # a noise floor, without which errors in a narrow band make the equations singular
    coefficients = np.asarray(solve_toeplitz(autocovariance[:-1], autocovariance[1:]))
    return np.asarray(np.concatenate([[1.0], -coefficients]))


def undo_fault_in_rows(compared: ComparedBase, data: RecordingSet, fault: Fault, variant: Variant) -> list[UndoneRows]:
    """Undo a fault of size 1 in the rows of a set, for each size parameter of the variant."""
    base = compared.base
    is_predicted = _is_predicted(base, fault)
    if is_predicted and variant.column_change is not None and isinstance(base, ForceBase):
        return [_add_fault_to_regressors(base, data, variant.column_change)]
    undone = [_undo_in_recordings(compared, data, undo) for undo in variant.undo]
    if not is_predicted:
        return undone
    error_factors = [_compute_error_factor(compared, data, fault, variant, undone_rows) for undone_rows in undone]
    return [
        undone_rows if factor == 1.0 else replace(undone_rows, rows=tuple(factor * part for part in undone_rows.rows))
        for undone_rows, factor in zip(undone, error_factors, strict=True)
    ]


def _is_predicted(base: Base, fault: Fault) -> bool:
    """Whether the fault lies in the actuator or sensor of the signal that the base predicts."""
    place, site = ("actuator", base.axis) if isinstance(base, ForceBase) else ("sensor", base.channel)
    return fault.place == place and fault.site in (site, ALL_CHANNELS)


def _add_fault_to_regressors(base: ForceBase, data: RecordingSet, change: ColumnChange) -> UndoneRows:
    """Add the fault to the regressors instead of taking it out of the command: the predicted signal stays as recorded,
    so that no Jacobian is needed."""
    changed = (change(rows[:, 1:], base.rate_hz, part) for rows, part in zip(data.rows, data.parts, strict=True))
    return UndoneRows(tuple(np.hstack([rows[:, :1], x]) for rows, x in zip(data.rows, changed, strict=True)))


def _undo_in_recordings(compared: ComparedBase, data: RecordingSet, undo: Undo) -> UndoneRows:
    """Undo a fault in a set's parts and build their rows."""
    undone = tuple(undo(part) for part in data.parts)
    has_same_response = all(
        undone_part.response is original.response for undone_part, original in zip(undone, data.parts, strict=True)
    )
    rows = compared.base.build_rows(undone, data.rows if has_same_response else None)
    has_same_known = all(
        undone_part.known is original.known for undone_part, original in zip(undone, data.parts, strict=True)
    )
    return UndoneRows(rows, None if has_same_known else _find_lost_rows(compared, data, undone))


def _find_lost_rows(compared: ComparedBase, data: RecordingSet, undone: Sequence[Part]) -> tuple[Mask, ...]:
    """Find, per part, the rows that were known, and that depend on samples which are unknown after undoing."""
    valid = compared.base.mask_valid_samples(undone)
    return tuple(
        mask & ~_mask_interior(valid_mask, compared.gap_reach)
        for mask, valid_mask in zip(data.masks, valid, strict=True)
    )


def _compute_error_factor(
    compared: ComparedBase, data: RecordingSet, fault: Fault, variant: Variant, undone: UndoneRows
) -> float:
    """Compute the factor 1 / |g'| on the errors where undoing the fault maps the predicted signal y to g(y); see the
    module's docstring. The factor by which interpolation scales errors of an autoregression is divided out; for
    actuators, the spread ratio is a further factor."""
    factor = variant.error_factor
    if variant.curve is not None:
        factor *= _compute_slope_factor(compared, data, variant.curve)
    if isinstance(compared.base, AutoregressiveBase) and compared.base.step == 1:
        factor /= variant.noise_factor
    return factor * _compute_spread_ratio(data, undone.rows) if fault.place == "actuator" else factor


def _compute_slope_factor(compared: ComparedBase, data: RecordingSet, curve: Curve) -> float:
    """Compute the factor on the errors for a curve g, whose slope would scale them: the larger of 1 over the geometric
    mean of |g'| (the Jacobian) and 1 over the factor by which g scales the errors of the set's own base. Either factor
    alone would favour a curve that is flat where errors are large, or steep where the sets differ least. Slopes count
    as at least 1e-6."""
    weights = solve_residual_weights(data.whitened.T @ data.whitened) * compared.column_rms[0] / compared.column_rms
    rows = np.concatenate([part[mask] for part, mask in zip(data.rows, data.masks, strict=True)])
    errors = rows @ weights
    predicted = (
        compared.base.reconstruct_response(rows) if isinstance(compared.base, AutoregressiveBase) else rows[:, 0]
    ) - errors
    rms = max(float(np.sqrt(np.mean(errors**2))), 1e-300)
    slope = np.maximum(np.abs(curve(predicted + rms) - curve(predicted - rms)) / (2 * rms), 1e-6)
    curve_error_power = max(float(np.mean((curve(predicted + errors) - curve(predicted)) ** 2)), 1e-300)
    return max(float(np.exp(-np.mean(np.log(slope)))), rms / float(np.sqrt(curve_error_power)))


def _compute_spread_ratio(data: RecordingSet, rows: Sequence[FloatArray]) -> float:
    """Compute the standard deviation of the predicted signal before undoing over that after it (1 where that is 0): a
    weaker actuator must not reduce all errors."""
    original_spread, undone_spread = (
        float(np.std(np.concatenate([part[:, 0] for part in set_rows]))) for set_rows in (data.rows, rows)
    )
    return original_spread / undone_spread if undone_spread > 0 else 1.0
