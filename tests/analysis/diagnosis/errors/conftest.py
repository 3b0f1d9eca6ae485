"""Recordings of a mass with Coulomb friction: held by a controller, and drifting."""

import pytest

from equalizer.signals.recording import Recording
from tests.analysis.diagnosis.errors.drifting_plant import course, recording


@pytest.fixture(scope="module")
def held() -> Recording:
    return recording(0.08 * course(12.0, 3), controlled=True)


@pytest.fixture(scope="module")
def drifting() -> Recording:
    return recording(9.0 * course(12.0, 5), controlled=False)
