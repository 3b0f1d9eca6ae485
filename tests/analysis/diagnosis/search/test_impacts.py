"""Play that rattles, told by the band powers of the response; what does not rattle is left alone."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.document import diagnosis_from_json, diagnosis_to_json
from analysis.diagnosis.errors.band_power import BandPower
from analysis.diagnosis.errors.band_power_fit import BandPowerProblem, _estimate_errors, _get_step, evaluate_hypothesis
from analysis.diagnosis.errors.choose_measure import make_measure
from analysis.diagnosis.errors.fit_score import FitScore
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS, Claim, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.result.assemble_findings import list_impact_remainder
from analysis.diagnosis.result.wording import write_summary_lines
from analysis.diagnosis.search.band_power_comparison import make_band_power_comparison
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.identifiability import find_undetermined
from analysis.diagnosis.search.impacts import _needs_gap, explain_impacts, is_irregular
from analysis.diagnosis.search.search import FurtherSearches, search_effects
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.verdict import Judgement, SearchResult, judge
from analysis.diagnosis.search_by_simulation import _ImpactSearch
from equalizer.effects.backlash import EFFECT as PLAY
from equalizer.effects.catalogue import CATALOGUE, EFFECTS
from equalizer.effects.coulomb_friction import EFFECT as DRY
from equalizer.effects.effect import PlacedEffect
from study.evaluation.challenge.case_settings import CaseSettings
from study.evaluation.challenge.draw_case import draw_case

GAP_M, AXIS = 5e-5, 1
LOOSE = (PlacedEffect(PLAY, (AXIS,), dict(gap=GAP_M, motor_mass=0.06, contact_stiffness=2e5, contact_damping=5.0)),)


def searched(real, effects, repeats=True):
    """The recording before a search has found anything: context, explanation, floors."""
    recording = real.recorded(2, effects)
    if not repeats:
        recording = replace(recording, segments=tuple(replace(segment, period=0) for segment in recording.segments))
    chosen = make_measure([recording], real.device(2))
    context = SearchContext(chosen.measure.shorten(), chosen.measure, make_tuning(real.device(2), ("fx", "fy")), map)
    unchanged = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NO_EFFECTS)
    whole = context.with_test_score(context.score_fit(unchanged))  # as a search hands it over: with the sealed samples
    return context, Explanation(whole, whole, whole, (), ()), chosen.floors


@pytest.fixture(scope="module")
def loose(diagnosed):
    return searched(diagnosed, LOOSE)


@pytest.fixture(scope="module")
def told(loose):
    return explain_impacts(*loose, CATALOGUE)


@pytest.mark.slow
def test_play_that_rattles_is_named_at_its_axis_with_its_gap(told):
    (claim,) = told.after.fitted.hypothesis.claims
    assert (claim.effect.name, claim.sites) == ("backlash", (AXIS,))
    assert told.after.fitted.hypothesis.list_placed_effects()[0].values["gap"] == pytest.approx(GAP_M, rel=0.1)


def test_errors_stay_small_where_parameters_are_correlated():
    """Two columns with a correlation of 0.95, of whose information a third is chance."""
    number = make_claim_hypothesis(Claim(PLAY, "one", (AXIS,)), [LOOSE[0].values]).parameters[0]
    power = 2 * _get_step(number) ** 2
    problem = SimpleNamespace(spread=np.sqrt(power * 30.0), ensemble=1, weights=np.ones((1, 1, 1)))
    at = SimpleNamespace(
        hypothesis=SimpleNamespace(parameters=(number, number)), predicted=np.zeros((1, 1, 1)), cost=1.0
    )
    errors = _estimate_errors(problem, at, np.array([[90.0, 85.5], [85.5, 90.0]]))
    # Without chance: 1 / sqrt(90 (1 - 0.95^2)) = 0.34; with two thirds of the information, sqrt(3 / 2) of that.
    assert errors == pytest.approx([0.34 * np.sqrt(1.5)] * 2, rel=0.01)


@pytest.mark.slow
def test_it_is_as_far_from_the_record_as_chance_takes_it_and_its_parameters_have_errors(told):
    assert judge(told).verdict == "explained"
    assert told.after.score.worst_channel < 2.5 < told.retuned.score.worst_channel
    assert np.all(told.statistic.chance >= 0.05)
    errors = told.statistic.errors
    assert errors.shape == told.after.fitted.hypothesis.point.shape
    assert np.all((errors > 0) & (errors < 0.5))


@pytest.mark.slow
def test_a_gap_whose_interval_contains_zero_is_open(loose, told):
    assert not any(find_undetermined(loose[0], told))
    wide = replace(told.statistic, errors=np.ones_like(told.statistic.errors))
    assert all(find_undetermined(loose[0], replace(told, statistic=wide)))


@pytest.mark.slow
def test_play_whose_gap_is_open_is_not_named(loose, monkeypatch):
    monkeypatch.setattr("analysis.diagnosis.search.identifiability.INTERVAL_FACTOR", 1e6)
    assert explain_impacts(*loose, CATALOGUE) is None


@pytest.fixture(scope="module")
def humming(diagnosed):
    hum = PlacedEffect(EFFECTS["mains_hum"], (0, 1), {"amplitude": 2.0, "frequency": 60.0, "phase": 1.0})
    return explain_impacts(*searched(diagnosed, (*LOOSE, hum)), CATALOGUE)


@pytest.mark.slow
def test_a_hum_of_the_sensor_is_named_beside_play(humming):
    assert [each.effect.name for each in humming.after.fitted.hypothesis.claims] == ["backlash", "mains_hum"]
    played, *_, hum = humming.after.fitted.hypothesis.list_placed_effects()
    assert played.values["gap"] == pytest.approx(GAP_M, rel=0.2)
    assert hum.values["frequency"] == pytest.approx(60.0, abs=0.5)
    assert hum.values["amplitude"] == pytest.approx(2.0, rel=0.2)
    assert len(humming.steps) == len(humming.rounds) == 2
    assert len(humming.statistic.errors) == len(humming.after.fitted.hypothesis.point)
    assert judge(humming).verdict == "explained"


@pytest.mark.slow
def test_a_friction_that_the_search_tried_is_named_beside_play(diagnosed):
    context, found, floors = searched(diagnosed, (*LOOSE, PlacedEffect(DRY, (AXIS,), {"level": 0.3})))
    # The wrong one was likelier where waveforms were compared, and is refuted by the powers.
    laws = (("viscous_damping", {"damping": 2.0}), ("coulomb_friction", {"level": 0.2}))
    claims = [make_claim_hypothesis(Claim(EFFECTS[name], "one", (AXIS,)), [values]) for name, values in laws]
    at = found.retuned.fitted.deviations
    tried = tuple(context.score_fit(evaluate_fit(context.measure, context.tuning, at, each)) for each in claims)
    rubbed = explain_impacts(context, replace(found, rounds=(tried,)), floors, CATALOGUE)
    assert [each.effect.name for each in rubbed.after.fitted.hypothesis.claims] == ["backlash", "coulomb_friction"]
    level = rubbed.after.fitted.hypothesis.list_placed_effects()[-1].values["level"]
    assert level == pytest.approx(0.3, rel=0.15)
    assert judge(rubbed).verdict == "explained"


@pytest.mark.slow
def test_without_time_no_second_effect_is_looked_for(diagnosed):
    hum = PlacedEffect(EFFECTS["mains_hum"], (0, 1), {"amplitude": 2.0, "frequency": 60.0, "phase": 1.0})
    late = explain_impacts(*searched(diagnosed, (*LOOSE, hum)), CATALOGUE, lambda: False)
    assert late is None or len(late.steps) == 1


@pytest.mark.slow
def test_beside_play_alone_no_fault_of_the_sensor_is_named(told):
    assert len(told.steps) == 1


def asks_gap(real, gap_m, supposed_m):
    """Whether a recording of two bodies with such a gap needs the supposed one."""
    (played,) = LOOSE
    context, *_ = searched(real, (replace(played, values={**played.values, "gap": gap_m}),))
    problem = BandPowerProblem(BandPower(context.measure), context.tuning, map)
    supposed = make_claim_hypothesis(Claim(PLAY, "one", (AXIS,)), [{**played.values, "gap": supposed_m}])
    fitted = evaluate_hypothesis(problem, np.zeros(len(context.tuning.names)), supposed)
    return _needs_gap(make_band_power_comparison(context, fitted), problem, fitted)


@pytest.mark.slow
def test_two_bodies_that_touch_need_no_gap_and_play_does(diagnosed):
    assert not asks_gap(diagnosed, 1e-9, 1e-7)
    assert asks_gap(diagnosed, GAP_M, GAP_M)


@pytest.mark.slow
def test_play_that_needs_no_gap_is_not_named(loose, monkeypatch):
    monkeypatch.setattr("analysis.diagnosis.search.impacts._needs_gap", lambda *asked: False)
    assert explain_impacts(*loose, CATALOGUE) is None


@pytest.mark.slow
def test_commands_that_are_skipped_are_no_play():
    """Irregular, and as far from the record as chance takes it; but the gap may be zero."""
    case = draw_case(
        100021, ("skipped_commands",), "retuned", 0.5945393048969988, settings=CaseSettings((0,), 2000, 3, 1.0, 80)
    )
    found = diagnose([case.recording], case.model, DiagnosisSettings(discovery=False), map, lambda what, share: None)
    assert found.diagnosis.verdict == "unexplained"
    assert found.diagnosis.effects == ()


def test_two_courses_of_one_play_agree_in_their_band_powers_but_not_sample_by_sample(loose):
    context = loose[0]
    apart = tuple(replace(each, values={**each.values, "gap": GAP_M * (1 + 1e-9)}) for each in LOOSE)
    courses = [context.full_measure.residuals(context.tuning.model, effects) for effects in (LOOSE, apart)]
    power = BandPower(context.full_measure)
    off = power.compute_misfits(power.predict(courses[0]) - power.predict(courses[1]))
    assert max(off.fit.max(), off.choose.max(), off.test.max()) < 0.2
    assert np.std(courses[0][0] - courses[1][0], axis=0)[AXIS] > 10


@pytest.mark.slow
def test_what_is_left_is_reported_by_channel_and_not_by_the_sequence_of_impacts(loose, told):
    assert list_impact_remainder(loose[0].full_measure, told) == ()
    further = replace(told, after=replace(told.after, score=FitScore(*np.array([[1, 4, 1, 1.0]] * 3))))
    (left,) = list_impact_remainder(loose[0].full_measure, further)
    assert (left.output, left.band_hz) == ("ay", (0.0, 500.0))
    assert left.share == pytest.approx(4 * told.statistic.chance[1])
    assert judge(further).verdict == "partly_explained"


def test_a_device_that_repeats_is_left_alone(diagnosed):
    rubs = searched(diagnosed, (PlacedEffect(DRY, (0,), {"level": 0.2}),))
    assert not is_irregular(*rubs)
    assert explain_impacts(*rubs, CATALOGUE) is None


@pytest.fixture
def looked(loose, told, monkeypatch):
    """The search for play with its result given, and the explanations that it was asked beside."""
    asked = []

    def found(context, explanation, *given):
        asked.append(explanation)
        return told

    monkeypatch.setattr("analysis.diagnosis.search.impacts.explain_impacts", found)
    fitting = SimpleNamespace(chosen=SimpleNamespace(floors=loose[2]))
    return _ImpactSearch(fitting, CATALOGUE, DiagnosisSettings(), lambda said, share: None), asked


@pytest.mark.slow
def test_play_is_looked_for_before_a_third_effect_and_once(loose, told, looked):
    context, (impacts, asked) = loose[0], looked
    few = [EFFECTS["coulomb_friction"], EFFECTS["added_mass"]]
    thirds = FurtherSearches(before_thirds=impacts.explain_before_third_effect)
    result = search_effects(context, few, lambda said, share: None, further=thirds)
    assert (result.found, result.judgement.verdict) == (told, "explained")
    assert len(asked) == 1 and len(asked[0].steps) <= 2
    assert impacts.explain_at_end(SearchResult(context, loose[1], Judgement("unexplained", False))).found is told
    assert len(asked) == 1
    # More effects by then are rivals that were not compared.
    more = replace(loose[1], steps=(*asked[0].steps, loose[1].after))
    assert impacts.explain_at_end(SearchResult(context, more, Judgement("unexplained", False))).found is told
    assert len(asked) == 2


@pytest.mark.slow
def test_play_is_not_looked_for_beside_what_explains_or_is_named_or_without_time(loose, told, looked):
    context, (impacts, asked) = loose[0], looked
    for seen in (
        SearchResult(context, told, Judgement("explained", True)),
        SearchResult(context, replace(loose[1], after=told.after, statistic=told.statistic), Judgement("", False)),
    ):
        assert impacts.explain_before_third_effect(seen) is seen
    varied = SimpleNamespace(chosen=SimpleNamespace(floors=()))
    unrepeated = _ImpactSearch(varied, CATALOGUE, DiagnosisSettings(), lambda said, share: None)
    open_ended = SearchResult(context, loose[1], Judgement("unexplained", False))
    assert unrepeated.explain_before_third_effect(open_ended) is open_ended
    late = _ImpactSearch(varied, CATALOGUE, DiagnosisSettings(time_left=lambda: False), lambda said, share: None)
    assert late.explain_before_third_effect(open_ended) is open_ended and late.explain_at_end(open_ended) is open_ended
    assert asked == []


def test_without_play_in_the_catalogue_nothing_is_named(loose):
    assert explain_impacts(*loose, [each for each in CATALOGUE if each.name != "backlash"]) is None


def test_where_nothing_repeats_peaks_give_rattle_away(diagnosed):
    assert is_irregular(*searched(diagnosed, LOOSE, repeats=False))
    assert not is_irregular(*searched(diagnosed, (), repeats=False))


@pytest.mark.slow
def test_the_whole_diagnosis_says_what_was_compared(diagnosed):
    kept = ("backlash", "loose_joint", "extra_mode")
    others = tuple(each.name for each in CATALOGUE if each.name not in kept)
    recording = diagnosed.recorded(2, LOOSE)
    found = diagnose([recording], diagnosed.device(2), DiagnosisSettings(others), map, lambda said, share: None)
    (effect,) = found.diagnosis.effects
    assert (effect.effect, effect.axis) == ("backlash", "y")
    low, high = effect.parameters["gap"].ci95
    assert low < effect.parameters["gap"].value < high
    assert found.diagnosis.fit.test.after < 0.4 * found.diagnosis.fit.test.retuned
    assert diagnosis_from_json(diagnosis_to_json(found.diagnosis)) == found.diagnosis
    lines = " ".join(write_summary_lines(found))
    assert "Its impacts cannot be predicted one by one" in lines
    assert "the power of each channel in each half octave" in lines


@pytest.mark.slow
@pytest.mark.parametrize("seed", [9002, 9003, 9005])
def test_play_in_a_simulated_bench_is_named_with_its_gap(seed):
    case = draw_case(seed, ["backlash"])
    found = diagnose([case.recording], case.model, DiagnosisSettings(), map, lambda said, share: None)
    (effect,) = found.diagnosis.effects
    (truth,) = case.truth
    assert (effect.effect, effect.axis) == ("backlash", truth.axis)
    assert effect.parameters["gap"].value == pytest.approx(truth.values["gap"], rel=0.06)
    assert found.diagnosis.verdict == "explained"


@pytest.mark.slow
@pytest.mark.parametrize("decoy", ["creep", "stiffness_in_time", "crossed_axes", "bending_sensor", "force_hysteresis"])
def test_what_is_no_play_is_not_taken_for_it(decoy):
    case = draw_case(9102, [decoy])
    found = diagnose([case.recording], case.model, DiagnosisSettings(), map, lambda said, share: None)
    assert "backlash" not in found.diagnosis.returned_set
