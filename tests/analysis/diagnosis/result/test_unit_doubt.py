from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.choose_measure import make_measure
from analysis.diagnosis.result.findings import TimeSeries
from analysis.diagnosis.result.unit_doubt import MOTION, describe_unit_doubts, predict_forces
from tests.analysis.diagnosis.errors.drifting_plant import make_model, random_course, record_plant

WAVE = np.random.default_rng(1).standard_normal((500, 1))


def make_series(measured, predicted=WAVE):
    return TimeSeries("rec.h5", 1000.0, ("ax",), ("m/s^2",), measured, predicted, predicted, predicted, ((400, 500),))


@pytest.mark.parametrize(
    ("measured", "words"),
    [
        (1000 * WAVE, "but 1000 times as large"),
        (WAVE / 9.81, "but 9.81 times smaller"),
        (-57.3 * WAVE, "57.3 times as large and"),
    ],
    ids=["millimetres", "g", "degrees"],
)
def test_a_channel_of_the_right_shape_and_another_size_is_doubted(measured, words):
    (said,) = describe_unit_doubts([make_series(measured)])
    assert said.startswith("ax has the shape that the model predicts, ")
    assert words in said
    assert said.endswith("its unit, the command's or one in the model may be wrong.")


def test_so_is_one_with_the_other_sign():
    (said,) = describe_unit_doubts([make_series(-1.1 * WAVE)])
    assert "predicts, but with the other sign: its sign, the command's or one in the model may be wrong." in said


@pytest.mark.parametrize(
    "measured",
    [2 * WAVE, 1000 * np.roll(WAVE, 7), 0 * WAVE, np.full_like(WAVE, np.nan)],
    ids=["a little off", "another shape", "nothing", "missing"],
)
def test_no_other_channel_is(measured):
    assert describe_unit_doubts([make_series(measured)]) == ()


def test_a_channel_is_doubted_once():
    assert len(describe_unit_doubts([make_series(1000 * WAVE), make_series(1000 * WAVE)])) == 1


def test_missing_samples_are_passed_over():
    gaps = 1000 * WAVE
    gaps[10:20] = np.nan
    assert len(describe_unit_doubts([make_series(gaps)])) == 1


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1000.0, " times smaller"), (-1.0, "with the other sign"), (1.0, "")],
    ids=["millimetres", "sign", "right"],
)
def test_windows_follow_the_motion_in_any_unit_but_the_force_does_not(factor, words):
    """A drifting carriage, compared in windows that start from its measured motion."""
    drifting = record_plant(9.0 * random_course(12.0, 5), controlled=False)
    scaled = replace(drifting, response=replace(drifting.response, samples=factor * drifting.response.samples))
    chosen, model = make_measure([scaled], make_model()), make_model()
    assert chosen.measure.name == "windows of 1 s"
    doubts = describe_unit_doubts(predict_forces(chosen.measure, model, chosen.floors), MOTION)
    assert len(doubts) == (1 if words else 0)
    assert all(words in doubt and doubt.endswith("the motion's or one in the model may be wrong.") for doubt in doubts)
