"""What a test of the loop's process waits for, with a bound."""

import contextlib
import os
import time

import pytest

from study.devices.device import Fault

LATEST_S = 20.0
"""For what takes a fraction of a second on a quiet computer."""


STARTS = 3


def becomes(true) -> None:
    until_s = time.monotonic() + LATEST_S
    while not true():
        assert time.monotonic() < until_s
        time.sleep(0.005)


def runs(pid: int) -> bool:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, 0)
        return True
    return False


def hold_force(device, rigs, stub) -> None:
    """Waits for the force. Where a busy computer gave this program or the loop no processor, so that the device let go
    before that could be seen, it is held again."""
    for _ in range(STARTS):
        device.hold(rigs.sine(2.0, 25))
        becomes(lambda: device.keep_alive() or device.fault() is not Fault.NONE or stub.get("last_write") > 0.5)
        if device.fault() is Fault.NONE:
            return
        fault = device.release().health.fault
        assert fault in (Fault.STALLED, Fault.LOST), fault
    pytest.fail(f"the force was let go {STARTS} times before it was seen")
