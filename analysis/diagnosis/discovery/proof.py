"""What a law without a name must pass before it may be said: each check that fails is a sentence.

A law that fits is not yet a law: with so many shapes some fit anything. It is named only where stretches of another
kind than those it was found in bear it out, where its numbers are the same in every stretch, where the same search in a
shuffled force finds nothing, and where no law of other variables does as well.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.discovery.discover import Discovered, Round
from analysis.diagnosis.discovery.grammar import AXES
from analysis.diagnosis.discovery.sums import Sum
from analysis.diagnosis.search.same_within_errors import excess, inseparable
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.settings import LAW_BEATS, LAW_PLACEBO, LAW_STABLE
from equalizer.laws.law import Law
from equalizer.signals.recording import Segment
from equalizer.signals.signal import FloatArray

SAME_KIND = (
    "nothing that was kept for the test is of another kind than what it was found in: louder, or on several axes"
)


def failed(of: Discovered, records: Sequence[Observed]) -> tuple[str, ...]:
    """Why the laws are candidates and no more; empty where they pass."""
    return tuple(_failed(of, records))


def _failed(of: Discovered, records: Sequence[Observed]) -> Iterator[str]:
    if not tested_otherwise(records):
        yield SAME_KIND
    for number, found in enumerate(of.rounds):
        first = found.sums[0]
        if first.spread > LAW_STABLE:
            yield f"its numbers differ by {100 * first.spread:.0f} % from stretch to stretch"
        if found.placebo > LAW_PLACEBO:
            yield f"in a shuffled force the same search finds {100 * found.placebo:.0f} % of it"
        for other in _alike(found):
            yield f"a law of {' and '.join(other)} does as well"
        if number and not of.found.steps[number].score.mean_log_error < of.found.steps[number - 1].score.mean_log_error:
            yield "it brings nothing beside the law before it"


def _alike(found: Round) -> Iterator[tuple[str, ...]]:
    """Variables of laws that leave hardly more, and are not those of the first."""
    best = found.fitted_candidates[0]
    for candidate, each in zip(found.fitted_candidates[1:], found.sums[1:], strict=True):
        if inseparable(best, candidate) and _variables(each) != _variables(found.sums[0]):
            yield _variables(each)


def _variables(of: Sum) -> tuple[str, ...]:
    names = {
        name
        for term in of.terms
        for name in Law(
            f"p{len(term.numbers)}*{term.shape}", (*term.numbers, 1.0), (), "force", AXES[of.axis]
        ).variables
    }
    return tuple(sorted(names))


def beats(law: FittedCandidate, rival: FittedCandidate) -> bool:
    """Whether a law leaves so much less than a named effect, on sealed samples too, that the name is not believed. Both
    confirmed."""
    sealed, other = (float(np.mean(np.log(each.score.test))) for each in (law, rival))
    if np.isfinite(sealed) and sealed >= other:
        return False
    return excess(law) <= LAW_BEATS * excess(rival)


def tested_otherwise(records: Sequence[Observed]) -> bool:
    """Whether anything sealed is louder, of another kind, or drives other axes together than what laws are found in."""
    found: list[tuple[str, tuple[int, ...], float]] = []
    sealed: list[tuple[str, tuple[int, ...], float]] = []
    for record in records:
        for segment in record.recording.segments:
            part = slice(segment.start, segment.stop)
            told = _told(segment, record.command[part])
            (sealed if record.test[part].any() else found).append(told)
    kinds = {(kind, axes) for kind, axes, _ in found}
    loudest = max((level for _, _, level in found), default=np.inf)
    return any((kind, axes) not in kinds or level > 1.05 * loudest for kind, axes, level in sealed)


def _told(segment: Segment, command: FloatArray) -> tuple[str, tuple[int, ...], float]:
    driven = np.flatnonzero(np.abs(command).max(axis=0, initial=0.0) > 0)
    return segment.kind, tuple(driven.tolist()), float(np.abs(command).max(initial=0.0))
