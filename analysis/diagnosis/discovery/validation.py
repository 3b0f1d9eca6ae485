"""Checks that a discovered law must pass before it is named; each check that fails gives a sentence.

With so many formulas some fit anything. A law is named only where held-out stretches of another kind than those it was
found in confirm it (extrapolation), where its parameters are the same in every stretch (stability), where the same
search in a shuffled force finds nothing (negative control), and where no law of other variables fits as well.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.confirm.held_out_gain import held_out_gain
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.discovery.antisymmetric_pairs import is_taken_by_coupling
from analysis.diagnosis.discovery.discover import Discovery, Round
from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.law_of_sum import law_of_sum, laws_of
from analysis.diagnosis.discovery.snap_exponents import snap_exponents
from analysis.diagnosis.effect_words import noun_of
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import inseparable
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.settings import LAW_PLACEBO, LAW_SAME, LAW_STABLE, LOUDER, NOISE_KNOWN_TO
from analysis.wording import conjoin
from equalizer.effects.discovered_law import axis_names
from equalizer.signals.recording import Segment
from equalizer.signals.signal import FloatArray

SAME_KIND = (
    "the held-out data contain no other kind of excitation than the data in which it was found, such as a stronger "
    "one or one on several axes"
)

HALF_TAKEN = (
    "the model's own coupled damping or stiffness, which acts on both axes alike, can explain half of such a force: "
    "a force on one axis and an antisymmetric pair of half its size fit equally well"
)


def reasons_against(context: SearchContext, of: Discovery, rivals: Sequence[FittedCandidate]) -> tuple[str, ...]:
    """Why the laws are only candidates; empty where they pass. rivals: the best of the catalogue, with held-out
    error."""
    return tuple(dict.fromkeys(_reasons_against(context, of, rivals)))


def choose_on_held_out(context: SearchContext, of: Discovery) -> Discovery:
    """With, in place of the last law, that of the laws of one term which fitted alike whose held-out error is surely
    smaller: curves that agree where they were fitted part on louder commands. They are a handful, fixed before, and
    the one that is chosen must pass all other checks."""
    last, best, alike = of.rounds[-1], of.found.after, 1
    chosen = last.sums[0]
    for candidate, each in zip(last.fitted_candidates[1:], last.sums[1:], strict=True):
        pair = chosen.partner is not None or each.partner is not None
        if pair or not inseparable(last.fitted_candidates[0], candidate):
            continue
        alike += 1
        refined = snap_exponents(context, refine(context, candidate.fitted))
        other = context.with_test_score(context.candidate(refined))
        ahead = held_out_gain(context.whole, best, other)
        if ahead is not None and ahead.low > 0:
            best, chosen = other, each
    if chosen is last.sums[0]:
        return of
    first = _put_first(last, chosen)
    found = replace(
        of.found,
        after=best,
        rounds=(*of.found.rounds[:-1], first.fitted_candidates),
        steps=(*of.found.steps[:-1], best),
    )
    return Discovery(found, (*of.rounds[:-1], first), alike)


def _put_first(of: Round, chosen: Sum) -> Round:
    order = sorted(range(len(of.sums)), key=lambda number: of.sums[number] is not chosen)
    return replace(
        of,
        fitted_candidates=tuple(of.fitted_candidates[number] for number in order),
        sums=tuple(of.sums[number] for number in order),
    )


def _reasons_against(context: SearchContext, of: Discovery, rivals: Sequence[FittedCandidate]) -> Iterator[str]:
    if not held_out_kinds(context.whole.records):
        yield SAME_KIND
    for number, found in enumerate(of.rounds):
        first = found.sums[0]
        if first.spread > LAW_STABLE and not holds_elsewhere(of.found):
            yield f"its parameters differ by {100 * first.spread:.0f} % from stretch to stretch"
        taken, by_chance = found.shares_above_noise
        if 1 - taken > LAW_PLACEBO * (1 - by_chance):
            yield (
                f"it explains {100 * taken:.0f} % of the missing force above the noise, and the same search explains "
                f"{100 * by_chance:.0f} % of the force when it is shuffled in time"
            )
        yield from _equally_good_laws(context, of, number)
    inputs = context.whole.records[0].recording.command.channels
    if is_taken_by_coupling(context.tuning, of.found.after.fitted, inputs):
        yield HALF_TAKEN
    yield from _insignificant_gain(context, of.found.after, (of.found.retuned, "the re-tuned model"))
    for rival in rivals:
        yield from _insignificant_gain(
            context, of.found.after, (rival, f"{noun_of(rival.newest)} alone or with what it needs")
        )


def holds_elsewhere(found: Explanation) -> bool:
    """Whether so little error is left on held-out stretches that the law's factor, fitted to others, is as stable as
    is asked for: a factor that is off by a share s leaves the share s^2 of the error's power above the noise."""
    before, after = (float(np.sum(np.maximum(each.score.test**2 - 1, 0.0))) for each in (found.retuned, found.after))
    return before > 0 and after <= LAW_STABLE**2 * before


