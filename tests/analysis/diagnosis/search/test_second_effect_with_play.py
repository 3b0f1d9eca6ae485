"""The strength of a second effect is searched over a decade and a half, and fits end in order and in time."""

import contextlib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import analysis.diagnosis.errors.refine_band_power as refine_module
import analysis.diagnosis.search.impacts as impacts
import analysis.diagnosis.search.search as search
import analysis.diagnosis.search.second_effect_with_play as second_effect
import analysis.diagnosis.search_by_simulation as search_by_simulation
from analysis.diagnosis.errors.band_power_fit import BandPowerProblem
from analysis.diagnosis.errors.choose_measure import make_measure
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS, Claim, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.search.explain import Explanation, Statistic
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.time_budget import CountedBudget
from analysis.diagnosis.search.verdict import OUT_OF_TIME, Judgement, SearchResult
from equalizer.effects.catalogue import CATALOGUE, EFFECTS
from equalizer.effects.coulomb_friction import EFFECT as DRY
from equalizer.effects.effect import PlacedEffect

PLAY = SimpleNamespace(hypothesis=NO_EFFECTS, deviations=np.zeros(0), cost=9.0)
VIEW = SimpleNamespace(map_=map)
GAINS = [make_claim_hypothesis(Claim(EFFECTS["sensor_gain"], "one", (0,)), [{"gain": 1.1}])]


def friction(level_n: float):
    return make_claim_hypothesis(Claim(DRY, "one", (0,)), [{"level": level_n}])


def level_of(fit) -> float:
    return float(fit.hypothesis.list_placed_effects()[-1].values["level"])


@pytest.fixture
def true_level(monkeypatch):
    """The cost grows with the squared logarithm of the level over the true one."""
    level_n = [1.0]

    def evaluate(view, deviations, hypothesis):
        (placed,) = hypothesis.list_placed_effects()
        cost = 1.0 + np.log(placed.values.get("level", 1.0) / level_n[0]) ** 2
        return SimpleNamespace(hypothesis=hypothesis, deviations=deviations, cost=float(cost))

    monkeypatch.setattr(second_effect, "evaluate_hypothesis", evaluate)
    return level_n


@pytest.mark.parametrize("true_n", [0.03, 0.1, 0.3, 0.55, 1.0, 1.8, 3.2])
def test_a_strength_is_found_from_a_wrong_start(true_level, true_n):
    true_level[0] = true_n
    fit = second_effect._search_strength(VIEW, PLAY, friction(1.0))
    assert level_of(fit) == pytest.approx(true_n)
    assert fit.cost == pytest.approx(1.0)


@pytest.mark.parametrize("changes", [{"parameters": ()}, {"parameters": (replace(DRY.parameters[0], fixed=True),)}])
def test_an_effect_without_a_free_strength_keeps_its_start(true_level, changes):
    effect = replace(DRY, **changes)
    hypothesis = make_claim_hypothesis(Claim(effect, "one", (0,)), [{"level": 0.5}])
    fit = second_effect._search_strength(VIEW, PLAY, hypothesis)
    assert fit.hypothesis.list_placed_effects()[0].values == {"level": 0.5}


def test_an_effect_that_does_not_vanish_at_zero_keeps_its_start(true_level):
    gain = EFFECTS["sensor_gain"]
    assert gain.parameters[0].none != 0
    hypothesis = make_claim_hypothesis(Claim(gain, "one", (0,)), [{"gain": 1.1}])
    fit = second_effect._search_strength(VIEW, PLAY, hypothesis)
    assert fit.hypothesis.list_placed_effects()[0].values["gain"] == pytest.approx(1.1)


def test_starts_end_in_time_and_what_was_evaluated_is_kept(true_level, monkeypatch):
    monkeypatch.setattr(second_effect, "replace", lambda view, **changes: view)
    suggested = [friction(1.0)] * (3 * second_effect.BATCH_SIZE)
    starts, complete = second_effect._evaluate_starts(VIEW, PLAY, suggested, CountedBudget(1))
    assert (len(starts), complete) == (2 * second_effect.BATCH_SIZE, False)
    starts, complete = second_effect._evaluate_starts(VIEW, PLAY, suggested, CountedBudget(9))
    assert (len(starts), complete) == (len(suggested), True)


