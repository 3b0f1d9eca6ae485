"""A rig whose sensor or driver hangs, in real time."""

import pytest


@pytest.fixture
def rig(rigs):
    return rigs.HeldForceRig()
