"""One settled period of each segment tells of a law what the whole recording does."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.choose_measure import measure_by_force
from analysis.diagnosis.errors.hypothesis import NOTHING, Claim, hypothesis_of_claim
from analysis.diagnosis.errors.output_error import evaluate_fit, sensitivity
from analysis.diagnosis.search import short_recordings
from analysis.diagnosis.search.screening import ScreenedHypothesis
from analysis.diagnosis.search.short_recordings import _keep_promising, short_recordings_of
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect

LAG = {"time_constant": 0.002}


def claim(name, **values):
    return hypothesis_of_claim(Claim(EFFECTS[name], "one", (0,)), [values])


@pytest.fixture(scope="module")
def lagging(arena_of):
    return arena_of((PlacedEffect(EFFECTS["amplifier_lag"], (0,), LAG),))


def held(context, hypothesis=NOTHING):
    return evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), hypothesis)


def error(context, hypothesis):
    return held(context, hypothesis).cost


def test_it_holds_one_period_of_each_segment_and_a_run_in(lagging):
    short = short_recordings_of(lagging, held(lagging))
    (record,), (long,) = short.context.measure.records, lagging.measure.records
    assert record.fit.sum() == 2 * 1000  # of three levels one is kept to choose by
    assert len(record.command) < 0.7 * len(long.command)
    assert np.array_equal(record.measured, long.measured[short.kept[0]])


def test_the_true_law_leaves_noise_alone_on_it_and_no_law_leaves_what_it_leaves_on_the_whole(lagging):
    short = short_recordings_of(lagging, held(lagging)).context
    assert error(short, claim("amplifier_lag", **LAG)) == pytest.approx(
        error(lagging, claim("amplifier_lag", **LAG)), rel=0.05
    )
    assert error(short, NOTHING) == pytest.approx(error(lagging, NOTHING), rel=0.05)


def test_without_a_run_in_the_true_law_would_leave_more_than_noise(lagging, monkeypatch):
    monkeypatch.setattr(short_recordings, "RUN_IN_CONSTANTS", 0.0)
    short = short_recordings_of(lagging, held(lagging)).context
    assert error(short, claim("amplifier_lag", **LAG)) > 1.5 * error(lagging, claim("amplifier_lag", **LAG))


def test_evidence_is_cut_like_the_samples(lagging):
    short = short_recordings_of(lagging, held(lagging))
    base = evaluate_fit(lagging.measure, lagging.tuning, np.zeros(len(lagging.tuning.names)), NOTHING)
    (whole,) = lagging.measure.evidence(lagging.tuning.model, (), base.residuals)
    cut = short.of(whole)
    assert np.array_equal(cut.axis_force, whole.axis_force[short.kept[0]])
    assert cut.used.sum() == short.context.measure.records[0].fit.sum()
    assert cut.noise is whole.noise


def test_there_is_none_where_what_is_held_hangs_on_the_time(lagging):
    drifting = claim("sensor_drift", total=1.0, bend=0.0, start=0.0)
    assert short_recordings_of(lagging, held(lagging, drifting)) is None


STUCK = {"level": 0.2, "stiffness": 400.0}


@pytest.mark.parametrize("patient", [True, False])
def test_friction_that_remembers_what_was_cut_out_gets_a_longer_run_in(arena_of, monkeypatch, patient):
    if not patient:
        monkeypatch.setattr(short_recordings, "RUN_IN_ERROR", np.inf)
        monkeypatch.setattr(short_recordings, "_continue_from", lambda short, measure, held: short)
    rubbing = arena_of((PlacedEffect(EFFECTS["presliding_hysteresis"], (0,), STUCK),))
    true = held(rubbing, claim("presliding_hysteresis", **STUCK))
    short = short_recordings_of(rubbing, true)
    assert (error(short.context, true.hypothesis) < 1.1 * true.cost) == patient
    assert len(short.kept[0]) < 0.7 * len(rubbing.measure.records[0].command)


@pytest.mark.timeout(60)
def test_a_fit_that_ran_away_agrees_with_no_run_in_and_the_whole_is_compared(lagging):
    """Of three levels one is kept to choose by: where it comes last, all before what is fitted may be kept already."""
    running = held(lagging, claim("hardening_stiffness", k3=1e3))
    away = replace(running, residuals=tuple(np.full_like(each, np.nan) for each in running.residuals), cost=np.inf)
    (record,) = lagging.measure.records
    early = record.fit & (np.arange(len(record.fit)) < np.flatnonzero(record.fit)[0] + 2000)
    cut = Observed(record.recording, record.command, record.measured, early, record.choose, record.test)
    context = replace(lagging, measure=lagging.measure.with_records((cut,)))
    assert short_recordings_of(context, away) is None


def test_the_sensitivities_of_one_period_stand_for_those_of_all(lagging):
    short, at = short_recordings_of(lagging, held(lagging)), np.zeros(len(lagging.tuning.names))
    (record,) = lagging.measure.records
    whole = sensitivity(lagging.measure, lagging.tuning, at, NOTHING)
    found = short.repeat_sensitivity(sensitivity(short.context.measure, short.context.tuning, at, NOTHING))
    everywhere = found.over(0, whole.columns.shape[1])
    later = np.ones(len(record.fit), dtype=bool)
    for segment in record.recording.segments:
        later[segment.start : segment.start + segment.period] = False  # in which the motion settles
    told = np.repeat(later[record.fit], record.measured.shape[1])
    errors = whole.columns * told
    wanted, scale = whole.columns @ errors.T, np.linalg.norm(whole.columns, axis=1)
    off = np.abs(found.on(errors) - wanted) / np.outer(scale, scale)
    assert off.max() < 0.02
    assert found.on(errors[0]) == pytest.approx(found.on(errors)[:, 0])
    assert (np.linalg.norm((everywhere - whole.columns) * told, axis=1) < 0.02 * scale).all()
    assert found.squares == pytest.approx(everywhere @ everywhere.T)
    assert found.on(errors) == pytest.approx(everywhere @ errors.T)
    turned = np.roll(errors, 100 * record.measured.shape[1], axis=1)
    assert (np.abs(found.on(turned) - wanted) / np.outer(scale, scale)).max() > 0.2


@pytest.fixture(scope="module")
def by_force(lagging):
    recordings = [record.recording for record in lagging.whole.records]
    measure = measure_by_force(recordings, lagging.tuning.model, None).measure
    return replace(lagging, measure=measure.shorten(), whole=measure)


def apart_by_force(context):
    """(samples,): force that is missing in pieces, less that in the whole, over the latter's rms."""
    short, measure = short_recordings_of(context, held(context)), context.measure
    pieces = short.context.measure.residuals(context.tuning.model, ())
    (whole,), places = measure.residuals(context.tuning.model, ()), np.split(short.kept[0], np.cumsum(lengths(short)))
    fits = [record.fit for record in short.context.measure.records]
    off = [piece[fit] - whole[at][fit] for piece, at, fit in zip(pieces, places, fits, strict=False)]
    return np.concatenate(off).ravel() / whole[measure.records[0].fit].std()


