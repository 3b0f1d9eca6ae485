"""Test of the device's watchdog at every opening: it is armed, the loop stops on purpose, and the device must switch
its force off in time.

The command is zero throughout, so nothing pulls whether or not it works; what counts is that the device says that it
takes no forces any more, that its brakes hold, and that its watchdog is why.
"""

from collections.abc import Callable

from study.devices.force_dimension.handle import WATCHDOG_CAUSE, Handle, Status
from study.errors import DeviceError

ARMED_FOR_S = 0.05
"""Time for which zero forces are sent before the pause."""
EVERY_S = 0.002
"""Interval of polling."""
MARGIN_S = 0.02
"""Time granted beyond the watchdog's own, for the USB and the device's own bookkeeping."""

ATTEMPTS = 5
"""A busy computer may come too late for the watchdog before it is meant to."""


def check_watchdog(
    handle: Handle, drops_after_s: float, now_s: Callable[[], float], sleep: Callable[[float], None]
) -> float:
    """Time (s) without commands after which the device was found without force; the device takes forces again after.

    Raises `DeviceError` where it holds on, and `LibraryError`.
    """
    if drops_after_s <= 0:
        raise _watchdog_error("It has no watchdog, or none that can be set.")
    if not any(_send_zeros(handle, now_s, sleep) for _ in range(ATTEMPTS)):
        raise _watchdog_error(f"It does not keep taking forces: {handle.status().why_off}.")
    silent_since_s = now_s()
    while (status := handle.status()).force_on:
        if now_s() - silent_since_s > drops_after_s + MARGIN_S and handle.status().force_on:
            raise _watchdog_error(
                f"{1000 * (now_s() - silent_since_s):.0f} ms after the last command it still takes forces."
            )
        sleep(EVERY_S)
    took_s = now_s() - silent_since_s
    _check_reason(status)
    handle.enable_force()
    return took_s


def _send_zeros(handle: Handle, now_s: Callable[[], float], sleep: Callable[[float], None]) -> bool:
    """Zero forces for a while. Whether the device takes them to the end."""
    handle.enable_force()
    until_s = now_s() + ARMED_FOR_S
    while now_s() < until_s:
        handle.set_force(0.0, 0.0, 0.0)
        sleep(EVERY_S)
    handle.set_force(0.0, 0.0, 0.0)
    return handle.status().force_on


def _check_reason(status: Status) -> None:
    if status.off_cause != WATCHDOG_CAUSE:
        raise _watchdog_error(f"It let go for another reason: {status.why_off}.")
    if not status.braking:
        raise _watchdog_error("It let go without its brakes.")


def _watchdog_error(happened: str) -> DeviceError:
    return DeviceError(
        "The device's watchdog failed its test",
        f"{happened} If this program died, the device would hold its last force.",
        "Do not let a person hold the handle. Switch the device off and on and try again; else update its firmware.",
    )