@pytest.mark.parametrize(("true_n", "stops"), [(0.2, True), (100.0, False)])
def test_beside_what_waveforms_and_band_powers_show_only_relatives_are_tried(true_level, monkeypatch, true_n, stops):
    true_level[0] = true_n
    suggested_names: list[str] = []

    def suggest(context, play, effects):
        suggested_names.extend(effect.name for effect in effects)
        return GAINS

    monkeypatch.setattr(second_effect, "replace", lambda view, **changes: view)
    monkeypatch.setattr(second_effect, "_suggest_second_effects", suggest)
    tried = [
        SimpleNamespace(newest=hypothesis.claims[-1].effect.name, fitted=SimpleNamespace(hypothesis=hypothesis))
        for hypothesis in (
            friction(0.2),
            make_claim_hypothesis(Claim(EFFECTS["force_gain"], "one", (0,)), [{"gain": 2}]),
        )
    ]
    context = SimpleNamespace(excluded=frozenset(), guard=Guard(), map_=map)
    starts, complete = second_effect._find_starts(
        context, SimpleNamespace(rounds=(tried,)), (VIEW, PLAY), CATALOGUE, CountedBudget(99)
    )
    assert complete and starts[0].hypothesis.claims[-1].effect is DRY
    assert len(starts) == (2 if stops else 3)
    assert {"stribeck_friction", "presliding_hysteresis"} <= set(suggested_names)
    assert ("mains_hum" not in suggested_names) == stops
    assert not {"backlash", "loose_joint"} & set(suggested_names)


def test_a_refinement_is_compared_with_its_start_under_the_same_weights(true_level, monkeypatch):
    monkeypatch.setattr(refine_module, "evaluate_hypothesis", second_effect.evaluate_hypothesis)
    monkeypatch.setattr(refine_module, "replace", lambda problem, **changes: problem)
    monkeypatch.setattr(refine_module, "_differentiate_by_deviations", lambda problem, fit: None)
    monkeypatch.setattr(refine_module, "fit_band_power", lambda problem, best, steps: best)
    start = SimpleNamespace(hypothesis=friction(1.0), deviations=np.zeros(0), cost=50.0)
    assert refine_module.refine_band_power(VIEW, start, CountedBudget(9)).cost == pytest.approx(1.0)


@pytest.mark.parametrize(("scatter", "ensemble"), [(0.0, 1), (1e-6, 1), (0.01, refine_module.ENSEMBLE_SIZE)])
def test_predictions_are_averaged_where_chance_changes_the_weights(monkeypatch, scatter, ensemble):
    random = np.random.default_rng(5)
    monkeypatch.setattr(BandPowerProblem, "predict", lambda *_: scatter * random.standard_normal((2, 9, 1)))
    power = SimpleNamespace(measured=np.zeros((2, 9, 1)), stretches=[SimpleNamespace(role="fit")] * 2)
    fit = SimpleNamespace(hypothesis=friction(1.0), deviations=np.zeros(0))
    weighted = refine_module.weight_by_chance_variation(BandPowerProblem(power, SimpleNamespace(), map), fit)
    assert weighted.ensemble == ensemble
    assert np.allclose(weighted.spread.mean(), scatter, atol=0.3 * scatter)


def test_of_each_effect_only_its_best_start_is_kept(true_level):
    starts = [second_effect.evaluate_hypothesis(VIEW, PLAY.deviations, friction(level)) for level in (3.0, 1.1, 2.0)]
    (best,) = second_effect._select_best_per_effect(starts)
    assert level_of(best) == pytest.approx(1.1)


@pytest.fixture
def search_at_cost(monkeypatch):
    """A search whose play alone leaves the given cost, and which refines nothing; with the names of what it fits."""

    def search(play_cost: float, calls: int):
        fitted_names: list[str] = []
        context, explanation = SimpleNamespace(guard=Guard(), excluded=frozenset()), SimpleNamespace(rounds=())
        problem = BandPowerProblem(SimpleNamespace(), SimpleNamespace(), map)
        monkeypatch.setattr(second_effect, "weight_by_chance_variation", lambda problem, fit: problem)
        monkeypatch.setattr(
            second_effect,
            "evaluate_hypothesis",
            lambda problem, deviations, hypothesis: SimpleNamespace(
                hypothesis=hypothesis, deviations=deviations, cost=play_cost if hypothesis is NO_EFFECTS else 1.0
            ),
        )
        monkeypatch.setattr(second_effect, "_suggest_second_effects", lambda *_: [friction(1.0), *GAINS])
        monkeypatch.setattr(BandPowerProblem, "weights", np.ones(1))

        def fit(problem, start, _):
            fitted_names.append(start.hypothesis.claims[-1].effect.name)
            return start

        monkeypatch.setattr(second_effect, "fit_band_power", fit)
        monkeypatch.setattr(second_effect, "refine_band_power", fit)
        found = second_effect.search_second_effects(
            context, explanation, problem, PLAY, CATALOGUE, CountedBudget(calls)
        )
        return found, fitted_names

    return search


@pytest.mark.parametrize(("play_cost", "tried"), [(0.8, False), (2.4, False), (2.6, True), (13.0, True)])
def test_a_second_effect_is_looked_for_only_where_it_can_remove_three_fifths(search_at_cost, play_cost, tried):
    """Chance alone leaves a cost of 1: of 2.5 three fifths are above it."""
    found, fitted_names = search_at_cost(play_cost, 99)
    assert found.complete
    assert bool(found.fits) == bool(fitted_names) == tried


