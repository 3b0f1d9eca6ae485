"""The device port over pipes, with the other side in a thread of the test."""

import contextlib

import pytest

from study.devices.clock import RealClock
from study.devices.loop_process import call_pipe, remote_device
from study.devices.safe import SafeDevice


@pytest.fixture
def behind(rigs, rig):
    """The device on the other side of the pipes."""
    return SafeDevice(rig, rigs.SETTINGS, RealClock())


@pytest.fixture
def rig(rigs):
    return rigs.HeldForceRig()


@pytest.fixture
def device(behind, served, rigs):
    with contextlib.closing(served.remote(behind, rigs.SETTINGS)) as device:
        yield device


@pytest.fixture
def impatient(monkeypatch):
    for name in ("ANSWER_TIMEOUT_S", "STOP_TIMEOUT_S", "CLOSE_TIMEOUT_S"):
        monkeypatch.setattr(remote_device, name, 0.2)
    monkeypatch.setattr(call_pipe, "ANSWER_GRACE_S", 0.1)
