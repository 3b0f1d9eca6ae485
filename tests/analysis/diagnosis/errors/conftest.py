"""Recordings of a mass with Coulomb friction: held by a controller, and drifting."""

import pytest

from equalizer.signals.recording import Recording
from tests.analysis.diagnosis.errors.drifting_plant import random_course, record_plant


@pytest.fixture(scope="module")
def controlled_recording() -> Recording:
    return record_plant(0.08 * random_course(12.0, 3), controlled=True)


@pytest.fixture(scope="module")
def drifting_recording() -> Recording:
    return record_plant(9.0 * random_course(12.0, 5), controlled=False)
