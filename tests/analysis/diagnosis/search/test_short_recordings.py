"""One settled period of each segment tells of a law what the whole recording does."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.choose_measure import make_force_measure
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS, Claim, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import build_jacobian, evaluate_fit
from analysis.diagnosis.search import next_effect, short_recordings
from analysis.diagnosis.search.next_effect import (
    _fit_on_short_recordings,
    _keep_promising,
    _select_worth_continuing,
)
from analysis.diagnosis.search.screening import ScreenedHypothesis
from analysis.diagnosis.search.short_recordings import shorten_recordings
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect

LAG = {"time_constant": 0.002}


def make_hypothesis(name, **values):
    return make_claim_hypothesis(Claim(EFFECTS[name], "one", (0,)), [values])


@pytest.fixture(scope="module")
def lag_context(make_context):
    return make_context((PlacedEffect(EFFECTS["amplifier_lag"], (0,), LAG),))


def evaluate_at_zero(context, hypothesis=NO_EFFECTS):
    return evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), hypothesis)


def cost_at_zero(context, hypothesis):
    return evaluate_at_zero(context, hypothesis).cost


def test_it_holds_one_period_of_each_segment_and_a_run_in(lag_context):
    short = shorten_recordings(lag_context, evaluate_at_zero(lag_context))
    (record,), (long,) = short.context.measure.records, lag_context.measure.records
    assert record.fit.sum() == 2 * 1000  # of three levels one is kept to choose by
    assert len(record.command) < 0.7 * len(long.command)
    assert np.array_equal(record.measured, long.measured[short.kept[0]])


def test_the_true_law_leaves_noise_alone_on_it_and_no_law_leaves_what_it_leaves_on_the_whole(lag_context):
    short = shorten_recordings(lag_context, evaluate_at_zero(lag_context)).context
    assert cost_at_zero(short, make_hypothesis("amplifier_lag", **LAG)) == pytest.approx(
        cost_at_zero(lag_context, make_hypothesis("amplifier_lag", **LAG)), rel=0.05
    )
    assert cost_at_zero(short, NO_EFFECTS) == pytest.approx(cost_at_zero(lag_context, NO_EFFECTS), rel=0.05)


def test_without_a_run_in_the_true_law_would_leave_more_than_noise(lag_context, monkeypatch):
    monkeypatch.setattr(short_recordings, "RUN_IN_CONSTANTS", 0.0)
    short = shorten_recordings(lag_context, evaluate_at_zero(lag_context)).context
    assert cost_at_zero(short, make_hypothesis("amplifier_lag", **LAG)) > 1.5 * cost_at_zero(
        lag_context, make_hypothesis("amplifier_lag", **LAG)
    )


def test_evidence_is_cut_like_the_samples(lag_context):
    short = shorten_recordings(lag_context, evaluate_at_zero(lag_context))
    base = evaluate_fit(lag_context.measure, lag_context.tuning, np.zeros(len(lag_context.tuning.names)), NO_EFFECTS)
    (whole,) = lag_context.measure.evidence(lag_context.tuning.model, (), base.residuals)
    cut = short.restrict_evidence(whole)
    assert np.array_equal(cut.axis_force, whole.axis_force[short.kept[0]])
    assert cut.used.sum() == short.context.measure.records[0].fit.sum()
    assert cut.noise is whole.noise


def test_there_is_none_where_what_is_held_hangs_on_the_time(lag_context):
    drifting = make_hypothesis("sensor_drift", total=1.0, bend=0.0, start=0.0)
    assert shorten_recordings(lag_context, evaluate_at_zero(lag_context, drifting)) is None


STUCK = {"level": 0.2, "stiffness": 400.0}


@pytest.mark.parametrize("patient", [True, False])
def test_friction_that_remembers_what_was_cut_out_gets_a_longer_run_in(make_context, monkeypatch, patient):
    if not patient:
        monkeypatch.setattr(short_recordings, "RUN_IN_ERROR", np.inf)
        monkeypatch.setattr(short_recordings, "_restart_pieces", lambda short, measure, held: short)
    rubbing = make_context((PlacedEffect(EFFECTS["presliding_hysteresis"], (0,), STUCK),))
    true = evaluate_at_zero(rubbing, make_hypothesis("presliding_hysteresis", **STUCK))
    short = shorten_recordings(rubbing, true)
    assert (cost_at_zero(short.context, true.hypothesis) < 1.1 * true.cost) == patient
    assert len(short.kept[0]) < 0.7 * len(rubbing.measure.records[0].command)


@pytest.mark.timeout(60)
def test_a_fit_that_ran_away_agrees_with_no_run_in_and_the_whole_is_compared(lag_context):
    """Of three levels one is kept to choose by: where it comes last, all before what is fitted may be kept already."""
    running = evaluate_at_zero(lag_context, make_hypothesis("hardening_stiffness", k3=1e3))
    away = replace(running, residuals=tuple(np.full_like(each, np.nan) for each in running.residuals), cost=np.inf)
    (record,) = lag_context.measure.records
    early = record.fit & (np.arange(len(record.fit)) < np.flatnonzero(record.fit)[0] + 2000)
    cut = Observed(record.recording, record.command, record.measured, early, record.choose, record.test)
    context = replace(lag_context, measure=lag_context.measure.with_records((cut,)))
    assert shorten_recordings(context, away) is None


def test_the_sensitivities_of_one_period_stand_for_those_of_all(lag_context):
    short, at = shorten_recordings(lag_context, evaluate_at_zero(lag_context)), np.zeros(len(lag_context.tuning.names))
    (record,) = lag_context.measure.records
    whole = build_jacobian(lag_context.measure, lag_context.tuning, at, NO_EFFECTS)
    found = short.repeat_sensitivity(build_jacobian(short.context.measure, short.context.tuning, at, NO_EFFECTS))
    everywhere = found.select_samples(0, whole.columns.shape[1])
    later = np.ones(len(record.fit), dtype=bool)
    for segment in record.recording.segments:
        later[segment.start : segment.start + segment.period] = False  # in which the motion settles
    told = np.repeat(later[record.fit], record.measured.shape[1])
    errors = whole.columns * told
    wanted, scale = whole.columns @ errors.T, np.linalg.norm(whole.columns, axis=1)
    off = np.abs(found.multiply(errors) - wanted) / np.outer(scale, scale)
    assert off.max() < 0.02
    assert found.multiply(errors[0]) == pytest.approx(found.multiply(errors)[:, 0])
    assert (np.linalg.norm((everywhere - whole.columns) * told, axis=1) < 0.02 * scale).all()
    assert found.gram == pytest.approx(everywhere @ everywhere.T)
    assert found.multiply(errors) == pytest.approx(everywhere @ errors.T)
    turned = np.roll(errors, 100 * record.measured.shape[1], axis=1)
    assert (np.abs(found.multiply(turned) - wanted) / np.outer(scale, scale)).max() > 0.2


@pytest.fixture(scope="module")
def force_context(lag_context):
    recordings = [record.recording for record in lag_context.full_measure.records]
    measure = make_force_measure(recordings, lag_context.tuning.model, None).measure
    return replace(lag_context, measure=measure.shorten(), full_measure=measure)


def force_difference(context):
    """(samples,): force that is missing in pieces, less that in the whole, over the latter's rms."""
    short, measure = shorten_recordings(context, evaluate_at_zero(context)), context.measure
    pieces = short.context.measure.residuals(context.tuning.model, ())
    (whole,), places = (
        measure.residuals(context.tuning.model, ()),
        np.split(short.kept[0], np.cumsum(piece_lengths(short))),
    )
    fits = [record.fit for record in short.context.measure.records]
    off = [piece[fit] - whole[at][fit] for piece, at, fit in zip(pieces, places, fits, strict=False)]
    return np.concatenate(off).ravel() / whole[measure.records[0].fit].std()


