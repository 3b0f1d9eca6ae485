"""A safe device in virtual time, and its rig."""

import pytest

from study.devices.clock import VirtualClock
from study.devices.safe import SafeDevice


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def rig(rigs):
    return rigs.compiled_rig()


@pytest.fixture
def device(rigs, rig, clock):
    device = SafeDevice(rig, rigs.SETTINGS, clock)
    yield device
    device.close()
