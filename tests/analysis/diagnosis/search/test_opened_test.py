"""What is opened of the held-out samples where only they show a mismatch, and what stays sealed. Compiles."""

from dataclasses import replace

import pytest

from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.search import search, search_context
from analysis.diagnosis.search.search_context import FINER_PARTS, HALVES
from analysis.diagnosis.search.verdict import MILDER_TEST_USED, TEST_PARTS_USED
from equalizer.effects.catalogue import CATALOGUE
from study.evaluation.challenge.draw_bank import draw_case_plan, generate_case
from tests.diagnosed import device
from tests.lawful import arena_of, law, recorded

CUBIC = law("-p0*x**3", 4e5)
SWEEP_AND_LOUDER = (*(("multisine", level, "fit") for level in (0.1, 0.15, 0.2)), ("sweep", 1.5, "test"),
                    ("multisine", 3.0, "test"))  # fmt: skip
ONE_LEVEL = (*(("multisine", level, "fit") for level in (0.1, 0.15, 0.2)), ("multisine", 3.0, "test"))


@pytest.fixture(scope="module")
def sweep_recording():
    return recorded((CUBIC,), 3, plan=SWEEP_AND_LOUDER)


def test_all_but_the_loudest_is_opened_and_the_loudest_stays_sealed(sweep_recording):
    context, known = arena_of(sweep_recording)
    opened = context.open_quieter_segments(known.retuned)
    assert opened is not None
    sweep, loud = (slice(s.start, s.stop) for s in sweep_recording.segments[-2:])
    record = opened.full_measure.records[0]
    assert not record.test[sweep].any() and (record.fit | record.choose)[sweep].all()
    assert record.test[loud].all() and not (record.fit | record.choose)[loud].any()
    assert len(opened.measure.records[0].fit) <= loud.start


def test_nothing_is_opened_of_a_test_of_one_level_or_where_the_milder_part_shows_nothing(sweep_recording):
    context, known = arena_of(recorded((CUBIC,), 3, plan=ONE_LEVEL))
    assert context.open_quieter_segments(known.retuned) is None
    context, known = arena_of(recorded((), 3, plan=SWEEP_AND_LOUDER))
    assert context.open_quieter_segments(known.retuned) is None


def test_the_milder_part_is_opened_only_for_what_the_test_shows_most(sweep_recording):
    context, known = arena_of(sweep_recording)
    residuals = known.retuned.fitted.residuals[0].copy()
    residuals[:, 0] *= 1e-3  # the milder part shows much in the position alone,
    louder = replace(known.retuned.fitted, residuals=(residuals,))
    most = known.retuned.score.test.copy()
    position = replace(known.retuned, fitted=louder)
    assert (
        context.open_quieter_segments(replace(position, score=replace(position.score, test=most * [0, 1]))) is not None
    )
    # and the whole shows most in the acceleration.
    assert context.open_quieter_segments(replace(position, score=replace(position.score, test=most * [1, 0]))) is None


def test_the_milder_part_is_opened_only_where_the_loudest_can_confirm(sweep_recording):
    context, known = arena_of(sweep_recording)
    residuals = known.retuned.fitted.residuals[0].copy()
    residuals[sweep_recording.segments[-1].start :] *= 1e-3
    quiet = replace(known.retuned, fitted=replace(known.retuned.fitted, residuals=(residuals,)))
    assert context.open_quieter_segments(known.retuned) is not None
    assert context.open_quieter_segments(quiet) is None


def test_opened_samples_are_to_fit_and_the_last_third_to_choose_by(sweep_recording):
    record = observe_parts([sweep_recording], 1)[0]
    opened = record.release_test_samples(record.mask_alternate_parts(2))
    both = opened.fit | opened.choose
    assert not (both & opened.test).any()
    assert (both | opened.test).sum() == (record.fit | record.choose | record.test).sum()
    added = both & record.test
    assert added.sum() == pytest.approx(record.test.sum() / 2, abs=2)
    assert (opened.choose & record.test).sum() == pytest.approx(added.sum() / 3, abs=2)


@pytest.mark.slow
def test_a_law_that_only_the_test_shows_is_named_and_proved_by_the_loudest(sweep_recording):
    settings = DiagnosisSettings(discovery=True, without=("hardening_stiffness", "softening_stiffness", "end_stop"))
    found = diagnose([sweep_recording], device(1), settings, map, lambda what, share: None)
    effects = found.diagnosis.effects
    assert found.diagnosis.verdict == "explained"
    assert [effect.effect for effect in effects] == ["discovered_law"]
    assert effects[0].law.expression.endswith("*x**3")
    assert effects[0].parameters["p0"].value == pytest.approx(-4e5, rel=0.05)
    assert MILDER_TEST_USED in found.remarks


def test_stretches_that_show_it_in_one_half_alone_are_opened_in_finer_parts(sweep_recording):
    context, known = arena_of(sweep_recording)
    _, parts = context.open_alternate_parts(known.retuned)
    assert parts == HALVES
    residuals = known.retuned.fitted.residuals[0].copy()
    for stretch in sweep_recording.segments[-2:]:
        residuals[(stretch.start + stretch.stop) // 2 : stretch.stop] *= 1e-3
    early = replace(known.retuned, fitted=replace(known.retuned.fitted, residuals=(residuals,)))
    opened, parts = context.open_alternate_parts(early)
    assert parts == FINER_PARTS[0]
    record, before = opened.full_measure.records[0], context.full_measure.records[0]
    loud = sweep_recording.segments[-1]
    length = (loud.stop - loud.start) // parts
    for number in range(parts):
        middle = loud.start + number * length + length // 2
        assert before.test[middle]
        assert record.test[middle] == (number % 2 == 1)


STOP_AND_SENSOR = draw_case_plan(102000, 86)
"""A stop that a sweep reaches a few times, beside a nonlinear sensor that all segments show."""


COARSE_ALONE = pytest.param(FINER_PARTS[:1], set(), marks=pytest.mark.slow)


@pytest.mark.slow
@pytest.mark.parametrize(("finer", "named"), [COARSE_ALONE, (FINER_PARTS, set(STOP_AND_SENSOR.effects))])
def test_few_contacts_with_a_stop_are_found_in_fine_parts_alone(finer, named, monkeypatch):
    monkeypatch.setattr(search_context, "FINER_PARTS", finer)
    monkeypatch.setattr(search, "FINER_PARTS", finer)
    case = generate_case(STOP_AND_SENSOR, "device")
    among = {*STOP_AND_SENSOR.effects, "sensor_gain", "hardening_stiffness"}
    others = tuple(effect.name for effect in CATALOGUE if effect.name not in among)
    settings = DiagnosisSettings(discovery=False, without=others)
    found = diagnose([case.recording], case.model, settings, map, lambda what, share: None)
    assert {effect.effect for effect in found.diagnosis.effects} == named
    assert (found.diagnosis.verdict == "explained") is bool(named)
    assert (TEST_PARTS_USED in found.remarks) is bool(named)
