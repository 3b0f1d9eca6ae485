"""Test of the device's watchdog at every opening: commands pause on purpose, and the device must switch its force off
in time.

The commanded force is zero throughout, so that the test is safe even if the watchdog fails. It passes if the device
reports its forces as off, its brakes as on, and the watchdog as the cause.
"""

from collections.abc import Callable

from study.devices.force_dimension.handle import WATCHDOG_CAUSE, Handle, Status
from study.errors import DeviceError

ARMED_FOR_S = 0.05
"""Time for which zero forces are sent before the pause."""
EVERY_S = 0.002
"""Interval of the zero forces, then of polling the status (s)."""
MARGIN_S = 0.02
"""Time granted in addition to the watchdog's timeout (s), for the USB transfer and the device's own processing."""

ATTEMPTS = 5
"""Number of attempts to keep the forces on before the pause: on a busy computer a late command may trip the watchdog
too early."""


def check_watchdog(
    handle: Handle, drops_after_s: float, now_s: Callable[[], float], sleep: Callable[[float], None]
) -> float:
    """Pause the commands. Returns the time (s) after which the device reported its force as off; then enables it again.

    drops_after_s: timeout of the watchdog (s), 0 without one; now_s and sleep: clock.
    Raises `DeviceError` where the force stays on or goes off for another cause, and `LibraryError`.
    """
    if drops_after_s <= 0:
        raise _watchdog_error("It has no watchdog, or none that can be set.")
    if not any(_send_zeros(handle, now_s, sleep) for _ in range(ATTEMPTS)):
        raise _watchdog_error(f"It does not continue to accept forces: {handle.read_status().off_reason}.")
    silent_since_s = now_s()
    while (status := handle.read_status()).force_on:
        if now_s() - silent_since_s > drops_after_s + MARGIN_S and handle.read_status().force_on:
            raise _watchdog_error(
                f"{1000 * (now_s() - silent_since_s):.0f} ms after the last command it still accepts forces."
            )
        sleep(EVERY_S)
    release_s = now_s() - silent_since_s
    _check_reason(status)
    handle.enable_force()
    return release_s


def _send_zeros(handle: Handle, now_s: Callable[[], float], sleep: Callable[[float], None]) -> bool:
    """Send zero forces for `ARMED_FOR_S`. Returns whether the device's forces are still on at the end."""
    handle.enable_force()
    until_s = now_s() + ARMED_FOR_S
    while now_s() < until_s:
        handle.set_force(0.0, 0.0, 0.0)
        sleep(EVERY_S)
    handle.set_force(0.0, 0.0, 0.0)
    return handle.read_status().force_on


def _check_reason(status: Status) -> None:
    """Require the watchdog as the cause, and the brakes on. Raises `DeviceError`."""
    if status.off_cause != WATCHDOG_CAUSE:
        raise _watchdog_error(f"It let go for another reason: {status.off_reason}.")
    if not status.braking:
        raise _watchdog_error("It let go without its brakes.")


def _watchdog_error(reason: str) -> DeviceError:
    return DeviceError(
        "The device's watchdog failed its test",
        f"{reason} If this program died, the device would hold its last force.",
        "Do not let a person hold the handle. Switch the device off and on and try again; else update its firmware.",
    )
