"""The linear part of a force balance: the motion that a force drives, the delay between them, dynamics of higher order.

A lag, a delay, a mode or a relaxation is not missing physics but part of a linear first model. If the balance lacks it,
nonlinear laws are hidden, or others imitate it. Therefore the search for laws is repeated with the linear terms that it
found as part of the base, up to `LINEAR_PART_ROUNDS` searches.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.blocks import blocks_of
from analysis.diagnosis.balance.law import BaseTerms
from analysis.diagnosis.balance.motion import Motion, filter_spectrum
from analysis.diagnosis.balance.regression import Regression, keep_laws, regression_of
from analysis.diagnosis.balance.structures import (
    Structure,
    StructureSearch,
    choose_simplest_structure,
    fit_values,
    improves_significantly,
    refine_parameters,
    search_structures,
)
from analysis.diagnosis.settings import LINEAR_LAW_GAIN, LINEAR_PART_ROUNDS, MOST_LINEAR_LAWS
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

DELAY_PERIODS = 2.0 ** np.arange(-5, 2)
"""Delays that are tried, in periods of the upper end of the band: up to two, beyond which signals repeat."""
DELAY_HALVINGS = 4
"""Number of halvings of the step around the best delay."""
DELAY_LIKE_LAWS = ("amplifier_lag", "transport_delay")
"""Linear laws that are equivalent to a delay."""


def search_with_linear_part(
    motions: Sequence[Motion],
    axis: int,
    rotational: bool,
    without: frozenset[str],
    time_left: TimeBudget,
) -> StructureSearch:
    """Search for laws with `search_structures`; then again with the delay and the linear laws that this search finds as
    part of the base. without: effects that are left out."""
    base_terms = BaseTerms(driven_motion(motions)[axis])
    search = search_structures(motions, axis, rotational, without, time_left, base_terms)
    for _ in range(LINEAR_PART_ROUNDS - 1):
        if not time_left():
            break
        extended = _extend_base(search, base_terms)
        if extended.laws == base_terms.laws and extended.delay_s == base_terms.delay_s:
            break
        base_terms, shifted = extended, [_delay_forces(motion, extended.delay_s) for motion in motions]
        search = search_structures(shifted, axis, rotational, without, time_left, base_terms)
    return search


def driven_motion(motions: Sequence[Motion]) -> tuple[int, ...]:
    """Per force, the channel of the motion that it drives: the channel of the same index, or, where more motions than
    forces were measured, that whose acceleration the regression needs most (linear assignment)."""
    forces, channels = motions[0].force.shape[1], len(motions[0].channels)
    if channels <= forces:
        return tuple(min(axis, channels - 1) for axis in range(forces))
    errors = [_error_without_each(motions, axis, channels) for axis in range(forces)]
    # Imported here: the package takes longer to import than a diagnosis that does not need it.
    from scipy.optimize import linear_sum_assignment

    return tuple(linear_sum_assignment(errors, maximize=True)[1].tolist())


def _error_without_each(motions: Sequence[Motion], axis: int, channels: int) -> list[float]:
    """(places,): cross-validated error over the signal power, without each motion's acceleration."""
    regression = regression_of(motions, axis, (), turns=False)
    all_columns = regression.columns_of(())
    power = max(sum(block.signal for block in regression.fit), 1e-300)
    return [
        float(regression.cross_validated_errors([k for k in all_columns if k != channel]).sum()) / power
        for channel in range(channels)
    ]


def _extend_base(search: StructureSearch, base_terms: BaseTerms) -> BaseTerms:
    """The base with a delay and, where the simplest structure has a linear law, with as many linear laws as
    cross-validation supports. The delay is estimated before or after these laws; the smaller error decides."""
    regression, simplest = search.regression, choose_simplest_structure(search).laws
    nonlinear = [k for k in simplest if not regression.laws[k].linear]
    delay_s = 0.0 if base_terms.delay_s else _find_delay_s(keep_laws(regression, nonlinear))
    if not delay_s and len(nonlinear) == len(simplest):
        return base_terms
    delay_first, error = _complete_base(regression, base_terms, nonlinear, delay_s)
    if not delay_s:
        return delay_first
    laws_first, other_error = _complete_base(regression, base_terms, nonlinear, 0.0)
    return delay_first if error < other_error else laws_first


def _complete_base(
    regression: Regression, base_terms: BaseTerms, nonlinear: Sequence[int], delay_s: float
) -> tuple[BaseTerms, float]:
    """The base with this delay and the linear laws that are significant with it, and its cross-validated error. Where
    the delay is zero, a delay is estimated after these laws. nonlinear: laws that are not linear."""
    base_laws = tuple(law for law in base_terms.laws if not (delay_s and law.effect in DELAY_LIKE_LAWS))
    linear_laws = [law for law in regression.laws if law.linear and not (delay_s and law.effect in DELAY_LIKE_LAWS)]
    motions = [_delay_forces(motion, delay_s) for motion in regression.motions]
    laws = [*(regression.laws[k] for k in nonlinear), *linear_laws]
    extended = regression_of(motions, regression.axis, laws, _turns(regression), replace(base_terms, laws=base_laws))
    chosen = Structure(
        tuple(range(len(nonlinear))), extended.cross_validated_errors(extended.columns_of(range(len(nonlinear))))
    )
    while len(base_laws) + len(chosen.laws) - len(nonlinear) < MOST_LINEAR_LAWS:
        improved = _add_linear_law(extended, chosen)
        if improved is None:
            break
        extended, chosen = improved
    added = [extended.laws[k] for k in chosen.laws if extended.laws[k].linear]
    if not delay_s and not base_terms.delay_s:
        delay_s = _find_delay_s(keep_laws(extended, chosen.laws))
    return replace(base_terms, laws=(*base_laws, *added), delay_s=base_terms.delay_s + delay_s), chosen.error


