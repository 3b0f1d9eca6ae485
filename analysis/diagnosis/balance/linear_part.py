"""The linear part of a force balance, found together with the laws: which motion a force drives, how late the force
is, and dynamics of a higher order.

A lag, a delay, a mode or a relaxation is no missing physics but a part of the first model. Left out, it hides laws and
poses as them; so the search is done again beside those that it found, until it finds no more.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.blocks import blocks_of
from analysis.diagnosis.balance.law import Beside
from analysis.diagnosis.balance.motion import Motion, filtered
from analysis.diagnosis.balance.plainest_structure import plainest_structure
from analysis.diagnosis.balance.regression import Regression, of_laws, regression_of
from analysis.diagnosis.balance.structures import (
    Searched,
    Structure,
    better,
    refined,
    search_structures,
    values_of,
)
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

WORTH = 0.1
"""Share of the folds' error power that a shift or a linear law must take."""
MOST_BESIDE = 4
"""Linear laws beside mass, damping and stiffness."""
ROUNDS = 2
"""Searches, each beside what the one before it found."""
LATER = 2.0 ** np.arange(-5, 2)
"""Shifts that are tried, over the period of the band's end: up to twice that, beyond which courses repeat;"""
FINER = 4
"""and halvings of the step around the best."""
LATE = ("amplifier_lag", "transport_delay")
"""Laws that say in other words that a force is late."""


def search_beside_linear(
    motions: Sequence[Motion],
    axis: int,
    rotational: bool,
    without: frozenset[str],
    time_left: TimeBudget,
) -> Searched:
    """See `search_structures`."""
    beside = Beside(driven_motion(motions)[axis])
    found = search_structures(motions, axis, rotational, without, time_left, beside)
    for _ in range(ROUNDS - 1):
        if not time_left():
            break
        more = _linear_beside(found, beside)
        if more.laws == beside.laws and more.late_s == beside.late_s:
            break
        beside, shifted = more, [_late(motion, more.late_s) for motion in motions]
        found = search_structures(shifted, axis, rotational, without, time_left, beside)
    return found


def driven_motion(motions: Sequence[Motion]) -> tuple[int, ...]:
    """Per force, the place of the motion that it drives: its own number, or, where more motions were measured, that of
    the body whose acceleration is missed most beside all the others' motion."""
    forces, places = motions[0].force.shape[1], len(motions[0].channels)
    if places <= forces:
        return tuple(min(axis, places - 1) for axis in range(forces))
    missed = [_missed(motions, axis, places) for axis in range(forces)]
    # Imported where it is used: the package takes longer to import than a diagnosis that does without it.
    from scipy.optimize import linear_sum_assignment

    return tuple(linear_sum_assignment(missed, maximize=True)[1].tolist())


def _missed(motions: Sequence[Motion], axis: int, places: int) -> list[float]:
    """By how much the error grows without each motion's acceleration."""
    regression = regression_of(motions, axis, (), turns=False)
    whole = regression.chosen(())
    power = max(sum(block.signal for block in regression.fit), 1e-300)
    return [float(regression.crossed([k for k in whole if k != place]).sum()) / power for place in range(places)]


def _linear_beside(found: Searched, beside: Beside) -> Beside:
    """With the shift, and, where the plainest structure holds a linear law, with as many beside its others as the folds
    ask for; whichever comes first, where the two do not agree."""
    regression, plain = found.regression, plainest_structure(found).laws
    bent = [k for k in plain if not regression.laws[k].linear]
    late_s = 0.0 if beside.late_s else _late_s(of_laws(regression, bent))
    if not late_s and len(bent) == len(plain):
        return beside
    shifted, error = _completed(regression, beside, bent, late_s)
    if not late_s:
        return shifted
    ahead, other = _completed(regression, beside, bent, 0.0)
    return shifted if error < other else ahead


