"""People of simulated studies who guess, ask again when unsure, or drift: as they are said to, and none by default."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from tests.analysis.conftest import PUBLISHED

CROWD = Crowd((5.0, 25.0, 45.0), (0.5, 0.7, 0.9), criterion_sd=0.0)
PEOPLE = 60


def threshold_errors(crowd, seed=1):
    study = simulate_study(crowd, PUBLISHED, PEOPLE, (seed,))
    return study.threshold_db - study.true_db


def test_without_habits_studies_are_what_they_were():
    """Taken from the version before there were habits."""
    study = simulate_study(Crowd((5.0, 45.0), (0.7, 1.4)), PUBLISHED, 4, (7, 3))
    assert study.trials == 452
    np.testing.assert_allclose(study.threshold_db[:, 0], [-7.6, -4.0, 3.6, -7.5], atol=1e-6)


@pytest.mark.parametrize("seed", [1, 2])
def test_guessers_end_near_the_cap_and_are_as_many_as_said(seed):
    study = simulate_study(replace(CROWD, guessers=0.5), PUBLISHED, PEOPLE, (seed,))
    near_cap = (study.threshold_n > 2.3).all(axis=1)
    assert near_cap.mean() == pytest.approx(0.5, abs=4 * np.sqrt(0.25 / PEOPLE))
    assert not (simulate_study(CROWD, PUBLISHED, PEOPLE, (seed,)).threshold_n > 2.3).all(axis=1).any()


@pytest.mark.parametrize("seed", [1, 2])
def test_looking_again_without_a_limit_lowers_thresholds_by_2_db_and_three_looks_a_run_hardly(seed):
    plain = threshold_errors(CROWD, seed)
    free = threshold_errors(replace(CROWD, unsure=0.5, repeats=10_000), seed)
    limited = threshold_errors(replace(CROWD, unsure=0.5, repeats=3), seed)
    error = np.sqrt(2) * plain.std() / np.sqrt(plain.size)
    assert free.mean() - plain.mean() == pytest.approx(-2.1, abs=0.3 + 3 * error)
    assert abs(limited.mean() - plain.mean()) < 0.6


def test_a_drifting_criterion_makes_answers_lean_and_thresholds_rise():
    drifting = replace(CROWD, criterion_drift_sd=1.0)
    assert threshold_errors(drifting).mean() > threshold_errors(CROWD).mean() + 0.5
    leaning = [_answer_imbalance(simulate_study(crowd, PUBLISHED, PEOPLE, (4,)).answers) for crowd in (CROWD, drifting)]
    assert leaning[1] > 2.0 * leaning[0]


def _answer_imbalance(answers):
    """Mean over people of how far their share of answers 1 is from a half."""
    first = np.where(answers.side > 0, answers.right, answers.wrong)
    given = np.bincount(answers.person, first)
    return np.abs(given / np.bincount(answers.person, answers.right + answers.wrong) - 0.5).mean()
