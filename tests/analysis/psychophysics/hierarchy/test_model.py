"""Curves, likelihood and marginal likelihood against plain numbers and differences."""

import numpy as np
import pytest
from scipy.special import expit
from scipy.stats import norm

from analysis.psychophysics.hierarchy.answers import count_answers
from analysis.psychophysics.hierarchy.curve import (
    NEPER_PER_DB,
    T_AT_THRESHOLD,
    TARGET_PROPORTION,
    Family,
    compute_proportion_correct,
    differentiate_evidence,
)
from analysis.psychophysics.hierarchy.likelihood import TrialLikelihood
from analysis.psychophysics.hierarchy.objective import Objective, Prior
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from tests.analysis.conftest import PUBLISHED, simulate_run

CROWD = Crowd((5.0, 25.0, 45.0), (0.4, 0.9, 2.5))
SHARES = {
    Family.WEIBULL: lambda t: 1.0 - np.exp(-np.exp(t)),
    Family.LOGISTIC: expit,
    Family.GAUSS: norm.cdf,
}


@pytest.fixture(scope="module")
def answers():
    return simulate_study(CROWD, PUBLISHED, 4, (3,)).answers


@pytest.mark.parametrize("family", list(Family))
def test_a_curve_passes_through_the_target_and_has_the_stated_slopes(family):
    t = np.linspace(-4.0, 2.0, 41)
    q, q1, q2 = differentiate_evidence(t, family)
    np.testing.assert_allclose(norm.cdf(q), 0.5 + SHARES[family](t) / 2, rtol=1e-9)
    np.testing.assert_allclose(
        q1,
        (differentiate_evidence(t + 1e-6, family)[0] - differentiate_evidence(t - 1e-6, family)[0]) / 2e-6,
        1e-5,
    )
    np.testing.assert_allclose(
        q2,
        (differentiate_evidence(t + 1e-5, family)[1] - differentiate_evidence(t - 1e-5, family)[1]) / 2e-5,
        1e-4,
    )
    assert norm.cdf(differentiate_evidence(np.array([T_AT_THRESHOLD[family]]), family)[0][0]) == pytest.approx(
        TARGET_PROPORTION
    )
    assert all(np.isfinite(part).all() for part in differentiate_evidence(np.array([-700.0, 700.0]), family))


def test_a_share_runs_from_lapse_to_lapse():
    np.testing.assert_allclose(
        compute_proportion_correct(np.array([-40.0, 0.0, 1.0, 40.0]), 0.04), [0.04, 0.5, 0.8140370, 0.96], 1e-6
    )


def test_the_likelihood_is_the_sum_over_trials():
    rng = np.random.default_rng(2)
    trials = simulate_run(0.9, rng, frequency_hz=15.0, subject="a") + simulate_run(2.0, rng, frequency_hz=35.0)
    answers = count_answers(trials, (15.0, 35.0))
    assert answers.trials == len(trials)
    assert answers.subjects == ("a", "s01")
    theta, slope, lapse, c = {15.0: -1.0, 35.0: 5.0}, 1.7, 0.03, 0.2
    expected = 0.0
    for trial in trials:
        t = T_AT_THRESHOLD[Family.WEIBULL] + slope * NEPER_PER_DB * (
            20 * np.log10(trial.level_n) - theta[trial.frequency_hz]
        )
        evidence = norm.ppf(0.5 + SHARES[Family.WEIBULL](t) / 2)
        says_1 = lapse + (1 - 2 * lapse) * norm.cdf((evidence if trial.direction_shown == 1 else -evidence) - c)
        expected += np.log(says_1 if trial.answer == 1 else 1 - says_1)
    latent = np.tile([theta[15.0], theta[35.0], np.log(slope), c], (2, 1))
    found = TrialLikelihood(answers, Family.WEIBULL).evaluate(latent, lapse)
    assert found.value.sum() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("family", list(Family))
