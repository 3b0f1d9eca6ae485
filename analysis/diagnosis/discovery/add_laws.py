"""Add discovered laws (formulas outside the catalogue of effects) to the result of a search for catalogue effects.

Laws are searched where the catalogue leaves a mismatch, or where its named effects may only approximate a law. They
replace the named effects if they pass the checks of `validation` on held-out data; otherwise they are reported as
unconfirmed candidates, with the reasons. The search itself is `discover_laws`. Called by `search_by_simulation`.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.diagnosis.confirm.held_out_gain import estimate_held_out_gain
from analysis.diagnosis.discovery.convert_sum import list_fitted_laws
from analysis.diagnosis.discovery.discover import Discovery, Round, depends_on_another_axis, discover_laws
from analysis.diagnosis.discovery.validation import (
    choose_on_held_out,
    describe_held_out_test,
    find_failed_checks,
    is_confirmed_on_held_out,
    is_shorter_and_as_good,
)
from analysis.diagnosis.errors.output_error import gather_evidence
from analysis.diagnosis.limits import (
    HELD_OUT_ALONE_ERROR,
    LAW_MOST_ROUNDS,
    LEAST_PITCH_PERIODS,
    NAMED_ERROR,
    NOISE_ALONE,
)
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.identifiability import keep_identifiable
from analysis.diagnosis.search.parsimony import has_far_smaller_error
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.starting_hypotheses import is_within_data
from analysis.diagnosis.search.time_budget import limit_map
from analysis.diagnosis.search.verdict import SearchResult, UnconfirmedEffect, judge
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import AxisForce
from equalizer.laws.law import Law


@dataclass(slots=True)
class LawSearch:
    """The search for laws outside the catalogue. Laws are added to the re-tuned model without the catalogue's effects,
    so that a completed search need not be repeated on the same samples after further effects were found."""

    progress: Progress
    time_left: TimeBudget
    _completed: list[tuple[FittedCandidate, int, Discovery | None]] = field(default_factory=list)
    """Per completed search: the re-tuned model, the largest number of laws, and the discovery, None where there was
    none."""

    def add_short_laws(self, result: SearchResult) -> SearchResult:
        """Add laws as `add_laws`, but only those that are a shorter description than two effects of the catalogue
        (`is_short_description`)."""
        if not _needs_law(result) or not self.time_left():
            return result
        discovery = discover_laws(
            result.context, result.found, self.progress, self.time_left, LAW_MOST_ROUNDS, single_term=True
        )
        if discovery is not None and discovery.explanation.after.score.worst_channel <= NOISE_ALONE:
            self._completed.append((result.found.retuned, LAW_MOST_ROUNDS, discovery))
        return (
            check_laws(result, discovery, self.time_left)
            if discovery is not None and is_short_description(discovery)
            else result
        )

    def add_laws_before_third_effect(self, result: SearchResult) -> SearchResult:
        """Add laws as `add_laws`, where the two effects of `result`, which were not judged yet, leave a mismatch."""
        is_explained = result.judgement.named or judge(result.found).verdict == "explained"
        return result if is_explained else self.add_laws(result)

    def add_laws(self, result: SearchResult) -> SearchResult:
        """Replace the named effects of a result by discovered laws. Unchanged where it needs no law or no law is
        better; with laws that fail a check of `validation` as unconfirmed candidates only."""
        if not _needs_law(result) or not self.time_left():
            return result
        fits_to_noise = result.judgement.named and result.found.after.score.worst_channel <= NOISE_ALONE
        # Where the named effects fit down to the noise, only a single law is a shorter description.
        max_laws = 1 if fits_to_noise else LAW_MOST_ROUNDS
        discoveries = [
            discovery
            for model, law_count, discovery in self._completed
            if model is result.found.retuned and law_count == max_laws
        ]
        if not discoveries:
            discoveries = [discover_laws(result.context, result.found, self.progress, self.time_left, max_laws)]
            self._completed.append((result.found.retuned, max_laws, discoveries[0]))
        return result if discoveries[0] is None else check_laws(result, discoveries[0], self.time_left)


def is_short_description(discovery: Discovery) -> bool:
    """Whether laws are a shorter description than two effects: a single term in all, or a single term per axis or
    response channel, where each term depends on the motion of another axis."""
    term_sums = [
        term_sum
        for round_ in discovery.rounds
        for term_sum in (round_.sums[0], round_.sums[0].partner)
        if term_sum is not None
    ]
    acting_places = {(term_sum.acts_on, term_sum.axis) for term_sum in term_sums}
    if any(len(term_sum.terms) > 1 for term_sum in term_sums) or len(acting_places) < len(term_sums):
        return False
    return len(term_sums) == 1 or all(depends_on_another_axis(term_sum) for term_sum in term_sums)


def check_laws(result: SearchResult, discovery: Discovery, time_left: TimeBudget) -> SearchResult:
    """Replace the named effects of a result by the laws where these pass all checks, else add the laws as unconfirmed
    candidates; unchanged where the laws do not lower the held-out error."""
    context, catalogue_explanation = result.context, result.found
    if time_left():
        discovery = choose_on_held_out(replace(context, map_=limit_map(context.map_, time_left)), discovery)
    if not _improves_held_out(discovery.explanation):
        return result
    identifiable = keep_identifiable(context, discovery.explanation, time_left)
    has_unidentifiable = len(identifiable.steps) < len(discovery.explanation.steps)
    reduced_discovery = (
        _restrict_discovery(discovery, identifiable)
        if has_unidentifiable and _improves_held_out(identifiable)
        else None
    )
    if reduced_discovery is not None:
        # Only identifiable laws remain. A law that is not identifiable must not prevent these from being named.
        discovery, has_unidentifiable = reduced_discovery, False
    rivals, judgement = _list_rivals(context, catalogue_explanation), judge(identifiable)
    reasons = (
        *_find_rival_objections(context, catalogue_explanation, discovery, rivals),
        *_find_fit_objections(discovery, identifiable),
    )
    if has_unidentifiable:
        reasons = (*reasons, "these recordings hardly determine its parameters")
    if not judgement.named:
        reasons = (*reasons, "the held-out data do not confirm it")
    if reasons:
        return replace(result, unconfirmed=(*result.unconfirmed, *_yield_candidates(context, discovery, reasons)))
    remarks = (describe_held_out_test(context, identifiable, rivals, discovery.equally_good_count),)
    return SearchResult(
        context, identifiable, judgement, remarks, None if identifiable.errors is None else identifiable.errors[1]
    )


def _find_rival_objections(
    context: SearchContext, catalogue_explanation: Explanation, discovery: Discovery, rivals: Sequence[FittedCandidate]
) -> Iterator[str]:
    """Find the reasons, as clauses, why the laws do not replace the explanations of the catalogue: failed checks of
    `validation`, and rivals whose error is hardly larger."""
    if catalogue_explanation.steps and may_approximate_law(context, catalogue_explanation):
        rivals = [rival for rival in rivals if not is_shorter_and_as_good(context, discovery, rival)]
    yield from find_failed_checks(context, discovery, rivals)
    if not all(has_far_smaller_error(discovery.explanation.after, rival) for rival in rivals):
        yield "the effects of the catalogue reach almost as small an error"


def _find_fit_objections(discovery: Discovery, explanation: Explanation) -> Iterator[str]:
    """Find the reasons, as clauses, in the fit itself: it ended early, or its held-out error is too large."""
    if not all(round_.complete for round_ in discovery.rounds):
        yield "the time limit was reached before other laws were fitted"
    held_out_error = float(np.nanmax(explanation.after.score.test, initial=0.0))
    if held_out_error > NAMED_ERROR and not is_confirmed_on_held_out(explanation):
        yield f"on held-out data its error is {held_out_error:.3g} times the noise"


def _needs_law(result: SearchResult) -> bool:
    """Whether laws are to be searched: only a free simulation can confirm a law, and an error at the noise level leaves
    none to find, unless the named effects may approximate a law (`may_approximate_law`). False also with clean
    references or detected sensor faults (`SearchContext.certain`), after a search that ended early, or where a
    statistic of the response was compared."""
    context, explanation = result.context, result.found
    if (
        context.measure.name != "free simulation"
        or context.references is not None
        or context.certain
        or explanation.ended_early
    ):
        return False
    reference = (
        explanation.after
        if result.judgement.named and not may_approximate_law(context, explanation)
        else explanation.retuned
    )
    held_out_error = float(np.nanmax(reference.score.test, initial=0.0))
    return explanation.statistic is None and (
        reference.score.worst_channel > NOISE_ALONE or held_out_error > HELD_OUT_ALONE_ERROR
    )


def may_approximate_law(context: SearchContext, explanation: Explanation) -> bool:
    """Whether named effects that fit may only approximate a law that the catalogue lacks: several forces on the same
    axes, or an effect whose parameters exceed the recorded range (a periodic force needs `LEAST_PITCH_PERIODS`
    periods)."""
    fitted, claims = explanation.after.fitted, explanation.after.fitted.hypothesis.claims
    are_forces = all(isinstance(claim.effect.action, AxisForce) for claim in claims)
    if len(claims) > 1 and are_forces and len({claim.sites for claim in claims}) == 1:
        return True
    records = gather_evidence(context.full_measure, context.tuning, fitted)
    are_within_data = (
        any(is_within_data(fitted.hypothesis, claim_index, record, LEAST_PITCH_PERIODS) for record in records)
        for claim_index in range(len(claims))
    )
    return not all(are_within_data)


def _improves_held_out(explanation: Explanation) -> bool:
    """Whether the held-out error is below that of the re-tuned model; also true where the latter is not known."""
    retuned_error, error_with_laws = (
        _compute_held_out_log_error(explanation.retuned),
        _compute_held_out_log_error(explanation.after),
    )
    return not (np.isfinite(retuned_error) and error_with_laws >= retuned_error)


def _compute_held_out_log_error(candidate: FittedCandidate) -> float:
    """Compute the mean over the channels of the log held-out rms error, in units of the noise."""
    return float(np.mean(np.log(candidate.score.test)))


def _list_rivals(context: SearchContext, catalogue_explanation: Explanation) -> list[FittedCandidate]:
    """List the rivals of the laws from the catalogue: the explanation with its named effects, and the best single
    effect that does not contain an excluded one (`SearchContext.excluded`), for which it would stand."""
    rivals = [catalogue_explanation.after] if catalogue_explanation.steps else []
    single_effects = catalogue_explanation.rounds[0] if catalogue_explanation.rounds else ()
    nameable_effects = (
        candidate
        for candidate in single_effects
        if not context.excluded.intersection(candidate.fitted.hypothesis.claims[-1].effect.simpler)
    )
    rivals += [context.with_test_score(candidate) for candidate in itertools.islice(nameable_effects, 1)]
    return rivals


def _yield_candidates(
    context: SearchContext, discovery: Discovery, reasons: tuple[str, ...]
) -> Iterator[UnconfirmedEffect]:
    """Yield each law as an unconfirmed candidate, with the gain of all laws together; of several laws, the last reason
    states this."""
    gain = estimate_held_out_gain(context.full_measure, discovery.explanation.retuned, discovery.explanation.after)
    hypothesis = discovery.explanation.after.fitted.hypothesis
    if (law_count := sum(law is not None for law in list_fitted_laws(hypothesis))) > 1:
        reasons = (*reasons, f"this share is that of {law_count} laws together, which were found as one explanation")
    for law_index, law in enumerate(list_fitted_laws(hypothesis)):
        if law is not None:
            yield UnconfirmedEffect(
                hypothesis, 0.0 if gain is None else max(gain.gain, 0.0), "; ".join(reasons), law_index
            )


def _restrict_discovery(discovery: Discovery, reduced: Explanation) -> Discovery | None:
    """Restrict a discovery to the explanation `reduced`, which has some of its laws in the same order, and to the
    rounds that found these. None where `reduced` has no law, or a law that belongs to no round: the checks of a law
    need the data of its round."""
    if not reduced.steps:
        return None
    remaining_structures = [
        _identify_structure(law) for law in list_fitted_laws(reduced.after.fitted.hypothesis)[-len(reduced.steps) :]
    ]
    structures = [
        _identify_structure(law)
        for law in list_fitted_laws(discovery.explanation.after.fitted.hypothesis)[-len(discovery.explanation.steps) :]
    ]
    rounds: list[Round] = []
    for round_ in discovery.rounds:
        law_count = 1 if round_.sums[0].partner is None else 2
        if remaining_structures[:law_count] == structures[:law_count]:
            rounds.append(round_)
            remaining_structures = remaining_structures[law_count:]
        structures = structures[law_count:]
    return None if remaining_structures else replace(discovery, explanation=reduced, rounds=tuple(rounds))


def _identify_structure(law: Law | None) -> tuple[str, str, str] | None:
    """Identify a law without its parameters: formula, what it acts on, and axis; None for None."""
    return None if law is None else (law.expression, law.acts_on, law.axis)
