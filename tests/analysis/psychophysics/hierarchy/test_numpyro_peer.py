"""The same model written for NumPyro, whose sampler knows nothing of modes and nodes: an independent peer.

Runs where NumPyro is installed (`pip install numpyro`, and then `make prove-study`); hapteq itself does not need it.
"""

import numpy as np
import pytest
from scipy.special import expit

from analysis.psychophysics.hierarchy.curve import NEPER_PER_DB, T_AT_THRESHOLD, Family
from analysis.psychophysics.hierarchy.fit import fit_hierarchy
from analysis.psychophysics.hierarchy.nodes import FINE_COUNTS, compute_laplace_moments
from analysis.psychophysics.hierarchy.objective import Objective, Prior
from analysis.psychophysics.hierarchy.quadrature import Quadrature, integrate
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from tests.analysis.conftest import PUBLISHED

numpyro = pytest.importorskip("numpyro", reason="the peer is not installed: pip install numpyro")
pytestmark = [pytest.mark.slow, pytest.mark.timeout(1200)]

K, PEOPLE = 3, 8
DRAWS, LOG_SDS = 4000, [K, K + 1, K + 3, K + 4]


@pytest.fixture(scope="module")
def fit():
    return fit_hierarchy(simulate_study(Crowd((5.0, 25.0, 45.0), (0.6, 0.9, 2.7)), PUBLISHED, PEOPLE, (13,)).answers)


@pytest.fixture(scope="module")
def posterior_draws(fit):
    """Latent numbers of all people at the population of the fit: theta (draws, n, k) and raw (draws, n, k + 3)."""
    import jax
    from numpyro.infer import MCMC, NUTS

    numpyro.enable_x64()
    known = fit.parameters[:K], fit.parameters[LOG_SDS], fit.parameters[K + 2], expit(fit.parameters[K + 5])
    chain = MCMC(
        NUTS(lambda: sample_people(fit.answers, *known), target_accept_prob=0.9),
        num_warmup=1000,
        num_samples=DRAWS,
        progress_bar=False,
    )
    chain.run(jax.random.PRNGKey(0))
    return {name: np.asarray(values) for name, values in chain.get_samples().items()}


def sample_people(answers, means, logs, slope, lapse):
    import jax.numpy as jnp
    from jax.scipy.special import ndtr, ndtri
    from numpyro import distributions as dist

    shared, own, slope_sd, criterion_sd = jnp.exp(logs)
    raw = numpyro.sample("raw", dist.Normal(0.0, 1.0).expand([PEOPLE, K + 3]).to_event(2))
    theta = numpyro.deterministic("theta", means + shared * raw[:, :1] + own * raw[:, 1 : K + 1])
    b, c = slope + slope_sd * raw[:, K + 1], criterion_sd * raw[:, K + 2]
    person = answers.person
    above_db = answers.level_db - theta.ravel()[answers.run]
    t = T_AT_THRESHOLD[Family.WEIBULL] + jnp.exp(b)[person] * NEPER_PER_DB * above_db
    tail = jnp.maximum(jnp.exp(-jnp.exp(jnp.minimum(t, 5.0))) / 2.0, 1e-60)
    p = lapse + (1.0 - 2.0 * lapse) * ndtr(-ndtri(tail) - answers.side * c[person])
    numpyro.factor("answers", (answers.right * jnp.log(p) + answers.wrong * jnp.log1p(-p)).sum())


def test_thresholds_of_people_are_those_that_a_sampler_finds(fit, posterior_draws):
    """Means and spreads of each person's thresholds, over what 4000 draws tell them."""
    objective, quadrature = Objective(fit.answers, Family.WEIBULL, Prior()), Quadrature(fit.answers, Family.WEIBULL)
    moments = compute_laplace_moments(fit.parameters, *objective.marginal.find_modes(fit.parameters))
    for _ in range(3):
        moments = integrate(quadrature, fit.parameters, moments, FINE_COUNTS).moments
    by_shared = np.einsum("nka,nab,nkb->nk", moments.regression, moments.covariance, moments.regression)
    spread, theta = np.sqrt(moments.threshold_variances + by_shared), posterior_draws["theta"]
    np.testing.assert_allclose((moments.threshold_means - theta.mean(axis=0)) / spread, 0.0, atol=0.1)
    np.testing.assert_allclose(spread / theta.std(axis=0), 1.0, atol=0.1)
    off = np.abs(fit.latent[:, :K] - theta.mean(axis=0)) / spread
    assert off.max() > 0.15  # the control: the modes, from which Laplace's method starts, are not the means


def test_the_population_is_where_a_sampler_puts_the_maximum(fit, posterior_draws):
    """The gradient of the marginal likelihood is the sampler's mean of the gradient with everything known: by it the
    estimates are within a tenth of their standard errors of the maximum."""
    mean, own, n = posterior_draws["raw"].mean(axis=0), np.exp(fit.parameters[K + 1]), PEOPLE
    square = (posterior_draws["raw"] ** 2).mean(axis=0).sum(axis=0)
    slope = np.zeros(K + 5)
    slope[:K], slope[K + 2] = mean[:, 1 : K + 1].sum(axis=0) / own, mean[:, K + 1].sum() / np.exp(fit.parameters[K + 3])
    slope[LOG_SDS] = square[0] - n, square[1 : K + 1].sum() - K * n, square[K + 1] - n, square[K + 2] - n
    slope += Objective(fit.answers, Family.WEIBULL, Prior()).evaluate_log_prior(fit.parameters)[1][: K + 5]
    curvature = fit.curvature[: K + 5, : K + 5]  # the lapse rate is held
    off = np.linalg.solve(curvature, slope) / np.sqrt(np.diag(np.linalg.inv(curvature)))
    np.testing.assert_allclose(off, 0.0, atol=0.1)