def _insignificant_gain(
    context: SearchContext, law: FittedCandidate, rival: tuple[FittedCandidate, str]
) -> Iterator[str]:
    """Whether the gain on held-out data is not significant, by a bootstrap interval over stretches."""
    ahead = held_out_gain(context.whole, rival[0], law)
    if ahead is None:
        yield "too little data was held out to confirm it"
    elif ahead.low <= 0:
        yield (
            f"its gain on held-out data over {rival[1]} is not larger than its variation between stretches of the "
            "recording"
        )


def _equally_good_laws(context: SearchContext, of: Discovery, number: int) -> Iterator[str]:
    """Laws of other variables that fit as well, that held-out data do not distinguish from it either, and that predict
    something else."""
    found = of.rounds[number]
    best = found.fitted_candidates[0]
    close = [
        (candidate, each)
        for candidate, each in zip(found.fitted_candidates[1:], found.sums[1:], strict=True)
        if inseparable(best, candidate) and each.variables != found.sums[0].variables
    ]
    if not close:
        return
    law = context.with_test_score(best)
    for candidate, each in close:
        rival = context.with_test_score(candidate)
        ahead = held_out_gain(context.whole, rival, law)
        parted = ahead is not None and ahead.low > 0
        if not parted and not _predict_the_same(of.found.retuned, law, rival):
            names = law_of_sum(each, context.measure.records[0].recording).variables
            yield f"a law of {' and '.join(names)} fits equally well"


def _predict_the_same(without: FittedCandidate, law: FittedCandidate, other: FittedCandidate) -> bool:
    """Whether two laws predict the same residuals in all samples, held-out ones included: then they are the same law
    written in two ways, as a relaxation of position or of speed."""
    apart = added = 0.0
    left = without.fitted.residuals, law.fitted.residuals, other.fitted.residuals
    for base, of_law, of_other in zip(*left, strict=True):
        apart += float(np.nansum((of_law - of_other) ** 2))
        added += float(np.nansum((of_law - base) ** 2))
    return apart <= LAW_SAME**2 * added


def does_as_well_with_less(context: SearchContext, of: Discovery, rival: FittedCandidate) -> bool:
    """Whether the laws have fewer parameters than a rival, exponents that were rounded included, and leave no more
    error than it where they were fitted and, within what the noise is known to, where they were not: of two
    descriptions that fit alike, the shorter. Both with held-out errors; a tenth of what the noise is known to is left
    to fits that end where they no longer gain."""
    law = of.found.after
    sums = [each for found in of.rounds for each in (found.sums[0], found.sums[0].partner) if each is not None]
    numbers = sum(1 + len(term.numbers) for each in sums for term in each.terms)
    if numbers >= len(rival.fitted.hypothesis.parameters) or not inseparable(rival, law):
        return False
    behind = held_out_gain(context.whole, law, rival)
    worse = np.mean(np.log(law.score.test)) - np.mean(np.log(rival.score.test))
    return behind is not None and behind.low <= 0.1 * NOISE_KNOWN_TO and bool(worse <= NOISE_KNOWN_TO)


