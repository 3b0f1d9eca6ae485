from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.fit_score import compute_fit_score
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS, Claim, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.search.no_prediction import has_no_predictive_power, has_unpredicted_channel
from analysis.diagnosis.search.search_context import FittedCandidate
from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.effect import PlacedEffect

LAG = next(effect for effect in CATALOGUE if effect.name == "sensor_lag")
GAIN = next(effect for effect in CATALOGUE if effect.name == "force_gain")


@pytest.mark.parametrize(("gain", "nothing"), [(0.7, False), (1e-6, True)])
def test_a_force_that_never_reaches_the_device_predicts_nothing(make_context, gain, nothing):
    context = make_context()
    held = make_claim_hypothesis(Claim(GAIN, "one", (0,)), [{"gain": gain}])
    assert has_no_predictive_power(context.full_measure, _make_candidate(context, held)) is nothing


def test_a_model_as_it_is_foresees_something(make_context):
    context = make_context()
    assert not has_no_predictive_power(context.full_measure, _make_candidate(context, NO_EFFECTS))


def _make_candidate(context, hypothesis):
    fitted = evaluate_fit(context.full_measure, context.tuning, np.zeros(len(context.tuning.names)), hypothesis)
    return FittedCandidate(fitted, compute_fit_score(context.full_measure, fitted.residuals))


def test_where_noise_is_as_large_as_the_signal_a_foreseen_course_is_asked_for_all_the_same(make_context):
    context = make_context()
    record = context.full_measure.records[0]
    shuffled = replace(record, measured=np.random.default_rng(1).permutation(record.measured))
    measure = replace(context.full_measure, records=(shuffled,), noise=shuffled.measured.std(axis=0))
    held = make_claim_hypothesis(Claim(GAIN, "one", (0,)), [{"gain": 1e-6}])
    assert has_no_predictive_power(measure, _make_candidate(replace(context, full_measure=measure), held))


def test_a_low_pass_far_below_the_band_silences_its_channel(make_context):
    context = make_context()
    record = context.full_measure.records[0]
    backwards = record.measured.copy()
    backwards[:, 0] = 2 * backwards[::-1, 0]
    assert _predicts_nothing(
        replace(context.full_measure, records=(replace(record, measured=backwards),)), context.tuning, 0.01
    )


def test_a_claim_that_silences_a_channel_predicts_nothing_even_if_another_channel_gains(make_context):
    context = make_context()
    none = np.zeros(len(context.tuning.names))
    lag = evaluate_fit(
        context.full_measure,
        context.tuning,
        none,
        make_claim_hypothesis(Claim(LAG, "one", (0,)), [{"bandwidth": 0.01}]),
    )
    wrenched = replace(lag, residuals=tuple(residual * [1.1, 1e6] for residual in lag.residuals))
    assert has_unpredicted_channel(context.full_measure, wrenched, lag)


def test_a_low_pass_of_the_device_itself_silences_no_channel(make_context):
    context = make_context(effects=(PlacedEffect(LAG, (0,), {"bandwidth": 10.0}),))
    assert not _predicts_nothing(context.full_measure, context.tuning, 10.0)


def _predicts_nothing(measure, tuning, bandwidth):
    lag = make_claim_hypothesis(Claim(LAG, "one", (0,)), [{"bandwidth": bandwidth}])
    return has_unpredicted_channel(
        measure, *(evaluate_fit(measure, tuning, np.zeros(len(tuning.names)), each) for each in (NO_EFFECTS, lag))
    )
