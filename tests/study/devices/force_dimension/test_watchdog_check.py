"""The proof that the device's own watchdog works, on devices where it does and where it does not."""

from pathlib import Path

import pytest

from study.devices.force_dimension import findings, watchdog_check
from study.devices.force_dimension.handle import Handle
from study.devices.force_dimension.watchdog_check import MARGIN_S, check_watchdog
from study.errors import DeviceError

WATCHDOG_S = 0.03


class SteppedTime:
    """Passes by sleeping, for the program and for the device."""

    def __init__(self, stub) -> None:
        self.stub, self.seconds = stub, 0.0

    def now_s(self) -> float:
        return self.seconds

    def sleep(self, seconds: float) -> None:
        self.seconds += seconds
        self.stub.advance(seconds)


@pytest.fixture
def handle(stepped_stub):
    handle = stepped_stub.opened()
    handle.enable_force()
    yield handle
    handle.disconnect()


def proved(stub, handle: Handle, watchdog_s: float = WATCHDOG_S) -> float:
    time = SteppedTime(stub)
    return check_watchdog(handle, handle.arm_watchdog(watchdog_s), time.now_s, time.sleep)


@pytest.mark.parametrize("watchdog_s", [0.005, 0.02, 0.03])
def test_a_device_that_lets_go_in_time_is_proved_and_then_takes_forces_again(stepped_stub, handle, watchdog_s):
    took_s = proved(stepped_stub, handle, watchdog_s)
    assert watchdog_s <= took_s + 0.002 and took_s <= watchdog_s + MARGIN_S
    assert stepped_stub.get("force_on") and stepped_stub.get("peak_n") == 0


@pytest.mark.parametrize(
    ("switches", "said"),
    [
        ({"watchdog_works": 0}, "it still accepts forces"),
        ({"watchdog_stretch": 5}, "it still accepts forces"),
        ({"watchdog_settable": 0}, "no watchdog"),
        ({"force_enables": 0}, "does not continue to accept forces"),
        ({"off_by": 1}, "does not continue to accept forces: a button"),
    ],
)
def test_a_device_that_does_not_let_go_in_time_is_not_proved(stepped_stub, handle, switches, said):
    for name, value in switches.items():
        stepped_stub.set(name, value)
    if "force_enables" in switches:
        stepped_stub.set("force_on", 0)
    with pytest.raises(DeviceError, match=said) as refusal:
        proved(stepped_stub, handle)
    assert "Do not let a person hold the handle" in refusal.value.do_now
    assert stepped_stub.get("peak_n") == 0


def test_a_force_that_went_off_for_another_reason_proves_nothing(stepped_stub, handle):
    time = SteppedTime(stepped_stub)

    def sleep(seconds: float) -> None:
        time.sleep(seconds)
        if time.seconds > 0.06:  # after the last command: the USB cable, not the watchdog
            stepped_stub.set("off_by", 5)

    with pytest.raises(DeviceError, match="for another reason: the USB connection broke"):
        check_watchdog(handle, handle.arm_watchdog(WATCHDOG_S), time.now_s, sleep)


def test_only_zero_forces_are_ever_sent_past_the_safety_layer():
    """By the source: these files write to a device without the governor."""
    for module in (findings, watchdog_check):
        source = Path(module.__file__).read_text()
        assert source.count("set_force(") == source.count("set_force(0.0, 0.0, 0.0)") > 0
