import numpy as np
import pytest

from analysis.diagnosis.result.findings import Course
from analysis.diagnosis.result.unit_doubt import unit_sentences

WAVE = np.random.default_rng(1).standard_normal((500, 1))


def course(measured, predicted=WAVE):
    return Course("rec.h5", 1000.0, ("ax",), ("m/s^2",), measured, predicted, predicted, predicted, ((400, 500),))


@pytest.mark.parametrize(
    ("measured", "words"),
    [
        (1000 * WAVE, "but 1000 times as large"),
        (WAVE / 9.81, "but 9.81 times smaller"),
        (-57.3 * WAVE, "57.3 times as large and"),
    ],
    ids=["millimetres", "g", "degrees"],
)
def test_a_channel_of_the_right_course_and_another_size_is_doubted(measured, words):
    (said,) = unit_sentences([course(measured)])
    assert said.startswith("ax has the course that the model foresees, ")
    assert words in said
    assert said.endswith("its unit, the command's or one in the model may be wrong.")


def test_so_is_one_with_the_other_sign():
    (said,) = unit_sentences([course(-1.1 * WAVE)])
    assert "foresees, but with the other sign: its sign, the command's or one in the model may be wrong." in said


@pytest.mark.parametrize(
    "measured",
    [2 * WAVE, 1000 * np.roll(WAVE, 7), 0 * WAVE, np.full_like(WAVE, np.nan)],
    ids=["a little off", "another course", "nothing", "missing"],
)
def test_no_other_channel_is(measured):
    assert unit_sentences([course(measured)]) == ()


def test_a_channel_is_doubted_once():
    assert len(unit_sentences([course(1000 * WAVE), course(1000 * WAVE)])) == 1


def test_missing_samples_are_passed_over():
    gaps = 1000 * WAVE
    gaps[10:20] = np.nan
    assert len(unit_sentences([course(gaps)])) == 1
