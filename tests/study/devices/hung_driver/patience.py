"""Waiting for a driver that hangs."""

import time

import pytest


def alive(device, seconds: float) -> None:
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        device.keep_alive()
        time.sleep(0.01)


def hold(device, rigs, rig, seconds: float = 2.0) -> None:
    """Until the force has faded in, which takes 0.1 s of the loop's time."""
    device.hold(rigs.push())
    until_s = time.monotonic() + seconds
    while rig.last_n[0] != pytest.approx(2.9) and time.monotonic() < until_s:
        alive(device, 0.02)
    assert rig.last_n[0] == pytest.approx(2.9)


def wait_until(true, seconds: float = 2.0) -> None:
    until_s = time.monotonic() + seconds
    while not true() and time.monotonic() < until_s:
        time.sleep(0.005)
    assert true()
