"""Waiting for a driver that hangs."""

import time

import pytest


def alive(device, seconds: float) -> None:
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        device.keep_alive()
        time.sleep(0.01)


def hold(device, rigs, rig) -> None:
    device.hold(rigs.push())
    alive(device, 0.15)
    assert rig.last_n[0] == pytest.approx(2.9)


def wait_until(true, seconds: float = 2.0) -> None:
    until_s = time.monotonic() + seconds
    while not true() and time.monotonic() < until_s:
        time.sleep(0.005)
    assert true()