def _add_linear_law(regression: Regression, chosen: Structure) -> tuple[Regression, Structure] | None:
    """The regression and the structure with the further linear law that gives the smallest error, its parameters
    refined; None where that law is not significant."""
    best: Structure | None = None
    for number, law in enumerate(regression.laws):
        if not law.linear or number in chosen.laws:
            continue
        laws = (*chosen.laws, number)
        trial = Structure(laws, regression.cross_validated_errors(regression.columns_of(laws)))
        if (best is None or trial.error < best.error) and fit_values(regression, laws)[-1] is not None:
            best = trial
    if best is None or not _is_worth_adding(chosen, best):
        return None
    regression = refine_parameters(regression, [best])
    return regression, Structure(best.laws, regression.cross_validated_errors(regression.columns_of(best.laws)))


def _is_worth_adding(base: Structure, extended: Structure) -> bool:
    """Whether a linear term removes `LINEAR_LAW_GAIN` of the error, and significantly."""
    return extended.error < (1 - LINEAR_LAW_GAIN) * base.error and improves_significantly(base, extended)


def _turns(regression: Regression) -> bool:
    """Whether the base has two columns per motion, mass and damping: a shaft that turns freely has no stiffness."""
    return regression.matrices == 2 * len(regression.motions[0].channels)


def _find_delay_s(regression: Regression) -> float:
    """Delay of the motion behind the force, in s: the minimum nearest to zero of the cross-validated error; 0 where it
    is not significant."""
    columns = regression.columns_of(range(len(regression.laws)))

    def errors(seconds: float) -> FloatArray:
        return _with_forces(
            regression, [_delay_forces(motion, seconds) for motion in regression.motions]
        ).cross_validated_errors(columns)

    undelayed, band_hz = regression.cross_validated_errors(columns), regression.motions[0].band_hz
    if not np.isfinite(band_hz):
        return 0.0
    delay_s, best = _nearest_minimum(errors, undelayed, 1 / band_hz)
    return delay_s if delay_s and _is_worth_adding(Structure((), undelayed), Structure((), best)) else 0.0


def _nearest_minimum(
    errors: Callable[[float], FloatArray], undelayed: FloatArray, period_s: float
) -> tuple[float, FloatArray]:
    """Delay in s at the first minimum of the error from delay zero on, and the errors there. Zero where the minimum is
    beyond the range: the motion is then too uniform to distinguish a delay from damping and stiffness. Negative delays
    are not causal and not tried. undelayed: errors at delay zero."""
    best_s, best = 0.0, undelayed
    for share in DELAY_PERIODS:
        trial_errors = errors(float(share) * period_s)
        if trial_errors.sum() >= best.sum():
            break
        best_s, best = float(share) * period_s, trial_errors
    else:
        return 0.0, undelayed
    step_s = best_s / 2
    for _ in range(DELAY_HALVINGS if best_s else 0):
        for other_s in (best_s - step_s, best_s + step_s):
            trial_errors = errors(other_s)
            if trial_errors.sum() < best.sum():
                best_s, best = other_s, trial_errors
                break
        step_s /= 2
    return best_s, best


def _with_forces(regression: Regression, motions: Sequence[Motion]) -> Regression:
    """The regression with the same columns and other forces. motions: as in the regression, but with these forces."""
    targets = [motion.decimate(motion.force[:, [regression.axis]])[:, 0] for motion in motions]
    fit, test = ([motion.valid_samples(mask) for motion, mask in zip(motions, masks, strict=True)] for masks in (
        [motion.fit for motion in motions], [motion.test for motion in motions],
    ))  # fmt: skip
    mean = float(np.concatenate([target[mask] for target, mask in zip(targets, fit, strict=True)]).mean())
    units = regression.scale, mean
    return replace(
        regression, motions=tuple(motions), force=tuple(targets),
        fit=blocks_of(regression.columns, targets, fit, units),
        test=blocks_of(regression.columns, targets, test, units),
    )  # fmt: skip


def _delay_forces(motion: Motion, seconds: float) -> Motion:
    """The motion with its forces delayed: their spectra multiplied by exp(-i omega T), T = seconds."""
    if not seconds:
        return motion
    delayed = filter_spectrum(motion.force, motion.rate_hz, lambda f: np.exp(-2j * np.pi * f * seconds))
    return replace(motion, force=delayed)
