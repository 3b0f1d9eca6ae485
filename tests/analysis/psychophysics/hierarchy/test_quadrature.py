"""Integrals by adaptive quadrature against sums over a dense grid, and what they change in the estimates."""

import numpy as np
import pytest
from scipy.special import expit

from analysis.psychophysics.hierarchy.curve import (
    NEPER_PER_DB,
    T_AT_THRESHOLD,
    Family,
    compute_proportion_correct,
    differentiate_evidence,
)
from analysis.psychophysics.hierarchy.fit import fit_hierarchy
from analysis.psychophysics.hierarchy.nodes import FINE_COUNTS, NodeCounts, compute_laplace_moments
from analysis.psychophysics.hierarchy.objective import Objective, Prior, maximise
from analysis.psychophysics.hierarchy.quadrature import Quadrature, integrate
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from tests.analysis.conftest import PUBLISHED
from tests.slow_instances import slow_after

MANY = NodeCounts(9, 11, 7, 13)
NEAR_CAP = Crowd((5.0, 45.0), (0.7, 2.7), slope_log_sd=0.4, lapse=0.03)


def grid_integral(answers, person, numbers, family=Family.WEIBULL):
    """Log marginal likelihood of a person with two frequencies: a sum over a grid of both thresholds, slope and
    criterion, with no structure made use of but that the likelihood of each run has only its own threshold."""
    shared, own, slope_sd, criterion_sd = np.exp(numbers[[2, 3, 5, 6]])
    lapse, total = float(expit(numbers[7])), -np.inf
    thetas = [np.linspace(-9.0, 9.0, 241) * np.hypot(shared, own) + mean for mean in numbers[:2]]
    covariance = shared**2 + own**2 * np.eye(2)
    away = np.stack(np.meshgrid(*[t - m for t, m in zip(thetas, numbers[:2], strict=True)], indexing="ij"), axis=-1)
    log_prior = -0.5 * np.einsum("xya,ab,xyb->xy", away, np.linalg.inv(covariance), away)
    log_prior -= np.log(2 * np.pi) + 0.5 * np.linalg.slogdet(covariance)[1]
    log_prior += sum(np.log(theta[1] - theta[0]) for theta in thetas)
    z = np.linspace(-5.0, 5.0, 41)
    log_z = -0.5 * z**2 - 0.5 * np.log(2 * np.pi) + np.log(z[1] - z[0])
    for b, by_b in zip(numbers[4] + slope_sd * z, log_z, strict=True):
        for c, by_c in zip(criterion_sd * z, log_z, strict=True):
            rows = []
            for place, theta in enumerate(thetas):
                cells = answers.run == 2 * person + place
                t = T_AT_THRESHOLD[family] + np.exp(b) * NEPER_PER_DB * (answers.level_db[cells] - theta[:, None])
                p = compute_proportion_correct(differentiate_evidence(t, family)[0] - c * answers.side[cells], lapse)
                rows.append(np.log(p) @ answers.right[cells] + np.log1p(-p) @ answers.wrong[cells])
            terms = log_prior + rows[0][:, None] + rows[1]
            high = terms.max()
            total = np.logaddexp(total, by_b + by_c + high + np.log(np.exp(terms - high).sum()))
    return total


def settled_integrals(objective, quadrature, numbers, counts=FINE_COUNTS):
    """Integrals with nodes that have found their place."""
    moments = compute_laplace_moments(numbers, *objective.marginal.find_modes(numbers))
    for _ in range(3):
        moments = integrate(quadrature, numbers, moments, counts).moments
    return integrate(quadrature, numbers, moments, counts)


@pytest.fixture(scope="module")
def prepared_quadrature():
    answers = simulate_study(NEAR_CAP, PUBLISHED, 3, (8,)).answers
    objective = Objective(answers, Family.WEIBULL, Prior())
    return answers, objective, Quadrature(answers, Family.WEIBULL), objective.start


