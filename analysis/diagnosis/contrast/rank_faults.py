"""Test which fault explains the difference between faulty and clean recordings of one device.

A base is a regression model of the recordings: force balance, autoregressive model, or one sensor by another. E(f) is
the sum of squared whitened errors of all bases, fitted to both sets jointly, with fault f undone in the faulty set
(`compared_base`, `joint_products`). The gain of f is

    gain(f) = E(none) / E(f) - 1.

Real devices hardly repeat themselves exactly, and free parameters gain a little on any data. As negative control, the
same gain is computed between stretches of one set, where no fault can have appeared; E(f) is raised by the median of
these gains. A confidence bound of the corrected gain comes from resampling blocks (bootstrap), standard errors of a
fault's values from leaving out groups of blocks in turn (delete-a-group jackknife; Efron and Tibshirani, An
Introduction to the Bootstrap, 1993, chapter 11). Called by `compare_with_reference`; `choose_fault` names a fault.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.contrast.actuator_faults import make_actuator_faults
from analysis.diagnosis.contrast.bases import (
    build_bases,
    compute_unexplained_share,
    compute_unexplained_share_of_rows,
    has_similar_motion,
)
from analysis.diagnosis.contrast.compared_base import Base, ComparedBase, compare_base, undo_fault_in_rows
from analysis.diagnosis.contrast.comparison import Comparison, JudgedFault
from analysis.diagnosis.contrast.fault import Fault, Lags, Variant
from analysis.diagnosis.contrast.fit_faults import ALL_BLOCKS, FaultFits, FittedVariant, fit_faults, restrict_sizes
from analysis.diagnosis.contrast.force_base import ForceBase
from analysis.diagnosis.contrast.joint_products import (
    SetPair,
    SizeFit,
    compute_error,
    compute_held_out_error,
    compute_residual_squares,
    fit_sizes,
)
from analysis.diagnosis.contrast.likely_delays import suggest_clock_rates, suggest_delays_s
from analysis.diagnosis.contrast.mechanism_faults import make_mechanism_faults
from analysis.diagnosis.contrast.recording_part import Part, split_into_parts
from analysis.diagnosis.contrast.sensor_base import build_sensor_bases
from analysis.diagnosis.contrast.sensor_faults import make_misalignment_fault, make_sensor_faults, make_shared_faults
from analysis.diagnosis.data.correlated_residuals import draw_bootstrap_blocks
from analysis.diagnosis.limits import BOOTSTRAP_LEVEL, CONTRAST_BLOCKS, DELAY_STEP, LEAST_FAULT_GAIN, MISFIT_SHARE
from analysis.diagnosis.types import Mask, TimeBudget
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

SIXTHS, THIRDS = (
    tuple(tuple(ALL_BLOCKS[k : k + size]) for k in ALL_BLOCKS[::size])
    for size in (len(ALL_BLOCKS) // 6, len(ALL_BLOCKS) // 3)
)
"""The blocks of a set in six and in three groups of consecutive blocks."""
FOLDS = len(SIXTHS)
"""Groups of blocks of each set that are left out in turn (jackknife)."""
CONTROL_STRETCHES = (*THIRDS, ALL_BLOCKS[: CONTRAST_BLOCKS // 2])
"""Stretches for the negative control: each third and the first half of a set's blocks, which are compared with its
other blocks as if they were separate recordings."""


def rank_faults(
    recordings: Sequence[Recording], clean: Sequence[Recording], excluded: frozenset[str], time_left: TimeBudget
) -> Comparison | None:
    """Compare the faulty recordings with the clean ones, by the first kind of base that fits: force balances, else
    autoregressive models. excluded: names of effects that are not tested. None where there is too little data, no base
    fits, or one set moves far less than the other."""
    part_sets = split_into_parts(clean), split_into_parts(recordings)
    if not all(part_sets) or not has_similar_motion(*part_sets):
        return None
    for bases, motions in build_bases(*part_sets):
        with suppress(np.linalg.LinAlgError, ValueError):
            compared_bases, faults = _prepare_bases(*part_sets, bases, motions)
            fault_fits = fit_faults(
                compared_bases, [fault for fault in faults if fault.effect not in excluded], time_left
            )
            if not isinstance(bases[0], ForceBase) or _are_forces_balanced(compared_bases, fault_fits.variants):
                return _judge_faults(compared_bases, fault_fits)
    return None


def _prepare_bases(
    clean: tuple[Part, ...], faulty: tuple[Part, ...], bases: Sequence[Base], motions: tuple[Motion, ...]
) -> tuple[list[ComparedBase], list[Fault]]:
    """Prepare the bases on both sets, including those that predict one sensor from another, and all faults to test.
    Faults of the mechanism need velocities and so a time axis; an imposed motion was not produced by an actuator."""
    recording = clean[0].recording
    by_force = isinstance(bases[0], ForceBase)
    has_time_axis = bool(motions) and np.isfinite(motions[0].band_hz)
    band_hz, step = (motions[0].band_hz, motions[0].step) if motions else (np.inf, 1)
    # `motions` is empty where none was measured.
    motion_of = {id(part.recording): motion for part, motion in zip((*clean, *faulty), motions, strict=False)}
    compared_bases = [compare_base(base, clean, faulty) for base in bases]
    for base in build_sensor_bases(clean, band_hz, step):
        with suppress(ValueError):  # too few valid rows: the other bases are compared
            compared_bases.append(compare_base(base, clean, faulty))
    step_s = compared_bases[0].step_s
    lag_samples = 1 if by_force else round(step_s * clean[0].rate_hz)
    lags = Lags(lag_samples, suggest_delays_s(compared_bases), DELAY_STEP * step_s, suggest_clock_rates(compared_bases))
    faults: list[Fault] = []
    rotational = recording.is_rotational
    for axis, name in enumerate(recording.command.channels):
        if has_time_axis:
            faults += make_mechanism_faults(axis, name, motions, lambda part: motion_of[id(part.recording)], rotational)
        if not recording.meta.get("imposed"):
            faults += make_actuator_faults(axis, name, (*clean, *faulty), by_force, lags)
    for channel, name in enumerate(recording.response.channels):
        faults += make_sensor_faults(channel, name, (*clean, *faulty), lags)
    if len(recording.response.channels) > 1:
        faults += make_shared_faults((*clean, *faulty), lags)
    if {name[-1:] for name in recording.response.channels} == {"x", "y", "z"}:
        faults.append(make_misalignment_fault())
    return compared_bases, faults


def _judge_faults(compared_bases: Sequence[ComparedBase], fault_fits: FaultFits) -> Comparison:
    """Judge all fitted faults, the smallest error first, and compute the errors with no fault undone."""
    unchanged_pairs = fault_fits.unchanged_pairs
    baseline_fit = fit_sizes(unchanged_pairs, None)
    faulty_sample_count = sum(compared.faulty.valid_row_count for compared in compared_bases)
    sample_count = faulty_sample_count + sum(compared.clean.valid_row_count for compared in compared_bases)
    judged_faults = sorted(
        (
            _judge_fault(compared_bases, fitted_variant, baseline_fit, sample_count)
            for fitted_variant in fault_fits.variants
        ),
        key=lambda judged_fault: float(judged_fault.block_squares.sum()),
    )
    folds = zip(SIXTHS, _leave_out_sixths(unchanged_pairs), strict=True)
    held_out_squares = sum(compute_held_out_error(fold_pairs, np.zeros(0), left_out) for left_out, fold_pairs in folds)
    clean, faulty = [pair.unchanged for pair in unchanged_pairs], [pair.undone.blocks for pair in unchanged_pairs]
    control_excesses = [
        max(_yield_control_excesses([np.array(products) for products in grams])) for grams in (clean, faulty)
    ]
    first_base = compared_bases[0]
    return Comparison(
        faults=tuple(judged_faults),
        block_squares=baseline_fit.errors,
        sample_count=sample_count,
        faulty_sample_count=faulty_sample_count,
        held_out_squares=held_out_squares,
        faulty_share=min(compute_unexplained_share(first_base.base, first_base.faulty.parts), 1.0),
        control_excess=max(control_excesses),
        clean_control_excess=control_excesses[0],
        by_force=isinstance(first_base.base, ForceBase),
        step_s=first_base.step_s,
        complete=fault_fits.complete,
    )


def _are_forces_balanced(compared_bases: Sequence[ComparedBase], fitted_variants: Sequence[FittedVariant]) -> bool:
    """Whether the force balances fit the faulty set, either with no fault or with the best fault undone.
    fitted_variants: the best first."""
    force_bases = [compared for compared in compared_bases if isinstance(compared.base, ForceBase)]
    if all(
        compute_unexplained_share_of_rows(axis_base.base, axis_base.faulty.rows, axis_base.faulty.masks) < MISFIT_SHARE
        for axis_base in force_bases
    ):
        return True
    return any(
        all(
            compute_unexplained_share_of_rows(axis_base.base, *_undo_fault(axis_base, best_variant)) < MISFIT_SHARE
            for axis_base in force_bases
        )
        for best_variant in fitted_variants[:1]
    )


def _undo_fault(compared: ComparedBase, fitted_variant: FittedVariant) -> tuple[list[FloatArray], list[Mask]]:
    """Undo a fault in the faulty set at its fitted sizes: rows, and masks of the rows with known values."""
    fit, fault, variant, _ = fitted_variant
    undone_rows = undo_fault_in_rows(compared, compared.faulty, fault, variant)
    rows, masks = list(compared.faulty.rows), list(compared.faulty.masks)
    for part_index, (unchanged_rows, mask) in enumerate(zip(compared.faulty.rows, compared.faulty.masks, strict=True)):
        rows[part_index] = unchanged_rows + sum(
            fitted_size * (undone.rows[part_index] - unchanged_rows)
            for fitted_size, undone in zip(fit.sizes, undone_rows, strict=True)
        )
        masks[part_index] = mask & ~np.any([undone.lost[part_index] for undone in undone_rows if undone.lost], axis=0)
    return rows, masks


def _yield_control_excesses(products_by_base: Sequence[FloatArray]) -> Iterator[float]:
    """Yield the relative excess error within one set: for each division into two stretches, the error of a single fit
    to both over the sum of separate fits, less 1. products_by_base: of the set, (blocks, k, k) each."""

    def sum_errors(blocks: Sequence[int]) -> float:
        return sum(compute_residual_squares(products[list(blocks)].sum(axis=0)) for products in products_by_base)

    joint_error = sum_errors(ALL_BLOCKS)
    for stretch in CONTROL_STRETCHES:
        separate_error = sum_errors(stretch) + sum_errors([block for block in ALL_BLOCKS if block not in stretch])
        yield joint_error / max(separate_error, 1e-300) - 1


def _judge_fault(
    compared_bases: Sequence[ComparedBase], fitted_variant: FittedVariant, baseline_fit: SizeFit, sample_count: int
) -> JudgedFault:
    """Judge a fault by its values and their standard errors, its gain, and the gains of the negative control.
    baseline_fit: the fit with no fault undone. sample_count: in both sets, over all bases."""
    fit, fault, variant, pairs = fitted_variant
    folds = _leave_out_sixths(pairs)
    fold_fits = [fit_sizes(fold_pairs, variant) for fold_pairs in folds]
    # Errors count at the size that was accepted; only the standard errors need the free size of a timing fault.
    allowed_variant = restrict_sizes(variant)
    allowed_fits = [fit_sizes(fold_pairs, allowed_variant) for fold_pairs in folds] if variant.one_size else fold_fits
    held_out_squares = sum(
        compute_held_out_error(fold_pairs, fold_fit.sizes, left_out)
        for left_out, fold_pairs, fold_fit in zip(SIXTHS, folds, allowed_fits, strict=True)
    )
    # The negative control takes long, and a fault with hardly any gain needs none.
    control_gains = (
        list(_yield_control_gains(compared_bases, fault, allowed_variant, fit.sizes))
        if baseline_fit.error > (1 + LEAST_FAULT_GAIN) * fit.error
        else [0.0]
    )
    median_control_gain = max(float(np.median(control_gains)), 0.0)
    errors = fit.errors * (1 + median_control_gain)
    draws = draw_bootstrap_blocks(len(errors))
    drawn_gains = baseline_fit.errors[draws].sum(axis=1) / np.maximum(errors[draws].sum(axis=1), 1e-300) - 1
    # With a separate base for each set, errors are white with rms 1: their sum of squares is the number of samples.
    corrected_error, excess = float(errors.sum()), baseline_fit.error - sample_count
    return JudgedFault(
        fault=fault,
        values=variant.parameters_of(fit.sizes),
        standard_errors=_estimate_standard_errors(
            variant, [fold.sizes for fold in fold_fits], _fit_without_clean_sixths(pairs, variant)
        ),
        block_squares=errors,
        gain=baseline_fit.error / max(corrected_error, 1e-300) - 1,
        control_gain=max([0.0, *control_gains]) - median_control_gain,
        share=(baseline_fit.error - corrected_error) / excess if excess > 0 else 0.0,
        held_out_squares=held_out_squares,
        gain_low=float(np.quantile(drawn_gains, BOOTSTRAP_LEVEL)),
        control_excess=max(_yield_control_excesses([pair.undone.undo_fault(fit.sizes) for pair in pairs])),
    )


def _estimate_standard_errors(
    variant: Variant, without_faulty: Sequence[FloatArray], without_clean: Sequence[FloatArray]
) -> dict[str, float]:
    """Estimate the standard error of each value of a fault: root of the sum of the jackknife variances of both sets,
    from the sizes with each sixth left out, and of the squared error due to the spacing of the variants."""
    by_set = [[variant.parameters_of(sizes) for sizes in fold_sizes] for fold_sizes in (without_faulty, without_clean)]
    return {
        name: float(
            np.sqrt(variant.grid_error**2 + sum(_estimate_variance([fold[name] for fold in folds]) for folds in by_set))
        )
        for name in by_set[0][0]
    }


def _fit_without_clean_sixths(pairs: Sequence[SetPair], variant: Variant) -> list[FloatArray]:
    """Fit the fault's sizes, with each sixth of the clean set left out in turn."""
    folds = [
        [
            replace(pair, unchanged=(*pair.unchanged[: left_out[0]], *pair.unchanged[left_out[-1] + 1 :]))
            for pair in pairs
        ]
        for left_out in SIXTHS
    ]
    return [fit_sizes(fold, variant).sizes for fold in folds]


