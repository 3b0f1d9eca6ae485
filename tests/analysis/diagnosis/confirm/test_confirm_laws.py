"""Where named laws are fitted from, and which of several is dropped because the data leave its parameters open."""

from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.balance.judged_law import JudgedLaw
from analysis.diagnosis.balance.laws.motion_laws import _make_stop_converter
from analysis.diagnosis.confirm import confirm_laws as by_balance
from analysis.diagnosis.confirm import require_gain
from analysis.diagnosis.confirm.confirm_laws import (
    INTERVAL_HALF_WIDTH,
    _find_undetermined_law,
    _fit_from_starts,
    _prefer_special_case,
    find_open_refinements,
)
from analysis.diagnosis.confirm.held_out_gain import HeldOutGain
from analysis.diagnosis.confirm.laws_for_simulation import can_be_simulated, find_special_case, make_hypothesis
from analysis.diagnosis.confirm.require_gain import MODEL_FITTED_REASON, withdraw_doubtful_names
from analysis.diagnosis.errors.hypothesis import Claim, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.search.verdict import Judgement, SearchResult
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.simulation.instant import LENGTH, X_FREE, X
from equalizer.signals.unit_system import UnitSystem

OPEN, SURE = 1.01 / INTERVAL_HALF_WIDTH, 0.1 / INTERVAL_HALF_WIDTH
"""Standard errors of a logarithm whose interval holds zero, and of one that is well known."""
DRY = ("coulomb_friction", {"level": 2.0})
BENDING = ("presliding_hysteresis", {"level": 0.5, "stiffness": 100.0})
STOP = ("end_stop", {"position": 0.01, "stiffness": 1e4, "opposite": 0.0})
BENT = ("position_dependent_friction", {"level": 0.5, "slope_per_m": 9.0, "bend_per_m2": 4.0})
HAND = ("hand_impedance", {"mass": 0.1, "damping": 5.0, "stiffness": 200.0})
RIPPLE = ("cogging", {"amplitude": 0.5, "pitch": 0.01, "phase": 0.0})


def make_explanation(*laws):
    whole = make_claim_hypothesis(Claim(EFFECTS["constant_force"], "one", (0,)), [{"force": 1.0}])
    for name, values in laws:
        whole = combine_hypotheses(whole, make_claim_hypothesis(Claim(EFFECTS[name], "one", (0,)), [values]))
    return SimpleNamespace(steps=(SimpleNamespace(fitted=SimpleNamespace(hypothesis=whole)),))


@pytest.mark.parametrize(
    ("laws", "errors", "dropped"),
    [
        ((DRY, BENDING), (SURE, SURE, SURE), None),
        ((DRY, BENDING), (SURE, SURE, OPEN), 1),
        ((BENDING,), (SURE, OPEN), None),
        ((BENDING,), (OPEN, SURE), 0),
        ((DRY, RIPPLE), (SURE, SURE, OPEN, OPEN), None),
        ((DRY, RIPPLE), (OPEN, SURE, SURE, SURE), 0),
        ((STOP,), (SURE, OPEN), 0),
        ((STOP,), (OPEN, SURE), None),
        ((BENT,), (SURE, 9.0 * OPEN, 4.0 * SURE), None),
        ((BENT,), (SURE, 9.0 * OPEN, 4.0 * OPEN), 0),
        ((HAND,), (OPEN, SURE, SURE), None),
        ((HAND,), (SURE, SURE, OPEN), None),
        ((HAND,), (SURE, OPEN, OPEN), 0),
        ((HAND,), (OPEN, SURE, OPEN), 0),
    ],
    ids=[
        "all known", "refinement open", "secondary open alone", "main open", "another family", "first open",
        "no stiffness", "place open", "bent", "not shown to be bent",
        "damped and stiff", "heavy and damped", "heavy alone", "damped alone",
    ],
)  # fmt: skip
def test_a_law_goes_by_its_main_number_and_a_refinement_by_any(laws, errors, dropped):
    assert _find_undetermined_law(make_explanation(*laws), np.array([0.0, *errors]), 1) == dropped


