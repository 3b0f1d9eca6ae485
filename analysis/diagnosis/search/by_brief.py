"""First fits where a drive repeats: laws are compared on one period of each segment, the best then on all samples."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.errors.output_error import Fitted, evaluated
from analysis.diagnosis.search.brief import Brief
from analysis.diagnosis.search.rivalry import FITTING, SCREENING, Arena, first_fits, sensitivity_at
from analysis.diagnosis.search.screening import Screened, screen
from analysis.diagnosis.settings import WORTH_FITTING


def fits_by_brief(
    arena: Arena, brief: Brief, base: Fitted, timeless: Sequence[Hypothesis], timed: Sequence[Hypothesis]
) -> list[Fitted]:
    """On all samples, the best first. timed: what hangs on when a sample was taken, which the brief cannot judge."""
    short, guard = brief.arena, arena.guard
    there = evaluated(short.measure, short.tuning, base.deviations, base.hypothesis)
    known = sensitivity_at(short, base.deviations, base.hypothesis)
    screened = screen(short.measure, short.tuning, there, known, timeless, guard.over(short.map_, SCREENING))

    def whole(fitted: Fitted) -> Fitted:
        return evaluated(arena.measure, arena.tuning, fitted.deviations, fitted.hypothesis)

    each = guard.over(arena.map_, FITTING)
    fits: list[Fitted] = list(each(whole, first_fits(short, there, known, screened)))  # type: ignore[arg-type]
    if timed:
        # What the model's own numbers do repeats all the same.
        repeats = brief.repeated(known)
        screened = screen(arena.measure, arena.tuning, base, repeats, timed, guard.over(arena.map_, SCREENING))
        fits += first_fits(arena, base, repeats, _promising(base, fits, screened))
    # A law that the brief leaves open may run away on the whole.
    return sorted((law for law in fits if np.isfinite(law.cost)), key=lambda found: found.cost)


def _promising(base: Fitted, fits: Sequence[Fitted], screened: Sequence[Screened]) -> list[Screened]:
    """Those that foresee as much of the best gain so far as a first fit asks for."""
    best = max((base.cost - law.cost for law in fits), default=0.0)
    return [law for law in screened if base.cost - law.cost >= max(WORTH_FITTING * best, 0.0)]
