"""The search without clean recordings; repeated with half of the sealed samples where only they show a mismatch."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.effect_words import noun_of
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.search.explain import Explanation, explain
from analysis.diagnosis.search.no_answer import foresees_nothing
from analysis.diagnosis.search.patience import OUT_OF_TIME, always
from analysis.diagnosis.search.prune import pruned
from analysis.diagnosis.search.rivalry import Arena
from analysis.diagnosis.search.verdict import Judgement, judge
from analysis.diagnosis.settings import SEALED_ALONE_ERROR, SEALED_ALONE_TIMES
from analysis.diagnosis.types import Patience, Progress
from equalizer.effects.effect import Effect
from equalizer.signals.signal import FloatArray

OPENED = (
    "What was kept for the test shows something that the rest of the recording does not hold: the first half of each "
    "such stretch was used to find it, the second half to confirm it."
)
NOT_SHOWN = "What was kept for the test shows a mismatch that the rest of the recording does not hold."


ONLY_REFINES = (
    "What explains it best is a law that was to be left out. Laws that hold it as a special case explain it as well, "
    "but what they add to it does not show, so none of them is named."
)


@dataclass(frozen=True, slots=True, eq=False)
class Unconfirmed:
    """What was found and is not named."""

    hypothesis: Hypothesis
    gain: float
    """Share of the held-out error power that goes with it."""
    why_not: str


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    arena: Arena
    """With the samples as they were used in the end."""
    found: Explanation
    judged: Judgement
    remarks: tuple[str, ...] = ()
    errors: FloatArray | None = None
    """`final_errors`, where the search needed them."""
    unconfirmed: tuple[Unconfirmed, ...] = ()
    """The largest gain first."""


def searched(arena: Arena, catalogue: Sequence[Effect], progress: Progress, patient: Patience = always) -> Searched:
    found = _pruned(arena, explain(arena, catalogue, progress, patient), patient)
    judged = _judged(arena, found)
    if found.ended_early or found.barred or judged.named or not _sealed_alone(found):
        return Searched(arena, found, judged, _remarks(found))
    half = arena.half_opened()
    again = _pruned(half, explain(half, catalogue, progress, patient), patient)
    second = _judged(half, again)
    if second.named:
        return Searched(half, again, second, (OPENED, *_remarks(again)))
    return Searched(arena, found, replace(judged, verdict="unexplained"), (NOT_SHOWN, *_remarks(found)))


def _pruned(arena: Arena, found: Explanation, patient: Patience) -> Explanation:
    """Nothing is named whose last look crashes."""
    nothing = replace(found, after=found.retuned, steps=())
    newest = found.steps[-1].newest if found.steps else ""
    return arena.guard.part(newest, "its last look", lambda: pruned(arena, found, patient), nothing)


def _remarks(found: Explanation) -> tuple[str, ...]:
    early = (OUT_OF_TIME,) if found.ended_early else ()
    barred = (ONLY_REFINES,) if found.barred else ()
    return early + barred + (_left_open(found.undetermined) if found.undetermined else ())


def _left_open(names: Sequence[str]) -> tuple[str, ...]:
    return tuple(
        f"An explanation by {noun_of(name)} is not named: these recordings leave its numbers as good as open."
        for name in dict.fromkeys(names)
    )


def _judged(arena: Arena, found: Explanation) -> Judgement:
    judged = judge(found)
    if judged.named and foresees_nothing(arena.whole, found.after):
        return Judgement("unexplained", False)
    return judged


def _sealed_alone(found: Explanation) -> bool:
    shown = float(np.nanmax(found.retuned.standing.test, initial=0.0))
    return shown > SEALED_ALONE_ERROR and shown > SEALED_ALONE_TIMES * found.retuned.standing.seen