@pytest.mark.slow
def test_an_integral_is_the_sum_over_a_grid(prepared_quadrature):
    """Where Laplace's method is off by up to a tenth."""
    answers, objective, quadrature, numbers = prepared_quadrature
    plain = [grid_integral(answers, person, numbers) for person in range(3)]
    np.testing.assert_allclose(settled_integrals(objective, quadrature, numbers).value, plain, atol=4e-3)
    assert np.abs(objective.marginal.evaluate(numbers)[0] - plain).max() > 0.04


def test_with_single_nodes_it_is_the_method_of_laplace(prepared_quadrature):
    _, objective, quadrature, numbers = prepared_quadrature
    moments = compute_laplace_moments(numbers, *objective.marginal.find_modes(numbers))
    found = integrate(quadrature, numbers, moments, NodeCounts(1, 1, 1, 1))
    np.testing.assert_allclose(found.value, objective.marginal.evaluate(numbers)[0], atol=1e-8)


@pytest.mark.parametrize("family", slow_after(1, list(Family)))
def test_gradient_and_hessian_are_those_of_the_integral(prepared_quadrature, family):
    answers, _, _, numbers = prepared_quadrature
    objective, quadrature = Objective(answers, family, Prior()), Quadrature(answers, family)
    found, steps = settled_integrals(objective, quadrature, numbers, MANY), 1e-3 * np.eye(len(numbers))
    sides = [[integrate(quadrature, numbers + sign * step, found.moments, MANY) for sign in (1, -1)] for step in steps]
    by_value = np.stack([(up.value - down.value) / 2e-3 for up, down in sides], axis=1)
    by_scores = np.stack([(up.scores - down.scores).sum(axis=0) / 2e-3 for up, down in sides])
    np.testing.assert_allclose(found.scores, by_value, atol=3e-3)
    np.testing.assert_allclose(found.hessian, by_scores, atol=0.02)


@pytest.mark.slow
def test_a_person_without_answers_at_a_frequency_has_an_integral(prepared_quadrature):
    from dataclasses import replace

    answers, _, _, numbers = prepared_quadrature
    kept = answers.run != 1
    parts = {name: getattr(answers, name)[kept] for name in ("run", "level_db", "side", "right", "wrong")}
    fewer = replace(answers, **parts)
    objective = Objective(fewer, Family.WEIBULL, Prior())
    found = settled_integrals(objective, Quadrature(fewer, Family.WEIBULL), numbers)
    assert found.value[0] == pytest.approx(grid_integral(fewer, 0, numbers), abs=4e-3)


@pytest.mark.slow
def test_medians_are_higher_than_by_the_method_of_laplace():
    """Over studies with equal thresholds of 0.6 N: by 0.2 dB, which Laplace's method puts them too low."""
    shift, errors = [], []
    for number in range(12):
        study = simulate_study(Crowd((5.0, 25.0, 45.0), (0.6,) * 3), PUBLISHED, 10, (44, number))
        objective = Objective(study.answers, Family.WEIBULL, Prior())
        fit = fit_hierarchy(study.answers)
        assert fit.converged
        shift.append(fit.means_db - maximise(objective, objective.start).x[:3])
        errors.append(fit.means_db - study.true_db.mean(axis=0))
    assert 0.05 < np.mean(shift) < 0.4
    assert abs(np.mean(errors)) < 0.3


@pytest.mark.slow
def test_most_above_the_cap_and_the_search_still_ends():
    """Guessing at the cap, a person may have a steep slope and a high threshold, or a flat slope: two maxima."""
    crowd = Crowd((5.0, 15.0, 25.0, 35.0, 45.0), (3.5,) * 5, frequency_sd_db=(1.0, 1.0, 1.7, 2.5, 3.5))
    assert fit_hierarchy(simulate_study(crowd, PUBLISHED, 10, (1, 10)).answers).converged
