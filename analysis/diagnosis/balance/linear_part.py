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
    is_better,
    refine_parameters,
    search_structures,
    simplest_structure,
    values_of,
)
from analysis.diagnosis.settings import LINEAR_LAW_GAIN, LINEAR_PART_ROUNDS, MOST_LINEAR_LAWS
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

LATER = 2.0 ** np.arange(-5, 2)
"""Delays that are tried, in periods of the upper end of the band: up to two, beyond which signals repeat."""
FINER = 4
"""Number of halvings of the step around the best delay."""
LATE = ("amplifier_lag", "transport_delay")
"""Linear laws that are equivalent to a delay."""


def search_beside_linear(
    motions: Sequence[Motion],
    axis: int,
    rotational: bool,
    without: frozenset[str],
    time_left: TimeBudget,
) -> StructureSearch:
    """Search for laws with `search_structures`; then again with the delay and the linear laws that this search finds as
    part of the base. without: effects that are left out."""
    beside = BaseTerms(driven_motion(motions)[axis])
    found = search_structures(motions, axis, rotational, without, time_left, beside)
    for _ in range(LINEAR_PART_ROUNDS - 1):
        if not time_left():
            break
        more = _extend_base(found, beside)
        if more.laws == beside.laws and more.delay_s == beside.delay_s:
            break
        beside, shifted = more, [_delay_forces(motion, more.delay_s) for motion in motions]
        found = search_structures(shifted, axis, rotational, without, time_left, beside)
    return found


def driven_motion(motions: Sequence[Motion]) -> tuple[int, ...]:
    """Per force, the channel of the motion that it drives: the channel of the same index, or, where more motions than
    forces were measured, that whose acceleration the regression needs most (linear assignment)."""
    forces, places = motions[0].force.shape[1], len(motions[0].channels)
    if places <= forces:
        return tuple(min(axis, places - 1) for axis in range(forces))
    missed = [_error_without_each(motions, axis, places) for axis in range(forces)]
    # Imported here: the package takes longer to import than a diagnosis that does not need it.
    from scipy.optimize import linear_sum_assignment

    return tuple(linear_sum_assignment(missed, maximize=True)[1].tolist())


def _error_without_each(motions: Sequence[Motion], axis: int, places: int) -> list[float]:
    """(places,): cross-validated error over the signal power, without each motion's acceleration."""
    regression = regression_of(motions, axis, (), turns=False)
    whole = regression.columns_of(())
    power = max(sum(block.signal for block in regression.fit), 1e-300)
    return [
        float(regression.cross_validated_errors([k for k in whole if k != place]).sum()) / power
        for place in range(places)
    ]


def _extend_base(found: StructureSearch, beside: BaseTerms) -> BaseTerms:
    """The base with a delay and, where the simplest structure has a linear law, with as many linear laws as
    cross-validation supports. The delay is estimated before or after these laws; the smaller error decides."""
    regression, plain = found.regression, simplest_structure(found).laws
    bent = [k for k in plain if not regression.laws[k].linear]
    delay_s = 0.0 if beside.delay_s else _find_delay_s(keep_laws(regression, bent))
    if not delay_s and len(bent) == len(plain):
        return beside
    shifted, error = _complete_base(regression, beside, bent, delay_s)
    if not delay_s:
        return shifted
    ahead, other = _complete_base(regression, beside, bent, 0.0)
    return shifted if error < other else ahead


def _complete_base(
    regression: Regression, beside: BaseTerms, bent: Sequence[int], delay_s: float
) -> tuple[BaseTerms, float]:
    """The base with this delay and the linear laws that are significant with it, and its cross-validated error. Where
    the delay is zero, a delay is estimated after these laws. bent: laws that are not linear."""
    held = tuple(law for law in beside.laws if not (delay_s and law.effect in LATE))
    others = [law for law in regression.laws if law.linear and not (delay_s and law.effect in LATE)]
    motions = [_delay_forces(each, delay_s) for each in regression.motions]
    laws = [*(regression.laws[k] for k in bent), *others]
    room = regression_of(motions, regression.axis, laws, _turns(regression), replace(beside, laws=held))
    chosen = Structure(tuple(range(len(bent))), room.cross_validated_errors(room.columns_of(range(len(bent)))))
    while len(held) + len(chosen.laws) - len(bent) < MOST_LINEAR_LAWS:
        richer = _add_linear_law(room, chosen)
        if richer is None:
            break
        room, chosen = richer
    more = [room.laws[k] for k in chosen.laws if room.laws[k].linear]
    if not delay_s and not beside.delay_s:
        delay_s = _find_delay_s(keep_laws(room, chosen.laws))
    return replace(beside, laws=(*held, *more), delay_s=beside.delay_s + delay_s), chosen.error


