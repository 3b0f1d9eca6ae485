"""Random stable models with every kind of end of the matrices: feedthrough, delay, the low-frequency penalty."""

from collections.abc import Callable

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.tracking.lqr.tracking_problem import TrackingProblem, TrackingWeights, make_tracking_problem

PEAK_GAIN = 10.0
"""Largest singular value of the response over all frequencies: rho is read against its square."""


def random_model(order, seed, feedthrough=True, size=3, peak_gain=PEAK_GAIN) -> IdentifiedModel:
    """`feedthrough=False`: D = 0 and one more tick of delay, so that y[k] depends on u[k - 2] and before."""
    draw = np.random.default_rng(seed).standard_normal
    A, B, C, D = draw((order, order)), draw((order, size)), draw((size, order)), draw((size, size))
    A *= 0.97 / np.abs(np.linalg.eigvals(A)).max()
    z = np.exp(1j * np.linspace(0, np.pi, 500))[:, None, None]
    response = C @ np.linalg.solve(z * np.eye(order) - A, B.astype(complex)[None]) + feedthrough * D
    scale = peak_gain / np.linalg.svd(response, compute_uv=False).max()
    C, D = scale * C, scale * feedthrough * D
    if not feedthrough:
        A = np.block([[A, B], [np.zeros((size, order + size))]])
        B, C = np.vstack([np.zeros((order, size)), np.eye(size)]), np.hstack([C, np.zeros((size, size))])
    forces, answers = tuple(f"f{i}" for i in range(size)), tuple(f"a{i}" for i in range(size))
    return IdentifiedModel(A, B, C, D, 1000.0, (5.0, 35.0), "N", "m/s^2", forces, answers)


@pytest.fixture(scope="session")
def model_of() -> Callable[..., IdentifiedModel]:
    return random_model


@pytest.fixture(scope="session")
def problem_of() -> Callable[..., TrackingProblem]:
    def make(order, seed, weight=1e-3, low_frequency_weight=0.0, **kind) -> TrackingProblem:
        weights = TrackingWeights(weight, low_frequency_weight=low_frequency_weight)
        return make_tracking_problem(random_model(order, seed, **kind), weights)

    return make


@pytest.fixture(scope="session")
def device_model(plants) -> IdentifiedModel:
    """The synthetic device's own equations as a model: no identification between a method and its limits."""
    plant = plants.omega_like()
    names = ("fx", "fy", "fz"), ("ax", "ay", "az")
    return IdentifiedModel(plant.A, plant.B, plant.C, np.zeros((3, 3)), 1000.0, (5.0, 35.0), "N", "m/s^2", *names)


@pytest.fixture(scope="session")
def difference() -> Callable[[np.ndarray, np.ndarray], float]:
    """Relative to the second."""
    return lambda found, right: float(np.linalg.norm(found - right) / np.linalg.norm(right))


@pytest.fixture(scope="session")
def random_rotation() -> Callable[[int], np.ndarray]:
    return lambda seed: np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
