"""The search for what a recording holds that recordings of the sound device do not."""

from collections.abc import Sequence
from dataclasses import replace

from analysis.diagnosis.error_measure import ErrorMeasure
from analysis.diagnosis.explain import CLEAN, Explanation, Progress
from analysis.diagnosis.learn_clean_floor import Learned, floored
from analysis.diagnosis.no_answer import foresees_nothing
from analysis.diagnosis.output_error import evaluated
from analysis.diagnosis.patience import Patience
from analysis.diagnosis.rivalry import Arena, Contender, refine
from analysis.diagnosis.search import Searched, searched
from analysis.diagnosis.verdict import EXPLAINED, Judgement
from equalizer.effects.effect import Effect


def searched_beside_sound(
    arena: Arena, learned: Learned, catalogue: Sequence[Effect], progress: Progress, patient: Patience
) -> Searched:
    """arena: as without sound recordings, but for what is certain. What is found has its residuals by the arena's own
    measure, with what a sound device differs by counted as noise, and stands as beside the sound recordings."""
    plain = floored(arena.whole, learned.floor)
    whole = learned.beside(plain, arena.tuning.model)
    beside = replace(arena, measure=whole.shortened(), whole=whole, sound=learned.sound)
    seen = searched(beside, catalogue, progress, patient)
    plain = plain.with_records(seen.arena.whole.records)
    back = replace(arena, measure=plain.shortened(), whole=plain)
    found, named = _by(back, seen.found), seen.judged.named
    if not named or foresees_nothing(plain, found.after):
        found, named = _certain_alone(back, found), bool(arena.certain)
    return replace(seen, arena=back, found=found, judged=_judged(found, named, learned.floor.beyond))


def _certain_alone(arena: Arena, found: Explanation) -> Explanation:
    count = len(arena.certain)
    if not count:
        return found
    last = _seen_by(arena.whole, arena, found.steps[count - 1])
    return replace(found, after=last, rounds=found.rounds[:count], steps=found.steps[:count])


def _judged(found: Explanation, named: bool, beyond: float) -> Judgement:
    """How far the device is from sound is judged by more than it differed by then: days differ, too."""
    if named:
        return Judgement("explained" if found.after.standing.seen <= beyond * EXPLAINED else "partly_explained", True)
    if found.before.standing.seen <= beyond * CLEAN:
        return Judgement("no_mismatch", False)
    return Judgement("parameters" if found.retuned.standing.seen <= beyond * CLEAN else "unexplained", False)


def _by(arena: Arena, found: Explanation) -> Explanation:
    """The colour tells effects apart. Their numbers are those that bring the course itself closest: where a law is not
    exact, what the colour makes little of would pull at them."""
    after = found.after.fitted
    if after.hypothesis.claims and not arena.certain:
        start = evaluated(arena.measure, arena.tuning, after.deviations, after.hypothesis)
        after = refine(arena, start)
    steps = [*found.steps[:-1], *(replace(one, fitted=after) for one in found.steps[-1:])]
    return replace(
        found,
        before=_seen_by(arena.whole, arena, found.before),
        retuned=_seen_by(arena.whole, arena, found.retuned),
        after=_seen_by(arena.whole, arena, replace(found.after, fitted=after)),
        steps=tuple(_seen_by(arena.measure, arena, one) for one in steps),
    )


def _seen_by(measure: ErrorMeasure, arena: Arena, one: Contender) -> Contender:
    return replace(one, fitted=evaluated(measure, arena.tuning, one.fitted.deviations, one.fitted.hypothesis))
