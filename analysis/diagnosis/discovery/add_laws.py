"""Adds discovered laws (formulas outside the catalogue of effects) to the result of a search for catalogue effects.

Laws are searched where the catalogue leaves a mismatch, or where its named effects may only approximate a law. They
replace the named effects if they pass the checks of `validation` on held-out data; otherwise they are reported as
unconfirmed candidates, with the reasons. The search itself is `discover`; its equations are in the package's docstring.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.diagnosis.confirm.held_out_gain import held_out_gain
from analysis.diagnosis.discovery.discover import Discovery, Round, depends_on_another_axis, discover
from analysis.diagnosis.discovery.law_of_sum import laws_of
from analysis.diagnosis.discovery.validation import (
    choose_on_held_out,
    does_as_well_with_less,
    holds_elsewhere,
    proof_sentence,
    reasons_against,
)
from analysis.diagnosis.errors.output_error import gather_evidence
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.identifiability import keep_identifiable
from analysis.diagnosis.search.parsimony import leaves_far_less
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.starting_hypotheses import is_within_data
from analysis.diagnosis.search.verdict import SearchResult, Unconfirmed, judge
from analysis.diagnosis.settings import HELD_OUT_ALONE_ERROR, LAW_MOST_ROUNDS, NAMED_ERROR, NOISE_ALONE, PITCHES_SEEN
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import AxisForce
from equalizer.laws.law import Law


@dataclass(slots=True)
class LawSearch:
    """The search for laws outside the catalogue. Laws are added to the re-tuned model without the catalogue's effects,
    so that a completed search need not be repeated on the same samples after further effects were found."""

    progress: Progress
    time_left: TimeBudget
    _done: list[tuple[FittedCandidate, int, Discovery | None]] = field(default_factory=list)
    """Per completed search: the re-tuned model, the largest number of laws, and the discovery, None where there was
    none."""

    def add_short(self, result: SearchResult) -> SearchResult:
        """Add laws as `add_any`, but only those that are a shorter description than two effects of the catalogue
        (`is_short`)."""
        if not _needs_law(result) or not self.time_left():
            return result
        found = discover(result.context, result.found, self.progress, self.time_left, LAW_MOST_ROUNDS, alone=True)
        if found is not None and found.found.after.score.worst_channel <= NOISE_ALONE:
            self._done.append((result.found.retuned, LAW_MOST_ROUNDS, found))
        return weigh_laws(result, found, self.time_left) if found is not None and is_short(found) else result

    def add_any(self, result: SearchResult) -> SearchResult:
        """The result with discovered laws in place of its named effects. Unchanged where it needs no law or no law is
        better; with laws that fail a check of `validation` as unconfirmed candidates only."""
        if not _needs_law(result) or not self.time_left():
            return result
        fits = result.judgement.named and result.found.after.score.worst_channel <= NOISE_ALONE
        # Where the named effects fit down to the noise, only a single law is a shorter description.
        most = 1 if fits else LAW_MOST_ROUNDS
        known = [found for model, laws, found in self._done if model is result.found.retuned and laws == most]
        if not known:
            known = [discover(result.context, result.found, self.progress, self.time_left, most)]
            self._done.append((result.found.retuned, most, known[0]))
        return result if known[0] is None else weigh_laws(result, known[0], self.time_left)


def is_short(of: Discovery) -> bool:
    """Whether laws are a shorter description than two effects: a single term in all, or a single term per axis or
    response channel, where each term depends on the motion of another axis."""
    sums = [each for found in of.rounds for each in (found.sums[0], found.sums[0].partner) if each is not None]
    places = {(each.acts_on, each.axis) for each in sums}
    if any(len(each.terms) > 1 for each in sums) or len(places) < len(sums):
        return False
    return len(sums) == 1 or all(depends_on_another_axis(each) for each in sums)


def weigh_laws(result: SearchResult, found: Discovery, time_left: TimeBudget) -> SearchResult:
    """The result with the laws in place of its named effects where they pass all checks, else with the laws as
    unconfirmed candidates; unchanged where the laws do not lower the held-out error."""
    context, known = result.context, result.found
    if time_left():
        found = choose_on_held_out(context, found)
    if not _improves_held_out(found.found):
        return result
    checked = keep_identifiable(context, found.found, time_left)
    is_open = len(checked.steps) < len(found.found.steps)
    fewer = _keep_rounds_of(found, checked) if is_open and _improves_held_out(checked) else None
    if fewer is not None:
        # Only identifiable laws remain. A law that is not identifiable must not prevent these from being named.
        found, is_open = fewer, False
    rivals, judged = _rivals(context, known), judge(checked)
    reasons = (*_reasons_of_rivals(context, known, found, rivals), *_reasons_of_fit(found, checked))
    if is_open:
        reasons = (*reasons, "these recordings hardly determine its parameters")
    if not judged.named:
        reasons = (*reasons, "the held-out data do not confirm it")
    if reasons:
        return replace(result, unconfirmed=(*result.unconfirmed, *_candidates(context, found, reasons)))
    remarks = (proof_sentence(context, checked, rivals, found.chosen_of),)
    return SearchResult(context, checked, judged, remarks, None if checked.errors is None else checked.errors[1])


def _reasons_of_rivals(
    context: SearchContext, known: Explanation, found: Discovery, rivals: Sequence[FittedCandidate]
) -> Iterator[str]:
    """Reasons, as sentences, why the laws do not replace the explanations of the catalogue: failed checks of
    `validation`, and rivals whose error is hardly larger."""
    if known.steps and may_stand_for_a_law(context, known):
        rivals = [rival for rival in rivals if not does_as_well_with_less(context, found, rival)]
    yield from reasons_against(context, found, rivals)
    if not all(leaves_far_less(found.found.after, rival) for rival in rivals):
        yield "the effects of the catalogue reach almost as small an error"


def _reasons_of_fit(found: Discovery, checked: Explanation) -> Iterator[str]:
    """Reasons, as sentences, from the fit itself: it ended early, or its held-out error is too large."""
    if not all(each.complete for each in found.rounds):
        yield "the time limit was reached before other laws were fitted"
    held_out = float(np.nanmax(checked.after.score.test, initial=0.0))
    if held_out > NAMED_ERROR and not holds_elsewhere(checked):
        yield f"on held-out data its error is {held_out:.3g} times the noise"


def _needs_law(result: SearchResult) -> bool:
    """Whether laws are to be searched: only a free simulation can confirm a law, and an error at the noise level leaves
    none to find, unless the named effects may approximate a law (`may_stand_for_a_law`)."""
    context, found = result.context, result.found
    if (
        context.measure.name != "free simulation"
        or context.references is not None
        or context.certain
        or found.ended_early
    ):
        return False
    left = found.after if result.judgement.named and not may_stand_for_a_law(context, found) else found.retuned
    sealed = float(np.nanmax(left.score.test, initial=0.0))
    return found.statistic is None and (left.score.worst_channel > NOISE_ALONE or sealed > HELD_OUT_ALONE_ERROR)


def may_stand_for_a_law(context: SearchContext, named: Explanation) -> bool:
    """Whether named effects that fit may only approximate a law that the catalogue lacks: several forces on the same
    axes, or an effect whose parameters exceed the recorded range (a periodic force needs `PITCHES_SEEN` periods)."""
    fitted, claims = named.after.fitted, named.after.fitted.hypothesis.claims
    forces = all(isinstance(claim.effect.acts, AxisForce) for claim in claims)
    if len(claims) > 1 and forces and len({claim.sites for claim in claims}) == 1:
        return True
    records = gather_evidence(context.whole, context.tuning, fitted)
    seen = (any(is_within_data(fitted.hypothesis, k, of, PITCHES_SEEN) for of in records) for k in range(len(claims)))
    return not all(seen)


def _improves_held_out(found: Explanation) -> bool:
    """Whether the held-out error is below that of the re-tuned model; also true where the latter is not known."""
    before, after = _held_out_log_error(found.retuned), _held_out_log_error(found.after)
    return not (np.isfinite(before) and after >= before)


def _held_out_log_error(of: FittedCandidate) -> float:
    """Mean over the channels of the log held-out rms error, in units of the noise."""
    return float(np.mean(np.log(of.score.test)))


def _rivals(context: SearchContext, known: Explanation) -> list[FittedCandidate]:
    """Rivals of the laws from the catalogue: the explanation with its named effects, and the best single effect."""
    rivals = [known.after] if known.steps else []
    if known.rounds and known.rounds[0]:
        rivals.append(context.with_test_score(known.rounds[0][0]))
    return rivals


def _candidates(context: SearchContext, found: Discovery, reasons: tuple[str, ...]) -> Iterator[Unconfirmed]:
    """Each law as an unconfirmed candidate, with the gain of all laws together."""
    gain = held_out_gain(context.whole, found.found.retuned, found.found.after)
    hypothesis = found.found.after.fitted.hypothesis
    for number, law in enumerate(laws_of(hypothesis)):
        if law is not None:
            yield Unconfirmed(hypothesis, 0.0 if gain is None else max(gain.gain, 0.0), "; ".join(reasons), number)


def _keep_rounds_of(of: Discovery, fewer: Explanation) -> Discovery | None:
    """The discovery restricted to the explanation `fewer`, which has some of its laws in the same order, and to the
    rounds that found these. None where `fewer` has no law, or a law that belongs to no round: the checks of a law need
    the data of its round."""
    if not fewer.steps:
        return None
    kept = [_structure(law) for law in laws_of(fewer.after.fitted.hypothesis)[-len(fewer.steps) :]]
    claims = [_structure(law) for law in laws_of(of.found.after.fitted.hypothesis)[-len(of.found.steps) :]]
    rounds: list[Round] = []
    for each in of.rounds:
        size = 1 if each.sums[0].partner is None else 2
        if kept[:size] == claims[:size]:
            rounds.append(each)
            kept = kept[size:]
        claims = claims[size:]
    return None if kept else replace(of, found=fewer, rounds=tuple(rounds))


def _structure(law: Law | None) -> tuple[str, str, str] | None:
    """Identity of a law without its parameters: formula, what it acts on, and axis."""
    return None if law is None else (law.expression, law.acts_on, law.axis)
