"""What a finished search allows to be said: nothing is missing, parameters were off, physics is named, or is not."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from analysis.diagnosis.document import Verdict
from analysis.diagnosis.search.explain import CLEAN, Explanation
from analysis.diagnosis.search.rivalry import Contender
from analysis.diagnosis.search.same_within_errors import excess

EXPLAINED = 1.12
"""In the worst channel, errors of so many times the noise are as good as none: laws of real physics are never exact."""
CONVINCING, CONVINCED = 0.93, 1.3
"""So are errors of so many times the noise (second) where the explanation takes so much of the mismatch (first), in
logarithms of power: a force that flips its sign leaves a blow where the real one is a little rounder."""
HELD_OUT = 1.5
"""Nor does anything count as explained with so many times the noise on samples that nothing was fitted to. On the bank
from 93000 on, 169 of 172 right explanations stayed below, and three of nine wrong ones did not."""
NEARLY = 3.0
"""With errors up to so many times the noise, what was found is named beside a remainder;"""
MOSTLY = 0.9
"""with larger ones, where it explains so much of the logarithm of the mismatch,"""
BULK = 1.6
"""or takes so much of the logarithm of its power, four fifths of it: where noise is small beside all physics, no law is
exact enough for the former."""

BY_CHANCE = 2.5
"""With a statistic instead of samples, errors of so many times what chance makes of it are as good as none: no law of a
contact is exact."""
CONFIRMED = 0.3
"""Share of the mismatch, in logarithms, that must fall on samples that nothing was fitted to or chosen by;"""
UNSEEN = 0.05
"""unless it hardly shows in them."""


@dataclass(frozen=True, slots=True)
class Judgement:
    verdict: Verdict
    named: bool
    """The effects of `Explanation.after` are to be named."""


def judge(found: Explanation) -> Judgement:
    """By what decisions may see; the sealed samples can only take a name, or `explained`, away."""
    if not found.after.fitted.hypothesis.claims or not _confirmed(found):
        if found.before.standing.seen <= CLEAN:
            return Judgement("no_mismatch", False)
        return Judgement("parameters" if found.retuned.standing.seen <= CLEAN else "unexplained", False)
    if found.statistic is not None:
        return Judgement("explained" if found.after.standing.seen <= BY_CHANCE else "partly_explained", True)
    if as_good_as_noise(found) and not np.nanmax(found.after.standing.test, initial=0.0) > HELD_OUT:
        return Judgement("explained", True)
    return Judgement("partly_explained", True) if worth_naming(found) else Judgement("unexplained", False)


def as_good_as_noise(found: Explanation) -> bool:
    """On what decisions may see."""
    worst = found.after.standing.seen
    return worst <= EXPLAINED or (worst <= CONVINCED and share_of_mismatch(found.retuned, found.after) >= CONVINCING)


def worth_naming(found: Explanation) -> bool:
    """Beside a remainder; on what decisions may see."""
    taken = found.retuned.standing.chosen_by - found.after.standing.chosen_by
    share = share_of_mismatch(found.retuned, found.after)
    return found.after.standing.seen <= NEARLY or share >= MOSTLY or taken >= BULK


def _confirmed(found: Explanation) -> bool:
    """Whether the sealed samples agree that something was explained; yes where nothing was sealed."""
    without, with_it = (np.log(one.standing.test) for one in (found.retuned, found.after))
    whole, left = float(np.mean(without)), float(np.mean(with_it))
    if not np.isfinite(whole):
        return True
    return whole <= UNSEEN or whole - left >= CONFIRMED * whole


def share_of_mismatch(without: Contender, with_it: Contender) -> float:
    """Between 0 and 1: how far the errors came down from where they were to the noise, in logarithms of power."""
    whole = excess(without)
    return min(max(1 - excess(with_it) / whole, 0.0), 1.0) if whole > 0 else 0.0


def shares_taken(without: Contender, steps: Sequence[Contender]) -> tuple[float, ...]:
    """Of the mismatch that was there without any of them, what each step took away: together no more than all."""
    left = [0.0, *(share_of_mismatch(without, one) for one in steps)]
    return tuple(max(after - before, 0.0) for before, after in pairwise(left))
