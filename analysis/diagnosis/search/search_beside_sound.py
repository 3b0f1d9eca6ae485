"""The search beside clean recordings: for effects that these do not show."""

from collections.abc import Sequence
from dataclasses import replace

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.output_error import evaluated
from analysis.diagnosis.errors.standing import standing
from analysis.diagnosis.search.contest import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.learn_clean_floor import Learned, floored
from analysis.diagnosis.search.no_answer import foresees_nothing
from analysis.diagnosis.search.rivalry import Arena, Contender
from analysis.diagnosis.search.search import Searched, searched
from analysis.diagnosis.search.verdict import Judgement
from analysis.diagnosis.settings import EXPLAINED_ERROR, NOISE_ALONE
from analysis.diagnosis.types import Patience, Progress
from equalizer.effects.effect import Effect


def searched_beside_sound(
    arena: Arena, learned: Learned, catalogue: Sequence[Effect], progress: Progress, patient: Patience
) -> Searched:
    """arena: as without sound recordings, but for what is certain. What is found has its residuals by the arena's own
    measure, with what a sound device differs by counted as noise.

    Where much more is left than on a sound device, its colour is of little use: then what is simply larger than that
    is looked for, too, and whichever leaves less stands.
    """
    fine = _by_contrast(arena, learned, catalogue, progress, patient)
    if arena.certain or fine.found.after.standing.seen <= learned.floor.beyond or not patient():
        return fine
    coarse = _by_size(arena, learned, catalogue, progress, patient)
    return coarse if coarse.judged.named and _left(fine.arena, coarse) < _left(fine.arena, fine) else fine


def _left(arena: Arena, seen: Searched) -> float:
    """Mean log error power of what is named, on the samples to fit and to choose by."""
    stands = seen.found.after if seen.judged.named else seen.found.retuned
    fitted = evaluated(arena.measure, arena.tuning, stands.fitted.deviations, stands.fitted.hypothesis)
    return Contender(fitted, standing(arena.measure, fitted.residuals)).standing.chosen_by


def _by_size(
    arena: Arena, learned: Learned, catalogue: Sequence[Effect], progress: Progress, patient: Patience
) -> Searched:
    wide = replace(learned.floor, channels=tuple(learned.floor.beyond * channel for channel in learned.floor.channels))
    plain = floored(arena.whole, wide)
    seen = searched(replace(arena, measure=plain.shortened(), whole=plain), catalogue, progress, patient)
    back = floored(arena.whole, learned.floor).with_records(seen.arena.whole.records)
    own = replace(arena, measure=back.shortened(), whole=back)
    return replace(seen, arena=own, found=_by(own, seen.found))


def _by_contrast(
    arena: Arena, learned: Learned, catalogue: Sequence[Effect], progress: Progress, patient: Patience
) -> Searched:
    plain = floored(arena.whole, learned.floor)
    whole = learned.beside(plain, arena.tuning.model)
    beside = replace(arena, measure=whole.shortened(), whole=whole, sound=learned.sound)
    seen = searched(beside, catalogue, progress, patient)
    plain = plain.with_records(seen.arena.whole.records)
    back = replace(arena, measure=plain.shortened(), whole=plain)
    found = _by(back, seen.found)
    if arena.certain:
        return replace(seen, arena=back, found=found, judged=_judged(found, True, learned.floor.beyond), remarks=())
    named = seen.judged.named and not foresees_nothing(plain, found.after)
    return replace(seen, arena=back, found=found, judged=_judged(found, named, learned.floor.beyond))


def _judged(found: Explanation, named: bool, beyond: float) -> Judgement:
    """The bars are raised by the factor `beyond`, because a sound device differs from day to day, too."""
    if named:
        return Judgement(
            "explained" if found.after.standing.seen <= beyond * EXPLAINED_ERROR else "partly_explained", True
        )
    if found.before.standing.seen <= beyond * NOISE_ALONE:
        return Judgement("no_mismatch", False)
    return Judgement("parameters" if found.retuned.standing.seen <= beyond * NOISE_ALONE else "unexplained", False)


def _by(arena: Arena, found: Explanation) -> Explanation:
    """Effects are chosen on the whitened residual, their numbers fitted on the residual itself: where a law is not
    exact, frequencies with little weight would bias them."""
    after = found.after.fitted
    if after.hypothesis.claims and not arena.certain:
        start = evaluated(arena.measure, arena.tuning, after.deviations, after.hypothesis)
        after = refine(arena, start)
    steps = [*found.steps[:-1], *(replace(step, fitted=after) for step in found.steps[-1:])]
    return replace(
        found,
        before=_seen_by(arena.whole, arena, found.before),
        retuned=_seen_by(arena.whole, arena, found.retuned),
        after=_seen_by(arena.whole, arena, replace(found.after, fitted=after)),
        steps=tuple(_seen_by(arena.measure, arena, step) for step in steps),
    )


def _seen_by(measure: ErrorMeasure, arena: Arena, contender: Contender) -> Contender:
    return replace(
        contender, fitted=evaluated(measure, arena.tuning, contender.fitted.deviations, contender.fitted.hypothesis)
    )