@pytest.mark.parametrize(("calls", "count"), [(0, 0), (1, 0), (2, 1), (3, 2), (99, 3)])
def test_each_fit_ends_in_time(search_at_cost, calls, count):
    found, fitted_names = search_at_cost(13.0, calls)
    assert len(fitted_names) == count
    assert found.complete == (calls == 99)
    assert bool(found.fits) == (count > 0)  # the best fit is kept where no time is left to refine it


@pytest.fixture(scope="module")
def recorded(diagnosed):
    """A search of a device with play and a dead band, before anything was found."""
    play = {"gap": 5e-5, "motor_mass": 0.06, "contact_stiffness": 2e5, "contact_damping": 5.0}
    effects = [
        PlacedEffect(EFFECTS["backlash"], (1,), play),
        PlacedEffect(EFFECTS["force_deadband"], (1,), {"width": 0.3, "jump": 0.0}),
    ]
    chosen = make_measure([diagnosed.recorded(2, effects)], diagnosed.device(2))
    tuning = make_tuning(diagnosed.device(2), ("fx", "fy"))
    context = SearchContext(chosen.measure.shorten(), chosen.measure, tuning, map)
    unchanged = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NO_EFFECTS)
    given = context.with_test_score(context.score_fit(unchanged))
    return context, Explanation(given, given, given, (), ()), chosen.floors


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spread", "refined"),
    [(0.05, True), (50.0, False)],
    ids=["more than chance", "chance alone"],
)
def test_where_chance_alone_explains_the_band_powers_play_is_not_refined(recorded, monkeypatch, spread, refined):
    class RefinedError(Exception):
        pass

    def refuse(problem, start, time_left):
        raise RefinedError

    monkeypatch.setattr(impacts, "refine_band_power", refuse)
    monkeypatch.setattr(impacts, "weight_by_chance_variation", lambda problem, fit: replace(problem, spread=spread))
    with pytest.raises(RefinedError) if refined else contextlib.nullcontext():
        assert impacts.explain_impacts(*recorded, CATALOGUE) is None


def test_play_is_not_refined_once_the_time_has_ended(recorded, monkeypatch):
    monkeypatch.setattr(impacts, "refine_band_power", None)
    assert impacts.explain_impacts(*recorded, CATALOGUE, CountedBudget(0)) is None


@pytest.mark.parametrize(("calls", "said"), [(1, (OUT_OF_TIME,)), (2, ())], ids=["out of time", "no play"])
def test_a_search_for_play_that_ends_early_is_reported(monkeypatch, calls, said):
    monkeypatch.setattr(impacts, "explain_impacts", lambda *_: None)
    monkeypatch.setattr(search_by_simulation, "has_discovered_law", lambda result: False)
    fitting = SimpleNamespace(chosen=SimpleNamespace(floors=()))
    settings = SimpleNamespace(time_left=CountedBudget(calls))
    search = search_by_simulation._ImpactSearch(fitting, CATALOGUE, settings, lambda said, share: None)
    context, explanation = SimpleNamespace(certain=(), guard=Guard()), SimpleNamespace(steps=())
    result = search.explain_at_end(SearchResult(context, explanation, Judgement("unexplained", named=False)))
    assert (result.judgement.verdict, result.remarks) == ("unexplained", said)


@pytest.mark.parametrize("steps", [0, 1])
def test_play_is_looked_for_before_pairs_where_no_single_effect_is_worth_adding(recorded, monkeypatch, steps):
    context, explanation, floors = recorded
    fitting = SimpleNamespace(chosen=SimpleNamespace(floors=floors))
    play_search = search_by_simulation._ImpactSearch(
        fitting, CATALOGUE, SimpleNamespace(time_left=CountedBudget(9)), lambda said, share: None
    )
    with_play = replace(explanation, statistic=Statistic(np.ones(1), np.ones(0)))
    found, added = SearchResult(context, with_play, Judgement("explained", named=True)), []

    def add(context, catalogue, selected, progress, time_left, max_effects=3):
        added.append(max_effects)
        return replace(explanation, steps=(explanation.after,) * steps)

    monkeypatch.setattr(search, "start_explanation", lambda *_: explanation)
    monkeypatch.setattr(search, "add_effects", add)
    monkeypatch.setattr(search, "exchange_first_for_relatives", lambda context, pair, *_: pair)
    monkeypatch.setattr(search_by_simulation._ImpactSearch, "_search_for_play", lambda *_: found)
    searches = search.FurtherSearches(play_search.explain_before_second_effect, lambda result: found)
    assert search.search_effects(context, CATALOGUE, lambda said, share: None, further=searches) is found
    assert added == ([1] if steps == 0 else [1, 2])


@pytest.mark.slow
def test_a_dead_band_that_no_waveform_shows_is_named_with_play(recorded):
    found = impacts.explain_impacts(*recorded, CATALOGUE)
    assert [claim.effect.name for claim in found.after.fitted.hypothesis.claims] == ["backlash", "force_deadband"]
    width_n = found.after.fitted.hypothesis.list_placed_effects()[-1].values["width"]
    assert width_n == pytest.approx(0.3, rel=0.15)
