import numpy as np
import pytest

from analysis.diagnosis.result.findings import TimeSeries
from analysis.diagnosis.result.unit_doubt import describe_unit_doubts

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