def _completed(regression: Regression, beside: Beside, bent: Sequence[int], late_s: float) -> tuple[Beside, float]:
    """With this shift and the linear laws that are then worth it, or, with none, the shift that is worth it beside
    these; and the folds' error. bent: laws that are not linear."""
    held = tuple(law for law in beside.laws if not (late_s and law.effect in LATE))
    others = [law for law in regression.laws if law.linear and not (late_s and law.effect in LATE)]
    motions = [_late(each, late_s) for each in regression.motions]
    laws = [*(regression.laws[k] for k in bent), *others]
    room = regression_of(motions, regression.axis, laws, _turns(regression), replace(beside, laws=held))
    chosen = Structure(tuple(range(len(bent))), room.crossed(room.chosen(range(len(bent)))))
    while len(held) + len(chosen.laws) - len(bent) < MOST_BESIDE:
        richer = _with_linear(room, chosen)
        if richer is None:
            break
        room, chosen = richer
    more = [room.laws[k] for k in chosen.laws if room.laws[k].linear]
    if not late_s and not beside.late_s:
        late_s = _late_s(of_laws(room, chosen.laws))
    return replace(beside, laws=(*held, *more), late_s=beside.late_s + late_s), chosen.error


def _with_linear(room: Regression, chosen: Structure) -> tuple[Regression, Structure] | None:
    """With the linear law more that leaves least, its numbers refined; None where the folds do not ask for it."""
    best: Structure | None = None
    for number, law in enumerate(room.laws):
        if not law.linear or number in chosen.laws:
            continue
        laws = (*chosen.laws, number)
        tried = Structure(laws, room.crossed(room.chosen(laws)))
        if (best is None or tried.error < best.error) and values_of(room, laws)[-1] is not None:
            best = tried
    if best is None or not _worth(chosen, best):
        return None
    room = refined(room, [best])
    return room, Structure(best.laws, room.crossed(room.chosen(best.laws)))


def _worth(plain: Structure, richer: Structure) -> bool:
    return richer.error < (1 - WORTH) * plain.error and better(plain, richer)


def _turns(regression: Regression) -> bool:
    return regression.matrices == 2 * len(regression.motions[0].channels)


def _late_s(small: Regression) -> float:
    """By how much the force is late: the nearest shift at which folds' errors have a minimum; 0 where the folds do not
    agree that it is worth it."""
    columns = small.chosen(range(len(small.laws)))

    def errors(seconds: float) -> FloatArray:
        return _with_forces(small, [_late(each, seconds) for each in small.motions]).crossed(columns)

    none, band_hz = small.crossed(columns), small.motions[0].band_hz
    if not np.isfinite(band_hz):
        return 0.0
    late_s, best = _nearest(errors, none, 1 / band_hz)
    return late_s if late_s and _worth(Structure((), none), Structure((), best)) else 0.0


def _nearest(errors: Callable[[float], FloatArray], none: FloatArray, period_s: float) -> tuple[float, FloatArray]:
    """Downhill from no shift; no shift where that leads beyond all that are tried: then the motion is too uniform to
    tell a shift from damping and stiffness. A force that acts before it is commanded is no cause."""
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
    """The same columns against other forces. motions: the same but for these."""
    aims = [each.reduced(each.force[:, [regression.axis]])[:, 0] for each in motions]
    fit, test = ([each.kept(mask) for each, mask in zip(motions, masks, strict=True)] for masks in (
        [each.fit for each in motions], [each.test for each in motions],
    ))  # fmt: skip
    mean = float(np.concatenate([aim[mask] for aim, mask in zip(aims, fit, strict=True)]).mean())
    units = regression.scale, mean
    return replace(
        regression, motions=tuple(motions), force=tuple(aims),
        fit=blocks_of(regression.columns, aims, fit, units), test=blocks_of(regression.columns, aims, test, units),
    )  # fmt: skip


def _late(motion: Motion, seconds: float) -> Motion:
    """With forces that come later than they were written down."""
    if not seconds:
        return motion
    turned = filtered(motion.force, motion.rate_hz, lambda f: np.exp(-2j * np.pi * f * seconds))
    return replace(motion, force=turned)
