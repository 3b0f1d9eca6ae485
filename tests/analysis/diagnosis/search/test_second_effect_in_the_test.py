"""A second effect that only louder, held-out stretches show is added to a name, on devices that were not built from the
catalogue's laws."""

import pytest

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.errors.choose_measure import make_measure
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.search import search
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.time_budget import OUT_OF_TIME, OutOfTimeError, grant_time
from analysis.diagnosis.search.verdict import Judgement
from equalizer.effects.catalogue import EFFECTS
from study.evaluation.challenge.draw_bank import draw_case_plan, generate_case

SEED, SLOW_SENSOR_AND_HARDENING = 99100, 102


@pytest.fixture(scope="module")
def case():
    return generate_case(draw_case_plan(SEED, SLOW_SENSOR_AND_HARDENING), "sledge")


def diagnose_names(case, time_left=grant_time):
    settings = DiagnosisSettings(discovery=False, time_left=time_left)
    found = diagnose([case.recording], case.model, settings, map, lambda what, share: None)
    return found.diagnosis.verdict, {effect.effect for effect in found.diagnosis.effects}, found.remarks


@pytest.mark.slow
def test_it_is_found_in_a_part_of_the_test_and_confirmed_by_the_rest(case):
    assert {truth.effect for truth in case.truth} == {"sensor_lag", "hardening_stiffness"}
    verdict, named, remarks = diagnose_names(case)
    assert (verdict, named) == ("explained", {"sensor_lag", "hardening_stiffness"})
    assert search.MILDER_TEST_USED in remarks


@pytest.mark.slow
def test_where_the_time_ends_with_the_opened_part_the_first_alone_is_named_and_that_is_said(case, monkeypatch):
    opened, find = [], search._repeat_with_opened

    def find_late(*given):
        opened.append(given)
        return find(*given)

    monkeypatch.setattr(search, "_repeat_with_opened", find_late)
    verdict, named, remarks = diagnose_names(case, lambda: not opened)
    assert (verdict, named) == ("partly_explained", {"sensor_lag"})
    assert len(opened) == 1 and OUT_OF_TIME in remarks


@pytest.mark.slow
def test_time_that_ends_there_hides_no_mismatch_of_the_held_out_samples(case, monkeypatch):
    def ends(*given):
        raise OutOfTimeError

    monkeypatch.setattr(search, "_search_with_opened", ends)
    monkeypatch.setattr(search, "_judge_with_prediction", lambda *found: Judgement("no_mismatch", False))
    measure = make_measure([case.recording], case.model).measure
    tuning = make_tuning(case.model, case.recording.command.channels)
    context = SearchContext(measure.shorten(), measure, tuning, map)
    found = search.search_effects(context, [EFFECTS["sensor_lag"]], lambda what, share: None)
    assert found.judgement == Judgement("unexplained", False)
    assert search.TEST_ONLY in found.remarks and OUT_OF_TIME in found.remarks


@pytest.mark.slow
def test_without_that_look_the_first_alone_is_named(case, monkeypatch):
    monkeypatch.setattr(search, "_adds_confirmed", lambda *of: False)
    verdict, named, _ = diagnose_names(case)
    assert (verdict, named) == ("partly_explained", {"sensor_lag"})