def _add_linear_law(room: Regression, chosen: Structure) -> tuple[Regression, Structure] | None:
    """The regression and the structure with the further linear law that gives the smallest error, its parameters
    refined; None where that law is not significant."""
    best: Structure | None = None
    for number, law in enumerate(room.laws):
        if not law.linear or number in chosen.laws:
            continue
        laws = (*chosen.laws, number)
        tried = Structure(laws, room.cross_validated_errors(room.columns_of(laws)))
        if (best is None or tried.error < best.error) and values_of(room, laws)[-1] is not None:
            best = tried
    if best is None or not _is_worth_it(chosen, best):
        return None
    room = refine_parameters(room, [best])
    return room, Structure(best.laws, room.cross_validated_errors(room.columns_of(best.laws)))


def _is_worth_it(plain: Structure, richer: Structure) -> bool:
    """Whether a linear term removes `LINEAR_LAW_GAIN` of the error, and significantly."""
    return richer.error < (1 - LINEAR_LAW_GAIN) * plain.error and is_better(plain, richer)


def _turns(regression: Regression) -> bool:
    """Whether the base has two columns per motion, mass and damping: a shaft that turns freely has no stiffness."""
    return regression.matrices == 2 * len(regression.motions[0].channels)


def _find_delay_s(small: Regression) -> float:
    """Delay of the motion behind the force, in s: the minimum nearest to zero of the cross-validated error; 0 where it
    is not significant."""
    columns = small.columns_of(range(len(small.laws)))

    def errors(seconds: float) -> FloatArray:
        return _with_forces(small, [_delay_forces(each, seconds) for each in small.motions]).cross_validated_errors(
            columns
        )

    none, band_hz = small.cross_validated_errors(columns), small.motions[0].band_hz
    if not np.isfinite(band_hz):
        return 0.0
    delay_s, best = _nearest_minimum(errors, none, 1 / band_hz)
    return delay_s if delay_s and _is_worth_it(Structure((), none), Structure((), best)) else 0.0


def _nearest_minimum(
    errors: Callable[[float], FloatArray], none: FloatArray, period_s: float
) -> tuple[float, FloatArray]:
    """Delay in s at the first minimum of the error from delay zero on, and the errors there. Zero where the minimum is
    beyond the range: the motion is then too uniform to distinguish a delay from damping and stiffness. Negative delays
    are not causal and not tried. none: errors at delay zero."""
    best_s, best = 0.0, none
    for share in LATER:
        left = errors(float(share) * period_s)
        if left.sum() >= best.sum():
            break
        best_s, best = float(share) * period_s, left
    else:
        return 0.0, none
    step_s = best_s / 2
    for _ in range(FINER if best_s else 0):
        for other_s in (best_s - step_s, best_s + step_s):
            left = errors(other_s)
            if left.sum() < best.sum():
                best_s, best = other_s, left
                break
        step_s /= 2
    return best_s, best


def _with_forces(regression: Regression, motions: Sequence[Motion]) -> Regression:
    """The regression with the same columns and other forces. motions: as in the regression, but with these forces."""
    aims = [each.decimate(each.force[:, [regression.axis]])[:, 0] for each in motions]
    fit, test = ([each.valid_samples(mask) for each, mask in zip(motions, masks, strict=True)] for masks in (
        [each.fit for each in motions], [each.test for each in motions],
    ))  # fmt: skip
    mean = float(np.concatenate([aim[mask] for aim, mask in zip(aims, fit, strict=True)]).mean())
    units = regression.scale, mean
    return replace(
        regression, motions=tuple(motions), force=tuple(aims),
        fit=blocks_of(regression.columns, aims, fit, units), test=blocks_of(regression.columns, aims, test, units),
    )  # fmt: skip


def _delay_forces(motion: Motion, seconds: float) -> Motion:
    """The motion with its forces delayed: their spectra multiplied by exp(-i omega T), T = seconds."""
    if not seconds:
        return motion
    turned = filter_spectrum(motion.force, motion.rate_hz, lambda f: np.exp(-2j * np.pi * f * seconds))
    return replace(motion, force=turned)
