"""What figures of psychometric functions show: every answer once, and the curve that the fit rests on."""

import numpy as np
import pytest

from analysis.psychophysics.hierarchy.answers import count_answers
from analysis.psychophysics.hierarchy.curve import TARGET_PROPORTION, Family
from analysis.psychophysics.hierarchy.observed_shares import (
    BIN_DB,
    average_person_curves,
    compute_group_shares,
    compute_person_shares,
    evaluate_person_curve,
)
from analysis.psychophysics.hierarchy.primary import PersonEstimate, compute_primary_analysis

HZ = (5.0, 15.0, 25.0, 35.0, 45.0)


class StubFit:
    frequencies_hz, lapse, family = (5.0,), 0.0, Family.WEIBULL

    def __init__(self, *persons: PersonEstimate) -> None:
        self.persons = persons


def make_person(slope: float = 2.0, criterion: float = 0.0) -> PersonEstimate:
    return PersonEstimate("s", (1.0,), (False,), slope, criterion)


@pytest.fixture(scope="module")
def study(simulate_study):
    answers = count_answers(simulate_study(subjects=4), HZ)
    return answers, compute_primary_analysis(answers, 3.0)


@pytest.mark.slow
def test_each_answer_is_in_one_point_of_its_person_and_frequency(study):
    answers, fit = study
    for place in range(5):
        points = [compute_person_shares(answers, each, place) for each in range(4)]
        chosen = answers.run % 5 == place
        assert sum(p.trials for row in points for p in row) == (answers.right + answers.wrong)[chosen].sum()
        together = compute_group_shares(answers, fit, place)
        assert sum(p.right for p in together) == answers.right[chosen].sum() == sum(p.right for r in points for p in r)


def test_points_lie_within_their_bins_and_their_intervals(study):
    for point in compute_person_shares(study[0], 0, 0):
        assert point.lower <= point.share <= point.upper
        assert abs(point.level_db - BIN_DB * round(point.level_db / BIN_DB)) <= BIN_DB / 2


def test_without_lapse_and_bias_the_curve_is_weibulls_and_meets_its_target_at_the_threshold():
    above_db = np.array([-30.0, -6.0, 0.0, 3.0, 12.0])
    scale = (-np.log(2 - 2 * TARGET_PROPORTION)) ** -0.5  # of a Weibull curve of slope 2 whose target lies at 1 N
    expected = 1 - 0.5 * np.exp(-((10 ** (above_db / 20) / scale) ** 2))
    np.testing.assert_allclose(
        evaluate_person_curve(above_db, make_person(), StubFit(make_person())), expected, rtol=1e-12
    )
    assert expected[2] == pytest.approx(TARGET_PROPORTION)


def test_a_bias_to_one_answer_lowers_the_curve():
    assert (
        evaluate_person_curve(np.zeros(1), make_person(criterion=0.5), StubFit(make_person()))[0]
        < TARGET_PROPORTION - 0.02
    )


def test_the_curve_of_all_people_weighs_each_by_the_trials_at_the_frequency(study):
    answers, _ = study
    steep, flat = make_person(6.0), make_person(1.0)
    fit = StubFit(steep, flat, flat, flat)
    chosen = answers.run % 5 == 0
    weight = (answers.right + answers.wrong)[chosen & (answers.person == 0)].sum() / (answers.right + answers.wrong)[
        chosen
    ].sum()
    at = np.array([4.0])
    expected = weight * evaluate_person_curve(at, steep, fit) + (1 - weight) * evaluate_person_curve(at, flat, fit)
    fit.frequencies_hz = HZ
    np.testing.assert_allclose(average_person_curves(at, answers, fit, 0), expected)
