"""Control ticks in virtual time: when the program sleeps, the ticks that fall due in that time are run at once.

Made by `study.devices.safe` for a simulated device with a virtual clock.
"""

from collections.abc import Callable

from study.devices.clock import VirtualClock
from study.devices.drive.runner import Runner
from study.devices.governor.governor import Governor


class VirtualDrive:
    """Drive of a device in virtual time: due ticks run in the caller's thread when the clock advances."""

    def __init__(self, runner: Runner, governor: Governor, clock: VirtualClock, rate_hz: float) -> None:
        self._runner = runner
        self._governor = governor
        self._clock = clock
        self._rate_hz = rate_hz
        self._started_s = 0.0
        self._completed_ticks = 0
        self._closed = False
        clock.add_listener(self._run_due_ticks)

    def start(self, begin_stimulus: Callable[[], None]) -> bool:
        """Call `begin_stimulus`, which prepares the governor; from then on ticks fall due. Returns False, without
        calling it, where a stimulus is in progress or the drive is closed."""
        if self._runner.moving or self._closed:
            return False
        begin_stimulus()
        self._started_s = self._clock.now_s()
        self._governor.set_begin_time(self._started_s)
        self._completed_ticks = 0
        return True

    def check(self) -> None:
        """Nothing to check: ticks run in the caller's thread."""

    def refresh(self) -> bool:
        """Update the last reading while nothing moves. Returns whether it is current."""
        if not (self._runner.moving or self._closed):
            self._runner.read_sensors()
        return not self._closed

    def stop(self) -> None:
        """Nothing to wait for: no tick is in progress, and the next one executes the stop."""

    def close(self) -> None:
        """Run no more ticks when the clock advances."""
        if not self._closed:
            self._closed = True
            self._clock.remove_listener(self._run_due_ticks)

    def _run_due_ticks(self, now_s: float) -> None:
        """Run the ticks that have become due by now_s (s)."""
        if self._governor.moving:
            due_ticks = count_due_ticks(now_s - self._started_s, self._rate_hz)
            self._runner.run(due_ticks - self._completed_ticks)
            self._completed_ticks = due_ticks


def count_due_ticks(elapsed_s: float, rate_hz: float) -> int:
    """Count the ticks that are due elapsed_s (s) after the start. rate_hz: ticks per second. A time less than 1e-6 of a
    tick before a tick counts as that tick, because of rounding (as `compiled_drive.TICK_TOLERANCE`)."""
    return int(elapsed_s * rate_hz + 1e-6)