def make_result(*laws, errors=()):
    """Fitted with one number of the model, which is known."""
    context = SimpleNamespace(tuning=SimpleNamespace(names=("mass",)))
    return SimpleNamespace(found=make_explanation(*laws), context=context, errors=np.array([0.0, 0.0, *errors]))


@pytest.mark.parametrize(
    ("laws", "errors", "open_ones"),
    [
        ((BENDING,), (SURE, SURE), ()),
        ((BENDING,), (SURE, OPEN), (0,)),
        ((DRY, BENDING), (SURE, SURE, OPEN), (1,)),
        ((DRY,), (OPEN,), ()),
        ((BENT,), (SURE, 9.0 * OPEN, 4.0 * OPEN), ()),
    ],
    ids=["all known", "no stiffness", "of the second", "nothing simpler", "signed parameters go elsewhere"],
)
def test_open_are_positive_numbers_that_the_special_case_lacks(laws, errors, open_ones):
    assert find_open_refinements(make_result(*laws, errors=errors), 1) == open_ones


@pytest.mark.parametrize(
    ("left", "held", "preferred"), [(1.05, 1, True), (1.2, 1, False), (0.9, 0, False)],
    ids=["hardly more", "clearly more", "a law was dropped"],
)  # fmt: skip
def test_the_special_case_is_named_where_it_leaves_hardly_more(monkeypatch, left, held, preferred):
    whole, plain = (
        SimpleNamespace(found=SimpleNamespace(after=SimpleNamespace(held_out_error=np.log(e)))) for e in (1, left)
    )
    monkeypatch.setattr(by_balance, "find_open_refinements", lambda found, constants: (0,))
    monkeypatch.setattr(by_balance, "find_special_case", lambda balances, kept, law: (0, "coulomb"))
    monkeypatch.setattr(by_balance, "_confirm_by_simulation", lambda begun, named: (plain, named[:held]))
    found = _prefer_special_case(SimpleNamespace(balances=(), constant_count=1), whole, [(0, "bending")])
    assert found is (plain if preferred else whole)


def candidate_with_test_error(error):
    return FittedCandidate(None, SimpleNamespace(test=np.array([error])))


@pytest.mark.parametrize(
    ("from_balance", "from_model", "end", "starts"),
    [(2.0, 1.0, 2.0, 1), (9.0, 1.0, 1.0, 2), (9.0, 20.0, 9.0, 2)],
    ids=["borne out at once", "ended beside the law", "neither start helps"],
)
def test_laws_are_fitted_from_the_model_s_own_numbers_where_the_balance_s_end_beside_them(
    monkeypatch, from_balance, from_model, end, starts
):
    tried = []

    def steps(context, retuned, named, deviations):
        tried.append(deviations)
        return [candidate_with_test_error(from_balance if np.any(deviations) else from_model)]

    monkeypatch.setattr(by_balance, "_fit_steps", steps)
    monkeypatch.setattr(by_balance, "compute_starting_deviations", lambda tuning, balances, laws: np.array([1.0, -2.0]))
    context = SimpleNamespace(tuning=None, with_test_score=lambda candidate: candidate)
    _, after = _fit_from_starts(context, (), (candidate_with_test_error(8.0), candidate_with_test_error(8.0)), ())
    assert after.score.test[0] == end
    assert len(tried) == starts


@pytest.mark.parametrize(
    ("given", "retuned", "plain"), [(1.0, 2.0, 1.0), (2.0, 1.0, 1.0), (1.0, np.nan, 1.0), (np.inf, 3.0, 3.0)]
)
def test_without_new_physics_stands_what_foretells_better(given, retuned, plain):
    found = Explanation(
        candidate_with_test_error(given), candidate_with_test_error(retuned), candidate_with_test_error(0.5), (), ()
    )
    assert found.plain.score.test[0] == plain


