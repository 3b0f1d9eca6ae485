from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.fit_score import fit_score
from analysis.diagnosis.errors.hypothesis import NOTHING, Claim, hypothesis_of_claim
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.search.no_prediction import is_without_prediction, predicts_nothing
from analysis.diagnosis.search.search_context import FittedCandidate
from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.effect import PlacedEffect

LAG = next(effect for effect in CATALOGUE if effect.name == "sensor_lag")
GAIN = next(effect for effect in CATALOGUE if effect.name == "force_gain")


@pytest.mark.parametrize(("gain", "nothing"), [(0.7, False), (1e-6, True)])
def test_a_force_that_never_reaches_the_device_predicts_nothing(arena_of, gain, nothing):
    context = arena_of()
    held = hypothesis_of_claim(Claim(GAIN, "one", (0,)), [{"gain": gain}])
    assert is_without_prediction(context.whole, _contender(context, held)) is nothing


def test_a_model_as_it_is_foresees_something(arena_of):
    context = arena_of()
    assert not is_without_prediction(context.whole, _contender(context, NOTHING))


def _contender(context, hypothesis):
    fitted = evaluate_fit(context.whole, context.tuning, np.zeros(len(context.tuning.names)), hypothesis)
    return FittedCandidate(fitted, fit_score(context.whole, fitted.residuals))


def test_where_noise_is_as_large_as_the_signal_a_foreseen_course_is_asked_for_all_the_same(arena_of):
    context = arena_of()
    record = context.whole.records[0]
    shuffled = replace(record, measured=np.random.default_rng(1).permutation(record.measured))
    measure = replace(context.whole, records=(shuffled,), noise=shuffled.measured.std(axis=0))
    held = hypothesis_of_claim(Claim(GAIN, "one", (0,)), [{"gain": 1e-6}])
    assert is_without_prediction(measure, _contender(replace(context, whole=measure), held))


def test_a_low_pass_far_below_the_band_silences_its_channel(arena_of):
    context = arena_of()
    record = context.whole.records[0]
    backwards = record.measured.copy()
    backwards[:, 0] = 2 * backwards[::-1, 0]
    assert _silences(replace(context.whole, records=(replace(record, measured=backwards),)), context.tuning, 0.01)


def test_a_claim_that_silences_a_channel_predicts_nothing_even_if_another_channel_gains(arena_of):
    context = arena_of()
    none = np.zeros(len(context.tuning.names))
    lag = evaluate_fit(
        context.whole, context.tuning, none, hypothesis_of_claim(Claim(LAG, "one", (0,)), [{"bandwidth": 0.01}])
    )
    wrenched = replace(lag, residuals=tuple(residual * [1.1, 1e6] for residual in lag.residuals))
    assert predicts_nothing(context.whole, wrenched, lag)


def test_a_low_pass_of_the_device_itself_silences_no_channel(arena_of):
    context = arena_of(effects=(PlacedEffect(LAG, (0,), {"bandwidth": 10.0}),))
    assert not _silences(context.whole, context.tuning, 10.0)


def _silences(measure, tuning, bandwidth):
    lag = hypothesis_of_claim(Claim(LAG, "one", (0,)), [{"bandwidth": bandwidth}])
    return predicts_nothing(
        measure, *(evaluate_fit(measure, tuning, np.zeros(len(tuning.names)), each) for each in (NOTHING, lag))
    )