def piece_lengths(short):
    return [len(record.command) for record in short.context.measure.records][:-1]


def test_forces_are_compared_stretch_by_stretch(force_context):
    short = shorten_recordings(force_context, evaluate_at_zero(force_context))
    assert len(short.context.measure.records) == 2
    assert len(short.kept[0]) < 0.7 * len(force_context.measure.records[0].command)
    assert np.abs(force_difference(force_context)).max() < 0.01


def test_without_what_lies_around_stretches_forces_would_differ(force_context, monkeypatch):
    monkeypatch.setattr(short_recordings, "RUN_IN_CONSTANTS", 0.0)
    assert np.abs(force_difference(force_context)).max() > 0.05


def test_a_period_cut_off_by_the_end_of_the_record_represents_no_other(lag_context):
    (record,) = lag_context.measure.records
    driven = [segment for segment in record.recording.segments if record.fit[segment.start : segment.stop].any()]
    ends = driven[-1].stop - 300
    cut = [getattr(record, name)[:ends] for name in ("command", "measured", "fit", "choose", "test")]
    context = replace(lag_context, measure=lag_context.measure.with_records((Observed(record.recording, *cut),)))
    short = shorten_recordings(context, evaluate_at_zero(context))
    (kept,) = short.context.measure.records
    assert kept.fit.sum() == 1000 + record.fit[driven[-1].start : ends].sum()
    assert np.array_equal(np.unique(short.fitted_sample), np.arange(kept.fit.sum()))