@pytest.mark.parametrize(
    ("given", "predicts", "is_named"), [(4.0, True, True), (1.0, True, False), (4.0, False, False)]
)
def test_a_law_that_foretells_no_better_than_the_given_model_is_not_named(monkeypatch, given, predicts, is_named):
    """Re-tuning followed what was fitted to, to 4; the law brings that back to 1.1."""
    law = SimpleNamespace(law=SimpleNamespace(effect="coulomb_friction"), law_index=0)
    regression = SimpleNamespace(base_terms=SimpleNamespace(driven_channel=0))
    balance = SimpleNamespace(named=(law,), search=SimpleNamespace(regression=regression))
    patched = {
        "can_be_simulated": lambda own, weighed, units: True,
        "estimate_constant_forces": lambda balances: SimpleNamespace(claims=()),
        "refit_laws": lambda balances, named: named, "evaluate_fit": lambda *of: given, "refine": lambda *of: 4.0,
        "compute_final_errors": lambda *of: np.zeros(1), "_find_undetermined_law": lambda *of: None,
        "_fit_from_starts": lambda *of: ([candidate_with_test_error(1.1)], candidate_with_test_error(1.1)),
        "explains_half": lambda *of: predicts,
        "find_open_refinements": lambda *of: (),
    }  # fmt: skip
    for name, stand_in in patched.items():
        monkeypatch.setattr(by_balance, name, stand_in)
    context = SimpleNamespace(
        measure=None,
        full_measure=None,
        tuning=SimpleNamespace(names=(), model=SimpleNamespace(units=None)),
        score_fit=candidate_with_test_error,
        with_test_score=lambda each: each,
    )
    context.join_fit_and_choose = lambda: context
    found = by_balance.search_by_balance(context, (balance,), False)
    assert (found is not None) == is_named


def make_candidate(*names):
    hypothesis = SimpleNamespace(claims=names)
    score = SimpleNamespace(worst_channel=9.0, mean_log_error=9.0, test=np.array([9.0]))
    return SimpleNamespace(
        newest=names[-1] if names else "",
        fitted=SimpleNamespace(hypothesis=hypothesis),
        score=score,
        held_out_error=float(np.log(9.0)),
    )


def make_search_result(*names):
    retuned = make_candidate()
    steps = tuple(make_candidate(*names[: place + 1]) for place in range(len(names)))
    found = Explanation(retuned, retuned, steps[-1], (), steps)
    context = SimpleNamespace(full_measure=None, with_test_score=lambda each: each)
    return SearchResult(context, found, Judgement("partly_explained", True))


@pytest.fixture
def half_held_out_gain(monkeypatch):
    monkeypatch.setattr(require_gain, "estimate_held_out_gain", lambda *_: HeldOutGain(0.5, 0.4, 0.6))


@pytest.mark.usefixtures("half_held_out_gain")
@pytest.mark.parametrize("name", ["sensor_nonlinearity", "slew_limit", "transport_delay", "force_gain"])
def test_what_bends_or_delays_beside_a_fitted_model_is_a_candidate(name):
    seen = withdraw_doubtful_names(make_search_result(name))
    assert seen.judgement == Judgement("unexplained", False)
    assert not seen.found.steps
    (told,) = seen.unconfirmed
    assert (told.hypothesis.claims, told.gain, told.why_not) == ((name,), 0.5, MODEL_FITTED_REASON)