def _estimate_variance(values: Sequence[float]) -> float:
    """Estimate the jackknife variance of a number, from its g values with each of g groups left out: (g - 1) / g times
    the sum of their squared deviations."""
    return float((len(values) - 1) * np.var(values))


def _leave_out_sixths(pairs: Sequence[SetPair]) -> list[list[SetPair]]:
    """Leave out each sixth of the faulty set of the pairs in turn."""
    return [
        [replace(pair, undone_blocks=tuple(block for block in ALL_BLOCKS if block not in left_out)) for pair in pairs]
        for left_out in SIXTHS
    ]


def _yield_control_gains(
    compared_bases: Sequence[ComparedBase], fault: Fault, variant: Variant, sizes: FloatArray
) -> Iterator[float]:
    """Yield the fault's gains between stretches of one set (negative control). Clean set: error with nothing undone
    over error with the stretch's own size undone, less 1. Faulty set: the same, with the size found there undone
    everywhere first, because a base that does not fit the faulty rows would give a gain in any stretch. A fault that
    varies with time also differs between stretches of the faulty set, which is then no control."""
    for is_clean in (True,) if fault.varies else (True, False):
        common_sizes = np.zeros_like(sizes) if is_clean else sizes
        recording_sets = [compared.clean if is_clean else compared.faulty for compared in compared_bases]
        by_base = [
            compared.compute_grams(recording_set, undo_fault_in_rows(compared, recording_set, fault, variant))
            for compared, recording_set in zip(compared_bases, recording_sets, strict=True)
        ]
        for stretch in CONTROL_STRETCHES:
            other_blocks = [block for block in ALL_BLOCKS if block not in stretch]
            pairs = [SetPair(grams, stretch, tuple(grams.undo_fault(common_sizes)[other_blocks])) for grams in by_base]
            yield compute_error(pairs, common_sizes) / max(fit_sizes(pairs, variant).error, 1e-300) - 1