@pytest.mark.parametrize("coarse", [4.0, 10.0, 16.0])
def test_laws_of_time_are_kept_by_the_share_that_they_promise_of_the_cost_there(coarse):
    base, from_, law = (SimpleNamespace(cost=cost) for cost in (10.0, coarse, 5.0))
    screened = [ScreenedHypothesis(NO_EFFECTS, from_.cost * (1 - share)) for share in (0.4, 0.05)]
    assert _keep_promising((base, [law]), from_, screened) == screened[:1]
    assert _keep_promising((base, []), from_, screened) == screened


def test_fits_are_continued_by_the_share_that_they_removed_of_the_cost_of_their_samples():
    base, coarse_base = SimpleNamespace(cost=10.0), SimpleNamespace(cost=40.0)
    weak, varying = ([SimpleNamespace(cost=cost) for cost in costs] for costs in ((9.5, 9.8, 9.9, 7.5), (12.0, 39.0)))
    continued = _select_worth_continuing((base, weak), (coarse_base, varying))
    assert continued == [varying[0], weak[3], weak[0], varying[1]]  # gains 0.7, 0.25, and two to make four
    equal = [SimpleNamespace(cost=5.0 + index / 10) for index in range(9)]
    assert _select_worth_continuing((base, equal), (coarse_base, varying)) == [varying[0], *equal]


HUM = {"amplitude": 5.0, "frequency": 50.0, "phase": 0.0}


def test_beside_friction_no_law_is_continued_that_removes_far_less_than_a_hum(make_context, monkeypatch):
    rubbing = PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": 0.1})
    context = make_context((rubbing, PlacedEffect(EFFECTS["mains_hum"], (0,), HUM)))
    base = evaluate_at_zero(context, make_hypothesis("coulomb_friction", level=0.1))
    sizes = (0.01, 0.02, 0.03, 0.04, 0.05, 0.06)
    laws = [make_hypothesis("viscous_damping", damping=size) for size in sizes]
    fitted_counts, fit_first = [], next_effect.fit_first

    def count_fits(*arguments):
        fits = fit_first(*arguments)
        fitted_counts.append(len(fits))
        return fits

    monkeypatch.setattr(next_effect, "fit_first", count_fits)
    short = shorten_recordings(context, base)
    fits = _fit_on_short_recordings(context, short, base, laws, [make_hypothesis("mains_hum", **HUM)])
    assert fitted_counts == [4, 1]  # the least number of laws
    assert len(fits) == 4 and fits[0].hypothesis.claims[-1].effect.name == "mains_hum"


@pytest.fixture(scope="module")
def friction_context(make_context):
    return make_context((PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": 0.1}),))


def test_under_friction_each_piece_begins_as_the_whole_simulation_is_there(friction_context, monkeypatch):
    law = evaluate_at_zero(friction_context, make_hypothesis("coulomb_friction", level=0.1))
    assert len(shorten_recordings(friction_context, law).context.measure.restarts) == 1
    monkeypatch.setattr(short_recordings, "RUN_IN_CONSTANTS", 0.5)
    continued = shorten_recordings(friction_context, law)
    monkeypatch.setattr(short_recordings, "_restart_pieces", lambda short, measure, held: short)
    from_rest = shorten_recordings(friction_context, law)
    assert from_rest is None or len(from_rest.kept[0]) > 1.2 * len(continued.kept[0])
