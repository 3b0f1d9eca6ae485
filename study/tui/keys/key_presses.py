"""Detect presses of the answer keys among the key events of a terminal.

A terminal does not report releases, and a held key repeats: it is a series of equal events. A key that has been
held since before a question must not answer it. Therefore repetitions are recognised by the time between events.
"""

import sys
import time

from textual.events import Key

QUIET_S = 0.2
"""Smallest time between two presses (s), above the repetition interval of held keys, 25 to 100 ms."""
FIRST_REPEAT_S = 0.7
"""Longest delay from the press of a key to its first repetition (s); keyboards wait 0.25 to 0.66 s."""


class KeyPresses:
    """Detector of presses. The keys of an answer (its digit and its letter) count as the same key."""

    def __init__(self) -> None:
        self._last_s: dict[int, float] = {}

    def is_press(self, answer: int, event_s: float, armed_s: float) -> bool:
        """Whether an event is a press that may answer. False if it comes within `QUIET_S` of the event before, or may
        be the first repetition of a key that was pressed before `armed_s`. event_s: time of the event (s); armed_s:
        time from which answers count (s). Every event must be passed, also while no question is shown."""
        last_s = max(self._last_s.values(), default=float("-inf"))
        same_key_s = self._last_s.get(answer, float("-inf"))
        self._last_s[answer] = event_s
        is_repetition = same_key_s < armed_s and event_s - same_key_s < FIRST_REPEAT_S
        return event_s - last_s >= QUIET_S and not is_repetition


def arrival_s(event: Key) -> float:
    """Time at which the key was read (s), on the clock of `time.monotonic`. Textual stores it in its reading thread, so
    that a delay of the event loop does not change it."""
    now_s = time.monotonic()
    # On Windows, the event's time comes from another clock and cannot be compared.
    return event.time if sys.platform != "win32" and event.time <= now_s else now_s
