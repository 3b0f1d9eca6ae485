from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import NOTHING, Claim, claimed
from analysis.diagnosis.errors.output_error import evaluated
from analysis.diagnosis.errors.standing import standing
from analysis.diagnosis.search.no_answer import foresees_nothing, silences
from analysis.diagnosis.search.rivalry import Contender
from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.effect import PlacedEffect

LAG = next(effect for effect in CATALOGUE if effect.name == "sensor_lag")
GAIN = next(effect for effect in CATALOGUE if effect.name == "force_gain")


@pytest.mark.parametrize(("gain", "nothing"), [(0.7, False), (1e-6, True)])
def test_a_force_that_never_reaches_the_device_foresees_nothing(arena_of, gain, nothing):
    arena = arena_of()
    held = claimed(Claim(GAIN, "one", (0,)), [{"gain": gain}])
    assert foresees_nothing(arena.whole, _contender(arena, held)) is nothing


def test_a_model_as_it_is_foresees_something(arena_of):
    arena = arena_of()
    assert not foresees_nothing(arena.whole, _contender(arena, NOTHING))


def _contender(arena, hypothesis):
    fitted = evaluated(arena.whole, arena.tuning, np.zeros(len(arena.tuning.names)), hypothesis)
    return Contender(fitted, standing(arena.whole, fitted.residuals))


def test_where_noise_is_as_large_as_the_signal_a_foreseen_course_is_asked_for_all_the_same(arena_of):
    arena = arena_of()
    record = arena.whole.records[0]
    shuffled = replace(record, measured=np.random.default_rng(1).permutation(record.measured))
    measure = replace(arena.whole, records=(shuffled,), noise=shuffled.measured.std(axis=0))
    held = claimed(Claim(GAIN, "one", (0,)), [{"gain": 1e-6}])
    assert foresees_nothing(measure, _contender(replace(arena, whole=measure), held))


def test_a_low_pass_that_lets_nothing_through_silences_its_channel(arena_of):
    arena = arena_of()
    record = arena.whole.records[0]
    backwards = record.measured.copy()
    backwards[:, 0] = 2 * backwards[::-1, 0]
    assert _silences(replace(arena.whole, records=(replace(record, measured=backwards),)), arena.tuning, 0.01)


def test_a_silenced_channel_is_no_answer_though_another_gains_more_by_it(arena_of):
    arena = arena_of()
    none = np.zeros(len(arena.tuning.names))
    lag = evaluated(arena.whole, arena.tuning, none, claimed(Claim(LAG, "one", (0,)), [{"bandwidth": 0.01}]))
    wrenched = replace(lag, residuals=tuple(one * [1.1, 1e6] for one in lag.residuals))
    assert silences(arena.whole, wrenched, lag)


def test_a_low_pass_that_is_there_silences_nothing(arena_of):
    arena = arena_of(effects=(PlacedEffect(LAG, (0,), {"bandwidth": 10.0}),))
    assert not _silences(arena.whole, arena.tuning, 10.0)


def _silences(measure, tuning, bandwidth):
    lag = claimed(Claim(LAG, "one", (0,)), [{"bandwidth": bandwidth}])
    return silences(measure, *(evaluated(measure, tuning, np.zeros(len(tuning.names)), one) for one in (NOTHING, lag)))
