"""The linear part of a force balance: the motion that a force drives, the delay between them, dynamics of higher order.

A lag, a delay, a mode or a relaxation is not missing physics but part of a linear first model. If the balance lacks it,
nonlinear laws are not found, or wrong ones are fitted in its place. Therefore the search for laws is repeated with the
linear terms that it found as part of the base, up to `LINEAR_PART_ROUNDS` searches."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.fft import rfftfreq

from analysis.diagnosis.balance.blocks import build_blocks
from analysis.diagnosis.balance.change_laws import keep_laws
from analysis.diagnosis.balance.laws.law import BaseTerms
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.balance.regression import Regression, build_regression
from analysis.diagnosis.balance.structures import (
    Structure,
    StructureSearch,
    choose_simplest_structure,
    fit_values,
    improves_significantly,
    refine_parameters,
    search_structures,
)
from analysis.diagnosis.limits import LINEAR_LAW_GAIN, LINEAR_PART_ROUNDS, MOST_LINEAR_LAWS
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.band_limited import filter_spectrum
from equalizer.signals.signal import FloatArray

TRIAL_DELAY_PERIODS = 2.0 ** np.arange(-5, 2)
"""Delays that are tried in ascending order, in periods of the upper end of the band: from 1/32 to two. Chosen by
hand."""
DELAY_HALVINGS = 4
"""Number of halvings of the step around the best delay: the last step is 1/16 of the delay at the first minimum.
Chosen by hand."""
DELAY_LIKE_LAWS = ("amplifier_lag", "transport_delay")
"""Linear laws that are equivalent to a delay."""


def search_with_linear_part(
    motions: Sequence[Motion],
    axis: int,
    rotational: bool,
    excluded_effects: frozenset[str],
    time_left: TimeBudget,
) -> StructureSearch:
    """Search for laws with `search_structures`; then again with the delay and the linear laws that this search finds as
    part of the base, until it finds no further ones. excluded_effects: names. time_left: the search ends where it
    returns False."""
    base_terms = BaseTerms(find_driven_channels(motions)[axis])
    search = search_structures(motions, axis, rotational, excluded_effects, time_left, base_terms)
    for _ in range(LINEAR_PART_ROUNDS - 1):
        if not time_left():
            break
        extended_terms = _extend_base(search, base_terms)
        if extended_terms.laws == base_terms.laws and extended_terms.delay_s == base_terms.delay_s:
            break
        base_terms, shifted_motions = (
            extended_terms,
            [_delay_forces(motion, extended_terms.delay_s) for motion in motions],
        )
        search = search_structures(shifted_motions, axis, rotational, excluded_effects, time_left, base_terms)
    return search


def find_driven_channels(motions: Sequence[Motion]) -> tuple[int, ...]:
    """Find, per force, the channel of the motion that it drives: the channel of the same index or else the last, or,
    where more motions than forces were measured, that of `assign_channels`."""
    force_count, channel_count = motions[0].force.shape[1], len(motions[0].channels)
    if channel_count <= force_count:
        return tuple(min(axis, channel_count - 1) for axis in range(force_count))
    return assign_channels(motions)


def assign_channels(motions: Sequence[Motion]) -> tuple[int, ...]:
    """Assign to each force the channel whose acceleration its regression needs most (linear assignment). motions: with
    at least as many channels as forces."""
    force_count, channel_count = motions[0].force.shape[1], len(motions[0].channels)
    errors = [compute_errors_without_channel(motions, axis, channel_count) for axis in range(force_count)]
    # Imported here: most diagnoses do not need this slow import.
    from scipy.optimize import linear_sum_assignment

    return tuple(linear_sum_assignment(errors, maximize=True)[1].tolist())


def compute_errors_without_channel(motions: Sequence[Motion], axis: int, channel_count: int) -> list[float]:
    """Compute, per channel, the cross-validated squared error without that channel's acceleration, over the power of
    the force about its mean."""
    regression = build_regression(motions, axis, (), turns_freely=False)
    all_columns = regression.select_columns(())
    signal_power = max(sum(block.centred_power for block in regression.fit), 1e-300)
    return [
        float(regression.cross_validate([k for k in all_columns if k != channel]).sum()) / signal_power
        for channel in range(channel_count)
    ]


def _extend_base(search: StructureSearch, base_terms: BaseTerms) -> BaseTerms:
    """Extend the base by a delay and, where the simplest structure has a linear law or a delay is found, by as many
    linear laws as cross-validation supports. The delay is estimated before or after these laws; the smaller error
    decides."""
    regression, simplest_laws = search.regression, choose_simplest_structure(search).laws
    nonlinear_laws = [k for k in simplest_laws if not regression.laws[k].is_linear]
    delay_s = 0.0 if base_terms.delay_s else _find_delay_s(keep_laws(regression, nonlinear_laws))
    if not delay_s and len(nonlinear_laws) == len(simplest_laws):
        return base_terms
    base_with_delay_first, delay_first_error = _complete_base(regression, base_terms, nonlinear_laws, delay_s)
    if not delay_s:
        return base_with_delay_first
    base_with_laws_first, laws_first_error = _complete_base(regression, base_terms, nonlinear_laws, 0.0)
    return base_with_delay_first if delay_first_error < laws_first_error else base_with_laws_first


def _complete_base(
    regression: Regression, base_terms: BaseTerms, nonlinear_laws: Sequence[int], delay_s: float
) -> tuple[BaseTerms, float]:
    """Extend the base by this delay and the linear laws that are significant with it, up to `MOST_LINEAR_LAWS`; returns
    it with its cross-validated error without a later delay. Where there is no delay yet, one is estimated after these
    laws. nonlinear_laws: indices of the chosen laws that are not linear."""
    base_laws = tuple(law for law in base_terms.laws if not (delay_s and law.effect in DELAY_LIKE_LAWS))
    linear_laws = [law for law in regression.laws if law.is_linear and not (delay_s and law.effect in DELAY_LIKE_LAWS)]
    motions = [_delay_forces(motion, delay_s) for motion in regression.motions]
    candidate_laws = [*(regression.laws[k] for k in nonlinear_laws), *linear_laws]
    extended_regression = build_regression(
        motions, regression.axis, candidate_laws, is_freely_turning(regression), replace(base_terms, laws=base_laws)
    )
    chosen_structure = Structure(
        tuple(range(len(nonlinear_laws))),
        extended_regression.cross_validate(extended_regression.select_columns(range(len(nonlinear_laws)))),
    )
    while len(base_laws) + len(chosen_structure.laws) - len(nonlinear_laws) < MOST_LINEAR_LAWS:
        improved_fit = _add_linear_law(extended_regression, chosen_structure)
        if improved_fit is None:
            break
        extended_regression, chosen_structure = improved_fit
    added_laws = [extended_regression.laws[k] for k in chosen_structure.laws if extended_regression.laws[k].is_linear]
    if not delay_s and not base_terms.delay_s:
        delay_s = _find_delay_s(keep_laws(extended_regression, chosen_structure.laws))
    return replace(
        base_terms, laws=(*base_laws, *added_laws), delay_s=base_terms.delay_s + delay_s
    ), chosen_structure.error


def _add_linear_law(regression: Regression, base_structure: Structure) -> tuple[Regression, Structure] | None:
    """Add the linear law that gives the smallest error, with its parameters refined; None where that law is not
    significant."""
    best_structure: Structure | None = None
    for law_index, law in enumerate(regression.laws):
        if not law.is_linear or law_index in base_structure.laws:
            continue
        law_indices = (*base_structure.laws, law_index)
        trial_structure = Structure(law_indices, regression.cross_validate(regression.select_columns(law_indices)))
        if (best_structure is None or trial_structure.error < best_structure.error) and fit_values(
            regression, law_indices
        )[-1] is not None:
            best_structure = trial_structure
    if best_structure is None or not _is_worth_adding(base_structure, best_structure):
        return None
    regression = refine_parameters(regression, [best_structure])
    return regression, Structure(
        best_structure.laws, regression.cross_validate(regression.select_columns(best_structure.laws))
    )


def _is_worth_adding(base: Structure, extended: Structure) -> bool:
    """Whether a linear term removes more than `LINEAR_LAW_GAIN` of the cross-validated error, and significantly."""
    return extended.error < (1 - LINEAR_LAW_GAIN) * base.error and improves_significantly(base, extended)


def is_freely_turning(regression: Regression) -> bool:
    """Whether the base has two columns per motion, mass and damping: a shaft that turns freely has no stiffness."""
    return regression.matrix_column_count == 2 * len(regression.motions[0].channels)


def _find_delay_s(regression: Regression) -> float:
    """Estimate the delay in s from the force to the motion: the minimum nearest to zero of the cross-validated error; 0
    where it is not significant (`_is_worth_adding`), and without a time axis."""
    columns = regression.select_columns(range(len(regression.laws)))

    def compute_errors(trial_delay_s: float) -> FloatArray:
        return _replace_forces(
            regression, [_delay_forces(motion, trial_delay_s) for motion in regression.motions]
        ).cross_validate(columns)

    undelayed_errors, band_hz = regression.cross_validate(columns), regression.motions[0].band_hz
    if not np.isfinite(band_hz):
        return 0.0
    delay_s, delayed_errors = _find_nearest_minimum(compute_errors, undelayed_errors, 1 / band_hz)
    return (
        delay_s if delay_s and _is_worth_adding(Structure((), undelayed_errors), Structure((), delayed_errors)) else 0.0
    )


def _find_nearest_minimum(
    compute_errors: Callable[[float], FloatArray], undelayed_errors: FloatArray, period_s: float
) -> tuple[float, FloatArray]:
    """Find the delay in s at the first minimum of the error from delay zero on, and the errors there. Zero where the
    minimum is beyond the range: the motion is then too uniform to distinguish a delay from damping and stiffness.
    Negative delays are not causal and not tried. undelayed_errors: at delay zero."""
    best_delay_s, best_errors = 0.0, undelayed_errors
    for delay_periods in TRIAL_DELAY_PERIODS:
        trial_errors = compute_errors(float(delay_periods) * period_s)
        if trial_errors.sum() >= best_errors.sum():
            break
        best_delay_s, best_errors = float(delay_periods) * period_s, trial_errors
    else:
        return 0.0, undelayed_errors
    step_s = best_delay_s / 2
    for _ in range(DELAY_HALVINGS if best_delay_s else 0):
        for trial_s in (best_delay_s - step_s, best_delay_s + step_s):
            trial_errors = compute_errors(trial_s)
            if trial_errors.sum() < best_errors.sum():
                best_delay_s, best_errors = trial_s, trial_errors
                break
        step_s /= 2
    return best_delay_s, best_errors


def _replace_forces(regression: Regression, motions: Sequence[Motion]) -> Regression:
    """Replace the forces of a regression; columns and scales stay. motions: those of the regression with new forces."""
    forces = [motion.decimate(motion.force[:, [regression.axis]])[:, 0] for motion in motions]
    fit_masks, test_masks = (
        [motion.mask_valid_samples(mask) for motion, mask in zip(motions, masks, strict=True)]
        for masks in ([motion.fit for motion in motions], [motion.test for motion in motions])
    )
    mean_force = float(np.concatenate([force[mask] for force, mask in zip(forces, fit_masks, strict=True)]).mean())
    scale_and_mean = regression.scale, mean_force
    return replace(
        regression, motions=tuple(motions), force=tuple(forces),
        fit=build_blocks(regression.columns, forces, fit_masks, scale_and_mean),
        test=build_blocks(regression.columns, forces, test_masks, scale_and_mean),
    )  # fmt: skip


def _delay_forces(motion: Motion, delay_s: float) -> Motion:
    """Delay the forces of a motion: multiply their spectra by exp(-i omega delay_s)."""
    if not delay_s:
        return motion

    def compute_delay_response(length: int) -> FloatArray:
        """Compute the frequency response (lines,) of the delay."""
        return np.asarray(np.exp(-2j * np.pi * rfftfreq(length, 1 / motion.rate_hz) * delay_s))

    return replace(motion, force=filter_spectrum(motion.force, compute_delay_response))
