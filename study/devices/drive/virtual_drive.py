"""Ticks in virtual time: whenever the program sleeps, the ticks that became due are run."""

from collections.abc import Callable

from study.devices.clock import VirtualClock
from study.devices.drive.runner import Runner
from study.devices.governor.governor import Governor


class VirtualDrive:
    """Drive of a device in virtual time: ticks run in the caller's thread whenever the clock goes on."""

    def __init__(self, runner: Runner, governor: Governor, clock: VirtualClock, rate_hz: float) -> None:
        self._runner = runner
        self._governor = governor
        self._clock = clock
        self._rate_hz = rate_hz
        self._started_s = 0.0
        self._run = 0
        self._closed = False
        clock.listen(self._pump)

    def start(self, begin: Callable[[], None]) -> bool:
        """`begin` readies the governor; from now on its ticks fall due. False where something moves already."""
        if self._runner.moving or self._closed:
            return False
        begin()
        self._started_s = self._clock.now_s()
        self._governor.note_begin(self._started_s)
        self._run = 0
        return True

    def check(self) -> None:
        """Nothing can hang: ticks run in the caller's own thread."""

    def refresh(self) -> bool:
        """Update the last reading before it is looked at. Returns whether it is current."""
        if not (self._runner.moving or self._closed):
            self._runner.glance()
        return not self._closed

    def stop(self) -> None:
        """The next tick takes it; none is under way."""

    def close(self) -> None:
        """Run no more ticks when the clock moves on."""
        if not self._closed:
            self._closed = True
            self._clock.forget(self._pump)

    def _pump(self, now_s: float) -> None:
        if self._governor.moving:
            due = ticks_by(now_s - self._started_s, self._rate_hz)
            self._runner.run(due - self._run)
            self._run = due


def ticks_by(elapsed_s: float, rate_hz: float) -> int:
    """Ticks that are due; a sum of rounded times just short of a tick counts as that tick."""
    return int(elapsed_s * rate_hz + 1e-6)
