"""Fit the size of every fault: for each fault, the variant and the size with the smallest error once it is undone.

A fault is a change of the device or its sensors between two sets of recordings. A variant of it has fixed nonlinear
parameters (such as a corner frequency) and an unknown size s. Undoing it changes the recording by s times a known
column: exactly where the fault is linear in s, and to first order otherwise. The size is found by least squares,
jointly with the parameters of the intact device (`joint_products`). Where undoing is not linear, the fault is
linearised again about the size that was found: a Gauss-Newton iteration, which keeps the size with the smallest error.
Called by `rank_faults`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from analysis.diagnosis.contrast.compared_base import ComparedBase, undo_fault_in_rows
from analysis.diagnosis.contrast.fault import Fault, Variant, fix_size
from analysis.diagnosis.contrast.joint_products import SetPair, SizeFit, fit_sizes
from analysis.diagnosis.limits import CONTRAST_BLOCKS, FAULT_SIZE_TOLERANCE, INVERSION_ROUNDS
from analysis.diagnosis.types import TimeBudget

ALL_BLOCKS = tuple(range(CONTRAST_BLOCKS))
"""Numbers of all blocks into which the samples are divided for cross-validation."""
RELINEARISED_VARIANTS = 3
"""Of a fault that is valid at size 1 only: number of its variants, the best at size 1, that are linearised again
besides the best at any size. Chosen by hand."""


class FittedVariant(NamedTuple):
    """A variant of a fault, undone at its best size."""

    fit: SizeFit
    """Fitted sizes, and the sums of squared errors with the fault undone."""
    fault: Fault
    variant: Variant
    """The variant of `fault` that was fitted, possibly linearised about its size."""
    pairs: list[SetPair]
    """Per base (force, sensor or autoregressive model): least-squares products of both sets, with the fault undone."""


@dataclass(frozen=True, slots=True, eq=False)
class FaultFits:
    """Result of `fit_faults`: each fault with its best variant and size, and the products without any fault undone."""

    unchanged_pairs: list[SetPair]
    """Per base, the products of both sets with nothing undone."""
    variants: list[FittedVariant]
    """The best variant of each fault that could be undone, in order of rising error."""
    complete: bool
    """Whether all faults were fitted before the time ran out."""


def fit_faults(compared_bases: Sequence[ComparedBase], faults: Sequence[Fault], time_left: TimeBudget) -> FaultFits:
    """Fit the faults in order, each on all bases together, until the time runs out. Faults of which no variant is
    well-conditioned are left out."""
    clean_blocks_by_base = [compared.compute_grams(compared.clean, []).blocks for compared in compared_bases]
    unchanged_pairs = [
        SetPair(
            compared.compute_grams(compared.faulty, []),
            ALL_BLOCKS,
            tuple(clean_blocks),
            (compared.clean.scale / compared.faulty.scale) ** 2,
        )
        for compared, clean_blocks in zip(compared_bases, clean_blocks_by_base, strict=True)
    ]
    best_variants: list[FittedVariant] = []
    is_complete = False
    for fault in faults:
        if not time_left():
            break
        fitted_variants = [
            fit for variant in fault.variants if (fit := _fit_variant(unchanged_pairs, compared_bases, fault, variant))
        ]
        if fitted_variants:
            best_variants.append(_choose_best_variant(fitted_variants, unchanged_pairs, compared_bases))
    else:
        is_complete = True
    return FaultFits(unchanged_pairs, sorted(best_variants, key=_get_error), is_complete)


def _fit_variant(
    unchanged_pairs: Sequence[SetPair], compared_bases: Sequence[ComparedBase], fault: Fault, variant: Variant
) -> FittedVariant | None:
    """Undo the fault by this variant and fit its sizes; None where undoing it is ill-conditioned. unchanged_pairs: per
    base, the products without any fault undone."""
    pairs = [
        replace(
            pair,
            undone=compared.compute_grams(
                compared.faulty, undo_fault_in_rows(compared, compared.faulty, fault, variant)
            ),
        )
        for compared, pair in zip(compared_bases, unchanged_pairs, strict=True)
    ]
    is_well_conditioned = all(pair.undone.is_well_conditioned(variant) for pair in pairs)
    return FittedVariant(fit_sizes(pairs, variant), fault, variant, pairs) if is_well_conditioned else None


def _get_error(fitted_variant: FittedVariant) -> float:
    """Get the sum of squared errors with the fault undone."""
    return fitted_variant.fit.error


def _choose_best_variant(
    fitted_variants: Sequence[FittedVariant], unchanged_pairs: Sequence[SetPair], compared_bases: Sequence[ComparedBase]
) -> FittedVariant:
    """Choose the variant with the smallest error, after linearisation about its size. Of a fault that is valid at size
    1 only (`Variant.one_size`), several are compared at size 1: at another size, a wrong variant may have the
    smallest error."""
    best_at_any_size = min(fitted_variants, key=_get_error)
    if not best_at_any_size.variant.one_size:
        return _iterate_linearisation(best_at_any_size, unchanged_pairs, compared_bases)
    best_at_size_1 = sorted(fitted_variants, key=lambda fit: _get_error(_fit_allowed_size(fit)))[:RELINEARISED_VARIANTS]
    return min(
        (_iterate_linearisation(fit, unchanged_pairs, compared_bases) for fit in (best_at_any_size, *best_at_size_1)),
        key=_get_error,
    )


def _iterate_linearisation(
    current: FittedVariant, unchanged_pairs: Sequence[SetPair], compared_bases: Sequence[ComparedBase]
) -> FittedVariant:
    """Return the best fit of at most `INVERSION_ROUNDS` Gauss-Newton iterations. Each linearises the fault about the
    size that the last iteration found; in the linearised variant, that size is 1. They end where the fitted size
    differs from 1 by less than `FAULT_SIZE_TOLERANCE`, where undoing is linear or ill-conditioned, and, unless only
    size 1 is valid (`Variant.one_size`), where the error no longer falls."""
    best = _fit_allowed_size(current)
    for _ in range(INVERSION_ROUNDS):
        fit, fault, variant, _ = current
        if variant.at_size is None or abs(float(fit.sizes[0]) - 1) < FAULT_SIZE_TOLERANCE:
            break
        relinearised = _fit_variant(unchanged_pairs, compared_bases, fault, variant.at_size(float(fit.sizes[0])))
        if relinearised is None:
            break
        current, previous_best = relinearised, best
        best = min(best, _fit_allowed_size(current), key=_get_error)
        if best is previous_best and not variant.one_size:
            break
    return best


def _fit_allowed_size(fitted_variant: FittedVariant) -> FittedVariant:
    """Return the variant as fitted, or refit it with its size fixed at 1 where it is valid at size 1 only."""
    _, fault, variant, pairs = fitted_variant
    if not variant.one_size:
        return fitted_variant
    return FittedVariant(fit_sizes(pairs, restrict_sizes(variant)), fault, variant, pairs)


def restrict_sizes(variant: Variant) -> Variant:
    """Fix the size of a variant at 1 where it is valid at size 1 only (`Variant.one_size`); other variants are
    unchanged."""
    return fix_size(variant, 0.0) if variant.one_size else variant
