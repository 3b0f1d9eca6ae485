"""Detect presses of the answer keys among the key events of a terminal: reject the auto-repeat of a held key.

A terminal reports no release, and a held key gives a series of equal events. A key that is held since before a question
must not answer it; its repetitions are recognised by the time between events.
"""

import sys
import time

from textual.events import Key

MIN_PRESS_INTERVAL_S = 0.2
"""Smallest time between two presses (s). Chosen above the repetition interval of held keys, 25 to 100 ms."""
MAX_FIRST_REPEAT_S = 0.7
"""Longest delay from the press of a key to its first repetition (s). Chosen above usual settings, 0.25 to 0.66 s."""


class KeyPressDetector:
    """Detector of presses of the answer keys. All keys of an answer (its digit and its letter) count as the same
    key."""

    def __init__(self) -> None:
        self._last_event_s: dict[int, float] = {}  # time of the last event, by answer

    def record_event(self, answer: int, event_s: float, armed_s: float) -> bool:
        """Record a key event, and return whether it is a press that may answer a question. False if it comes less than
        `MIN_PRESS_INTERVAL_S` after the last event of any answer, or may be the first repetition of a key whose last
        event was before `armed_s`.

        answer: 1 or 2; event_s: time of the event (s); armed_s: time from which answers count (s), infinite while no
        question is shown. Call for every event of an answer key, also while no question is shown.
        """
        last_event_s = max(self._last_event_s.values(), default=float("-inf"))
        last_same_key_s = self._last_event_s.get(answer, float("-inf"))
        self._last_event_s[answer] = event_s
        is_repetition = last_same_key_s < armed_s and event_s - last_same_key_s < MAX_FIRST_REPEAT_S
        return event_s - last_event_s >= MIN_PRESS_INTERVAL_S and not is_repetition


def get_arrival_time_s(event: Key) -> float:
    """Get the time at which the key was read from the terminal (s), on the clock of `time.monotonic`. Textual's reading
    thread stores it, so that a delay of the event loop does not change it. The present time where the stored one is
    later, and on Windows, where Textual takes it from another clock."""
    now_s = time.monotonic()
    return event.time if sys.platform != "win32" and event.time <= now_s else now_s