def test_derivatives_of_the_likelihood(answers, family):
    likelihood, lapse, step = TrialLikelihood(answers, family), 0.03, 1e-5
    latent = np.tile([-7.0, -1.0, 8.0, 0.8, 0.1], (4, 1)) + np.random.default_rng(1).normal(0, 0.2, (4, 5))
    found = likelihood.evaluate(latent, lapse)
    sides = [
        (likelihood.evaluate(latent + step * e, lapse), likelihood.evaluate(latent - step * e, lapse))
        for e in np.eye(5)
    ]
    np.testing.assert_allclose(
        found.first, np.stack([(u.value - d.value) / (2 * step) for u, d in sides], 1), atol=1e-6
    )
    np.testing.assert_allclose(
        found.second, np.stack([(u.first - d.first) / (2 * step) for u, d in sides], 1), atol=1e-5
    )
    inverse = np.linalg.inv(found.information + np.eye(5))
    traced = np.stack(
        [np.einsum("nab,nba->n", inverse, u.information - d.information) / (2 * step) for u, d in sides], 1
    )
    np.testing.assert_allclose(likelihood.trace_derivatives(latent, lapse, inverse)[0], traced, rtol=1e-4, atol=1e-6)


def test_information_is_what_the_curvature_is_on_average(answers):
    """Expected over answers drawn from the model itself, at the levels played."""
    from dataclasses import replace

    from scipy.special import ndtr

    k, lapse = 3, 0.02
    latent = np.tile([-8.0, -1.0, 7.0, 0.7, 0.1], (4, 1))
    t = T_AT_THRESHOLD[Family.WEIBULL] + np.exp(0.7) * NEPER_PER_DB * (
        answers.level_db - latent[:, :k].ravel()[answers.run]
    )
    share = lapse + (1 - 2 * lapse) * ndtr(differentiate_evidence(t, Family.WEIBULL)[0] - answers.side * 0.1)
    n = answers.right + answers.wrong
    expected = replace(answers, right=n * share, wrong=n * (1 - share))  # the curvature is linear in the counts
    found = TrialLikelihood(expected, Family.WEIBULL).evaluate(latent, lapse)
    np.testing.assert_allclose(-found.second, found.information, atol=1e-9)


@pytest.mark.parametrize("family", list(Family))
def test_the_gradient_of_the_marginal_likelihood_is_exact(answers, family):
    objective = Objective(answers, family, Prior())
    at = objective.start + 0.1 * np.random.default_rng(0).standard_normal(len(objective.start))
    _, gradient = objective(at)
    steps = 1e-4 * np.eye(len(at))
    plain = [(objective(at + step)[0] - objective(at - step)[0]) / 2e-4 for step in steps]
    np.testing.assert_allclose(gradient, plain, rtol=3e-3, atol=3e-3)


def test_the_marginal_likelihood_is_the_integral(answers):
    """One person, one frequency left out of the sum: Laplace against a sum over drawn latent numbers."""
    from dataclasses import replace

    chosen = answers.run < 3
    parts = ("run", "level_db", "side", "right", "wrong")
    alone = replace(answers, subjects=answers.subjects[:1], **{name: getattr(answers, name)[chosen] for name in parts})
    objective = Objective(alone, Family.WEIBULL, Prior())
    numbers = objective.start
    value = objective.marginal.evaluate(numbers)[0][0]
    rng, n = np.random.default_rng(5), 20_000
    k = 3
    theta = (
        numbers[:k]
        + np.exp(numbers[k]) * rng.standard_normal((n, 1))
        + np.exp(numbers[k + 1]) * rng.standard_normal((n, k))
    )
    b = numbers[k + 2] + np.exp(numbers[k + 3]) * rng.standard_normal(n)
    c = np.exp(numbers[k + 4]) * rng.standard_normal(n)
    likelihood, lapse = TrialLikelihood(alone, Family.WEIBULL), float(expit(numbers[k + 5]))
    values = [
        likelihood.evaluate(np.array([[*row, slope, bias]]), lapse).value[0]
        for row, slope, bias in zip(theta[:4000], b, c, strict=False)
    ]
    plain = np.logaddexp.reduce(values) - np.log(len(values))
    assert value == pytest.approx(plain, abs=0.35)
