"""A governor on a simulated mass, ready for a stimulus."""

import pytest

from tests.study.devices.governor.bench import Bench


@pytest.fixture
def bench(rigs):
    return Bench(rigs)