@pytest.mark.parametrize(
    ("held", "named", "place"),
    [
        (("cogging", "coulomb_friction"), (), 1),
        (("cogging",), (), None),
        (("coulomb_friction",), ("coulomb_friction",), None),
    ],
    ids=["in the balance", "not in it", "already named"],
)  # fmt: skip
def test_a_refinement_gives_way_to_its_special_case(held, named, place):
    laws = tuple(SimpleNamespace(effect=name, channel=0) for name in held)
    balance = SimpleNamespace(search=SimpleNamespace(regression=SimpleNamespace(laws=laws)))
    bent = make_judged_law("position_dependent_friction", 5)
    found = find_special_case([balance], [(0, make_judged_law(name, 7)) for name in named], (0, bent))
    assert (found and (found[1].law_index, found[1].law.effect)) == (
        place if place is None else (place, "coulomb_friction")
    )


def make_judged_law(name, place):
    law = SimpleNamespace(effect=name, channel=0)
    return JudgedLaw(place, law, {"level": 1.0}, 0.5, 0.4, 0.9, (), 1.0, "")


@pytest.mark.usefixtures("half_held_out_gain")
@pytest.mark.parametrize("predicts", [True, False])
def test_what_the_signal_itself_shows_keeps_its_name_unless_the_model_runs_away(monkeypatch, predicts):
    monkeypatch.setattr(require_gain, "predicts_motion", lambda *_: predicts)
    seen = make_search_result("sensor_clipping")
    assert (withdraw_doubtful_names(seen) is seen) == predicts


def test_what_gains_nothing_on_held_out_data_is_no_candidate(monkeypatch):
    monkeypatch.setattr(require_gain, "estimate_held_out_gain", lambda *_: HeldOutGain(-0.1, -0.2, 0.1))
    assert withdraw_doubtful_names(make_search_result("slew_limit")).unconfirmed == ()


@pytest.mark.parametrize(
    ("position_m", "side", "pushing_at_m"),
    [(0.04, 1.0, 0.05), (-0.02, 1.0, 0.0), (-0.04, -1.0, -0.05), (0.02, -1.0, 0.0)],
)
def test_a_stop_is_played_on_whichever_side_of_zero_it_stands(position_m, side, pushing_at_m):
    values = _make_stop_converter(side * 0.1, side)(np.array([800.0]), (0.1 - side * position_m,), 1.0)
    judged = SimpleNamespace(formula=None, law=SimpleNamespace(effect="end_stop", channel=0), values=values)
    assert can_be_simulated(0, judged)

    (placed,) = make_hypothesis(0, judged, None).list_placed_effects()
    at, numbers = np.zeros(LENGTH), placed.effect.action.pack(None, 0, placed.values)
    at[X] = at[X_FREE] = pushing_at_m
    assert placed.effect.action.law(numbers, np.zeros(1), at) == pytest.approx(-800.0 * (pushing_at_m - position_m))
    at[X] = at[X_FREE] = position_m - 0.01 * side
    assert placed.effect.action.law(numbers, np.zeros(1), at) == 0


@pytest.mark.parametrize(
    ("effect", "values"),
    [("presliding_hysteresis", {"level": 0.07, "stiffness": 4e-4}),
     ("end_stop", {"position": 18000.0, "stiffness": 2e-9, "opposite": 0.0}),
     ("stribeck_friction", {"coulomb": 0.1, "static": 0.2, "speed": 4e4})],
)  # fmt: skip
def test_bounds_in_si_do_not_limit_a_law_of_a_motion_in_counts(effect, values):
    judged, counts = (
        SimpleNamespace(formula=None, law=SimpleNamespace(effect=effect, channel=0), values=values),
        UnitSystem("A", "1"),
    )
    assert not can_be_simulated(0, judged)
    assert can_be_simulated(0, judged, counts)
    hypothesis = make_hypothesis(0, judged, None, counts)
    (placed,) = hypothesis.list_placed_effects()
    assert {name: placed.values[name] for name in values} == pytest.approx(values)
    opposite = [each.bounds for each in hypothesis.parameters if each.parameter.name == "opposite"]
    assert all(bounds[0] == 0 for bounds in opposite)  # a plain number keeps its bounds
