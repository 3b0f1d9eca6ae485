"""A bench and a short drive, so that a device is simulated in a tenth of a second."""

import numpy as np
import pytest

from study.evaluation.challenge.bench import draw_bench
from study.evaluation.challenge.drive_plan import draw_multisine


@pytest.fixture(scope="session")
def bench():
    return draw_bench(np.random.default_rng(7))


@pytest.fixture(scope="session")
def command():
    """A multisine on all axes, (2000, 3), N."""
    random = np.random.default_rng(8)
    return np.column_stack([draw_multisine(random, 3.0) for _ in range(3)])
