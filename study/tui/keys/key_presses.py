"""Detect key presses among key events. A terminal reports no releases: a held key is a series of equal events."""

import sys
import time

from textual.events import Key

QUIET_S = 0.2
"""Held keys repeat every 25 to 100 ms."""
FIRST_REPEAT_S = 0.7
"""Before the first repetition keyboards wait longer: 0.25 to 0.66 s."""


class KeyPresses:
    """Presses of the answer keys; several keys of one answer count as one."""

    def __init__(self) -> None:
        self._last_s: dict[int, float] = {}

    def is_press(self, answer: int, at_s: float, armed_s: float) -> bool:
        """Whether an event is a press. False: the key may still be held since before `armed_s`, or answers come
        faster than a person can intend. Every event must be passed, also while nothing is asked."""
        last_s = max(self._last_s.values(), default=float("-inf"))
        same_s = self._last_s.get(answer, float("-inf"))
        self._last_s[answer] = at_s
        held = same_s < armed_s and at_s - same_s < FIRST_REPEAT_S
        return at_s - last_s >= QUIET_S and not held


def arrival_s(event: Key) -> float:
    """When the key was read, on the clock of `time.monotonic`: Textual stamps it in the reading thread. The stamp
    stays valid if handling is delayed."""
    now_s = time.monotonic()
    # On Windows the stamp is another clock's.
    return event.time if sys.platform != "win32" and event.time <= now_s else now_s