def held_out_kinds(records: Sequence[Observed]) -> tuple[str, ...]:
    """Words for how the held-out stretches differ from those in which laws are found (stronger commands, axes driven
    together, another kind of command); empty where they are alike. A segment
    of which only the end is held out counts as both; rest counts as neither."""
    found: list[tuple[str, tuple[int, ...], float]] = []
    sealed: list[tuple[str, tuple[int, ...], float]] = []
    for record in records:
        for segment in record.recording.segments:
            part = slice(segment.start, segment.stop)
            described = _describe_segment(segment, record.command[part])
            if not described[1]:
                continue
            if record.test[part].any():
                sealed.append(described)
            if (record.fit | record.choose)[part].any():
                found.append(described)
    if not found:
        return ()
    kinds, axes = {kind for kind, _, _ in found}, {driven for _, driven, _ in found}
    strongest = max(level for _, _, level in found)
    said = [
        (any(level > LOUDER * strongest for _, _, level in sealed), "stronger commands"),
        (any(driven not in axes and len(driven) > 1 for _, driven, _ in sealed), "axes driven together"),
        (any(kind not in kinds for kind, _, _ in sealed), "another kind of command"),
    ]
    return tuple(words for true, words in said if true)


def _describe_segment(segment: Segment, command: FloatArray) -> tuple[str, tuple[int, ...], float]:
    driven = np.flatnonzero(np.abs(command).max(axis=0, initial=0.0) > 0)
    return segment.kind, tuple(driven.tolist()), float(np.abs(command).max(initial=0.0))


def proof_sentence(
    context: SearchContext, found: Explanation, rivals: Sequence[FittedCandidate], chosen_of: int = 1
) -> str:
    """One to three sentences: on which data a named law was tested, its error beside that of the best of the catalogue,
    how many laws fitted alike, and the range of motion beyond which it is unknown."""
    whole, after = context.whole, found.after
    laws = [law for law in laws_of(after.fitted.hypothesis) if law is not None]
    where = conjoin(held_out_kinds(whole.records))
    said = f"The formula was tested on {where}, to which nothing was fitted: {_error_sentence(context, found, after)}"
    closest = min((_held_out_error_share(context, found, rival) for rival in rivals), default=None)
    if closest is not None:
        said += f", that of the best law of the catalogue {100 * closest:.3g} %"
    if chosen_of > 1:
        said += f". Of {chosen_of} formulas that fitted equally well, it is the one that these data confirm"
    visited = _range_of_motion(context, found, {name for law in laws for name in law.variables})
    return f"{said}. Beyond {conjoin(visited)} the formula is not tested." if visited else f"{said}."


def _error_sentence(context: SearchContext, found: Explanation, law: FittedCandidate) -> str:
    return f"there its error is {100 * _held_out_error_share(context, found, law):.3g} % of the re-tuned model's error"


def _held_out_error_share(context: SearchContext, found: Explanation, law: FittedCandidate) -> float:
    """Held-out rms error over the re-tuned model's, in the mean over the channels."""
    gain = held_out_gain(context.whole, found.retuned, law)
    return float("nan") if gain is None else float(np.sqrt(max(1 - gain.gain, 0.0)))


def _range_of_motion(context: SearchContext, found: Explanation, names: set[str]) -> tuple[str, ...]:
    """The largest position and speed of each axis that the law uses, held-out samples included, as text."""
    measure, fitted = context.whole, found.after.fitted
    model, placed = context.tuning.tune(fitted.deviations), fitted.hypothesis.list_placed_effects()
    evidence = measure.evidence(model, placed, fitted.residuals)
    letters = axis_names(measure.records[0].recording.command.channels)
    length, time = model.system.length, model.system.time
    said = []
    for axis, letter in enumerate(letters):
        for name, unit in ((letter, length), (f"v{letter}", f"{length}/{time}")):
            if name in names:
                of = [record.axis_velocity if name != letter else record.axis_position for record in evidence]
                most = max(float(np.abs(each[:, axis]).max()) for each in of)
                said.append(f"{name} = ± {most:.3g} {unit}")
    return tuple(said)
