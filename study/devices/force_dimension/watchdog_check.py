"""Test of the device's watchdog at its opening: the commands are paused, and the device must report its force as off.

The commanded force is zero throughout, so that the test is safe even if the watchdog fails. It passes if the device
reports its forces as off, its brakes as on, and the watchdog as the cause. It fails where a status that is read after
the timeout and `MARGIN_S` still reports forces as on; a late release before that reading is not noticed.
"""

from collections.abc import Callable

from study.devices.force_dimension.handle import WATCHDOG_CAUSE, Handle, Status
from study.errors import DeviceError

ZERO_FORCE_DURATION_S = 0.05
"""Time (s) for which zero forces are sent before the pause. Chosen."""
POLL_INTERVAL_S = 0.002
"""Interval of the zero forces, then of polling the status (s). Chosen: two ticks at 1 kHz."""
MARGIN_S = 0.02
"""Time granted in addition to the watchdog's timeout (s), for the USB transfer and the processing in the device.
Chosen."""

MAX_ATTEMPTS = 5
"""Number of attempts to keep the forces on before the pause: on a busy computer a late command may trip the watchdog
too early."""


def check_watchdog(
    handle: Handle, watchdog_timeout_s: float, now_s: Callable[[], float], sleep: Callable[[float], None]
) -> float:
    """Pause the commands, and wait until the device reports its force as off; then enable it again. Returns the time
    (s) from the last command to this report.

    watchdog_timeout_s: timeout of the watchdog (s), 0 without one; now_s and sleep: clock. Raises `DeviceError` where
    there is no watchdog, or the force does not stay on before the pause, stays on after it, or goes off for another
    cause or without the brakes, and `LibraryError`.
    """
    if watchdog_timeout_s <= 0:
        raise _make_watchdog_error("It has no watchdog, or none that can be set.")
    if not any(_send_zeros(handle, now_s, sleep) for _ in range(MAX_ATTEMPTS)):
        raise _make_watchdog_error(f"It does not continue to accept forces: {handle.read_status().off_reason}.")
    last_command_s = now_s()
    while (status := handle.read_status()).force_on:
        if now_s() - last_command_s > watchdog_timeout_s + MARGIN_S and handle.read_status().force_on:
            raise _make_watchdog_error(
                f"{1000 * (now_s() - last_command_s):.0f} ms after the last command it still accepts forces."
            )
        sleep(POLL_INTERVAL_S)
    release_delay_s = now_s() - last_command_s
    _check_release_cause(status)
    handle.enable_force()
    return release_delay_s


def _send_zeros(handle: Handle, now_s: Callable[[], float], sleep: Callable[[float], None]) -> bool:
    """Send zero forces for `ZERO_FORCE_DURATION_S`. Returns whether the device's forces are still on at the end."""
    handle.enable_force()
    end_s = now_s() + ZERO_FORCE_DURATION_S
    while now_s() < end_s:
        handle.set_force(0.0, 0.0, 0.0)
        sleep(POLL_INTERVAL_S)
    handle.set_force(0.0, 0.0, 0.0)
    return handle.read_status().force_on


def _check_release_cause(status: Status) -> None:
    """Require the watchdog as the cause, and the brakes on. Raises `DeviceError`."""
    if status.off_cause != WATCHDOG_CAUSE:
        raise _make_watchdog_error(f"It let go for another reason: {status.off_reason}.")
    if not status.braking:
        raise _make_watchdog_error("It let go without its brakes.")


def _make_watchdog_error(reason: str) -> DeviceError:
    """Make the error for a watchdog that failed the test. reason: a sentence."""
    return DeviceError(
        "The device's watchdog failed its test",
        f"{reason} Without a watchdog that works, the device would hold its last force if this program died.",
        "Do not let a person hold the handle. Switch the device off and on and try again; else update its firmware.",
    )
