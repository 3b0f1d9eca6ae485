"""A safe device around the test's own rig, and a driver call that hangs."""

import threading

import pytest

from study.devices.clock import RealClock
from study.devices.safe import SafeDevice


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
