"""Laws that hardly show where they are looked for, and prove themselves on a louder test. Compiles."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.discovery.add_laws import LawSearch, check_laws
from analysis.diagnosis.discovery.convert_sum import list_fitted_laws
from analysis.diagnosis.discovery.discover import Discovery, Round, discover_laws
from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.validation import (
    STEEP_POWER,
    choose_on_held_out,
    find_failed_checks,
    is_confirmed_on_held_out,
)
from analysis.diagnosis.errors.hypothesis import Claim, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.law_hypothesis import make_law_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.verdict import SearchResult, judge
from equalizer.effects.discovered_law import collect_channels, get_law_values, make_law_effect
from tests.lawful import arena_of, law, recorded

QUIET = (("multisine", 0.2, "fit"), ("multisine", 0.3, "fit"), ("multisine", 0.4, "fit"), ("sweep", 2.0, "test"))


def ignore_progress(said, share):
    pass


def always():
    return True


@pytest.fixture(scope="module")
def search_result():
    context, known = arena_of(recorded((law("-p0*x**3", 4e5),), 3, plan=QUIET))
    found = discover_laws(context, known, ignore_progress, always)
    assert found is not None
    return context, known, found


@pytest.mark.slow
def test_a_law_that_takes_nearly_all_of_a_louder_error_is_named_though_some_noises_are_left(search_result):
    context, known, found = search_result
    assert found.explanation.after.score.test.max() > 3
    named = LawSearch(ignore_progress, always).add_laws(SearchResult(context, known, judge(known)))
    assert named.judgement.named
    laws = list_fitted_laws(named.found.after.fitted.hypothesis)
    assert laws[0].variables == ("x",)


@pytest.mark.slow
def test_a_law_holds_elsewhere_only_where_little_of_the_held_out_error_is_left(search_result):
    _, _, found = search_result
    assert is_confirmed_on_held_out(found.explanation)
    half = replace(
        found.explanation.retuned,
        score=replace(found.explanation.retuned.score, test=found.explanation.retuned.score.test / 2),
    )
    assert not is_confirmed_on_held_out(replace(found.explanation, after=half))
    unknown = replace(found.explanation.retuned.score, test=np.full(2, np.nan))
    assert not is_confirmed_on_held_out(
        replace(found.explanation, retuned=replace(found.explanation.retuned, score=unknown))
    )


def test_of_laws_that_fit_alike_the_one_that_the_louder_test_bears_out_is_chosen(search_result):
    context, _, found = search_result
    last = found.rounds[-1]
    cubic = last.sums[0].terms[0].shape
    order = [2, 1, 0]
    turned = Round(
        tuple(last.fitted_candidates[k] for k in order), tuple(last.sums[k] for k in order), last.chance_share
    )
    wrong = context.with_test_score(turned.fitted_candidates[0])
    given = replace(found.explanation, after=wrong, steps=(wrong,))
    chosen = choose_on_held_out(context, Discovery(given, (turned,)))
    assert chosen.equally_good_count == 3
    assert turned.sums[0].terms[0].shape != cubic == chosen.rounds[-1].sums[0].terms[0].shape
    assert chosen.explanation.after.score.test.max() < wrong.score.test.max()
    assert chosen.explanation.steps[-1] is chosen.explanation.after


@pytest.mark.slow
def test_a_law_too_weak_to_be_known_takes_no_other_laws_name_away(search_result):
    context, known, found = search_result
    weak = replace(law("p0*x*vx*abs(vx)", 1e-3), units=())
    effect = make_law_effect(weak, collect_channels(context.measure.records[0].recording))
    alone = make_claim_hypothesis(Claim(effect, "one", (0,)), [get_law_values(weak)])
    after = found.explanation.after.fitted
    first, both = (
        context.score_fit(refine(context, evaluate_fit(context.measure, context.tuning, after.deviations, hypothesis)))
        for hypothesis in (alone, combine_hypotheses(alone, after.hypothesis))
    )
    rounds = (
        Round((first,), (replace(found.rounds[0].sums[0], factor_error=1.0),), 0.5),
        replace(found.rounds[0], fitted_candidates=(both,), sums=found.rounds[0].sums[:1]),
    )
    whole = replace(
        found.explanation,
        after=context.with_test_score(both),
        steps=(first, both),
        rounds=tuple(each.fitted_candidates for each in rounds),
    )
    named = check_laws(SearchResult(context, known, judge(known)), Discovery(whole, rounds), always)
    assert named.judgement.named
    assert [each.variables for each in list_fitted_laws(named.found.after.fitted.hypothesis)] == [("x",)]


@pytest.mark.slow
def test_a_law_whose_round_is_not_known_is_named_by_no_check(search_result):
    """A weak law was found after it, and its exponent was rounded since: its checks are those of no round by name."""
    context, known, found = search_result
    weak = replace(law("p0*x*vx*abs(vx)", 1e-3), units=())
    effect = make_law_effect(weak, collect_channels(context.measure.records[0].recording))
    alone = make_claim_hypothesis(Claim(effect, "one", (0,)), [get_law_values(weak)])
    first, rounded = found.rounds[0].fitted_candidates[0], found.explanation.after.fitted
    expressions = [list_fitted_laws(each.hypothesis)[0].expression for each in (first.fitted, rounded)]
    assert expressions[0] != expressions[1]
    start = evaluate_fit(
        context.measure, context.tuning, rounded.deviations, combine_hypotheses(rounded.hypothesis, alone)
    )
    both = context.with_test_score(context.score_fit(refine(context, start)))
    rounds = (found.rounds[0], Round((both,), (replace(found.rounds[0].sums[0], factor_error=1.0),), 0.5))
    whole = replace(
        found.explanation, after=both, steps=(first, both), rounds=tuple(each.fitted_candidates for each in rounds)
    )
    answer = check_laws(SearchResult(context, known, judge(known)), Discovery(whole, rounds), always)
    assert not answer.judgement.named
    assert answer.unconfirmed


def test_shares_are_of_what_is_no_noise():
    first = Sum(0, (), (), cross_validated_error=1.01, base_error=1.13, factor_error=0.2, model_shift=())
    taken, by_chance = Round((), (first,), chance_share=0.0076).shares_above_noise
    assert taken == pytest.approx(0.12 / 0.13)
    assert by_chance == pytest.approx(0.0076 * 1.13 / 0.13)


@pytest.mark.slow
def test_a_force_that_undoes_the_command_hides_no_law():
    """With mass, damping and stiffness shrinking alongside, it balances everything: it came first, and led nowhere."""
    context, known = arena_of(recorded((law("-p0*maximum(sign(-x - p1), 0)*vx", 4.0, 0.002),), 1))
    found = discover_laws(context, known, ignore_progress, always)
    assert found is not None
    drag = list_fitted_laws(found.explanation.after.fitted.hypothesis)[0]
    assert drag.expression == "p0*maximum(sign((-x) - p1), 0)*vx"
    assert drag.numbers == pytest.approx((-4.0, 0.002), rel=0.02)


def test_a_steep_power_is_a_candidate_only(search_result):
    context, _, found = search_result

    def list_objections(exponent: int) -> list[str]:
        steep = make_law_hypothesis(law(f"p0*x**{exponent}", -1e3), 0, context.measure.records[0].recording)
        deviations = found.explanation.after.fitted.deviations
        after = context.with_test_score(
            context.score_fit(evaluate_fit(context.measure, context.tuning, deviations, steep))
        )
        explanation = replace(found.explanation, after=after, steps=(after,))
        reasons = find_failed_checks(context, Discovery(explanation, found.rounds), ())
        return [reason for reason in reasons if "stands for an edge" in reason]

    assert list_objections(7) == [STEEP_POWER.format(7.0)]
    assert list_objections(5) == []
