"""An explanation with one of its effects removed."""

from dataclasses import replace

from analysis.diagnosis.errors.hypothesis import Hypothesis, without_claim
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext


def without_effect(context: SearchContext, found: Explanation, number: int) -> Explanation:
    """The explanation without one effect; those after it are refitted. number: of the effect, in the order in which
    they were found; without the only one, the re-tuned model is left."""
    if len(found.steps) == 1:
        return replace(found, after=found.retuned, steps=())
    earlier, later = found.steps[:number], list(found.steps[number + 1 :])
    if not later:
        return replace(found, after=context.with_test_score(earlier[-1]), rounds=found.rounds[:number], steps=earlier)
    alone = [_without(context, candidate, number) for candidate in later]
    alone[-1] = context.candidate(refine(context, alone[-1].fitted))
    # Beside effects that follow, rivals of this one were not compared.
    rivals = found.rounds[number] if len(alone) == 1 else ()
    others = [candidate for candidate in rivals if candidate.newest != alone[0].newest]
    rounds = (*found.rounds[:number], (alone[0], *others), *found.rounds[number + 2 :])
    return replace(found, after=context.with_test_score(alone[-1]), rounds=rounds, steps=(*earlier, *alone))


def _without(context: SearchContext, candidate: FittedCandidate, number: int) -> FittedCandidate:
    fewer: Hypothesis = without_claim(candidate.fitted.hypothesis, number)
    return context.candidate(evaluate_fit(context.measure, context.tuning, candidate.fitted.deviations, fewer))
