"""A rig whose sensor or driver hangs, in real time."""

import threading

import pytest

from study.devices.clock import RealClock
from study.devices.safe import SafeDevice


@pytest.fixture
def rig(rigs):
    return rigs.HeldForceRig()


@pytest.fixture
def hang():
    """Blocks its caller until the test is over."""
    event = threading.Event()
    yield event
    event.set()


@pytest.fixture
def device(rigs, rig, hang):
    device = SafeDevice(rig, rigs.SETTINGS, RealClock())
    yield device
    hang.set()
    device.close()