def lengths(short):
    return [len(record.command) for record in short.context.measure.records][:-1]


def test_forces_are_compared_stretch_by_stretch(by_force):
    short = short_recordings_of(by_force, held(by_force))
    assert len(short.context.measure.records) == 2
    assert len(short.kept[0]) < 0.7 * len(by_force.measure.records[0].command)
    assert np.abs(apart_by_force(by_force)).max() < 0.01


def test_without_what_lies_around_stretches_forces_would_differ(by_force, monkeypatch):
    monkeypatch.setattr(short_recordings, "RUN_IN_CONSTANTS", 0.0)
    assert np.abs(apart_by_force(by_force)).max() > 0.05


def test_a_period_cut_off_by_the_end_of_the_record_represents_no_other(lagging):
    (record,) = lagging.measure.records
    ends = record.recording.segments[0].stop - 300
    cut = [getattr(record, name)[:ends] for name in ("command", "measured", "fit", "choose", "test")]
    context = replace(lagging, measure=lagging.measure.with_records((Observed(record.recording, *cut),)))
    short = short_recordings_of(context, held(context))
    assert short is None or short.stands_in.max() < sum(each.fit.sum() for each in short.context.measure.records)


@pytest.mark.parametrize("coarse", [4.0, 10.0, 16.0])
def test_laws_of_time_are_kept_by_the_share_that_they_promise_of_the_cost_there(coarse):
    base, from_, law = (SimpleNamespace(cost=cost) for cost in (10.0, coarse, 5.0))
    screened = [ScreenedHypothesis(NOTHING, from_.cost * (1 - share)) for share in (0.4, 0.05)]
    assert _keep_promising((base, [law]), from_, screened) == screened[:1]
    assert _keep_promising((base, []), from_, screened) == screened


@pytest.fixture(scope="module")
def rubbing(arena_of):
    return arena_of((PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": 0.1}),))


def test_under_friction_each_piece_begins_as_the_whole_simulation_is_there(rubbing, monkeypatch):
    law = held(rubbing, claim("coulomb_friction", level=0.1))
    assert len(short_recordings_of(rubbing, law).context.measure.pieces) == 1
    monkeypatch.setattr(short_recordings, "RUN_IN_CONSTANTS", 0.5)
    continued = short_recordings_of(rubbing, law)
    monkeypatch.setattr(short_recordings, "_continue_from", lambda short, measure, held: short)
    from_rest = short_recordings_of(rubbing, law)
    assert from_rest is None or len(from_rest.kept[0]) > 1.2 * len(continued.kept[0])
