"""Whether this process stood still while a test ran against the clock.

A thread asks to be woken every few milliseconds and keeps how late that was. The firmware of a device lets go 30 ms
after the last force, the safety layer 0.1 s after the last sign of life: where a machine gives the test no processor
for so long, the device is right to let go, and a test of something else fails for no fault of the code. Such a test is
run again; a failure without a measured pause never is.
"""

import threading
import time

PERIOD_S = 0.002
# The shortest of these times: the timeout of the firmware's watchdog (`study.devices.force_dimension.connect`).
TOO_LONG_S = 0.03


class PauseMeter:
    """The longest time by which a thread of this process was woken late, since `reset`."""

    def __init__(self) -> None:
        self.longest_s = self._since_s = 0.0
        self._thread: threading.Thread | None = None

    def reset(self) -> None:
        self.longest_s, self._since_s = 0.0, time.monotonic()
        if self._thread is None:
            self._thread = threading.Thread(target=self._measure, name="pause meter", daemon=True)
            self._thread.start()

    def paused(self) -> bool:
        return self.longest_s > TOO_LONG_S

    def _measure(self) -> None:
        while True:
            began_s = time.monotonic()
            time.sleep(PERIOD_S)
            if began_s >= self._since_s:
                self.longest_s = max(self.longest_s, time.monotonic() - began_s - PERIOD_S)
