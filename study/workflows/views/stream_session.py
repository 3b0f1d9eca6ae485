"""A session's facts as markers of the lab streaming layer (LSL), stamped with the time at which they became facts.

A program of its own follows the log, so that nothing of it can delay or end the session. A fact carries the session's
monotonic clock; the offset of LSL's clock to it is measured again and again and is a marker too.
"""

import json
import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from study.regular_file import TABLE_BYTES, open_regular
from study.workflows.views.lsl_outlets import not_followed_error

EVERY_S = 0.02
"""Between two looks at the log: a marker comes so late, its time stamp does not."""
OFFSET_EVERY_S = 10.0
"""Interval at which the offset of the two clocks is measured (s)."""
OFFSET_TRIES = 10
"""The closest pair of readings counts: any other was interrupted in between."""
NOTED_S = 0.001
"""A smaller change of the offset is not noted again in the session's log."""
FRESH_S = 5.0
"""An older fact has another clock (a simulated session's, or that of before a restart): its marker is stamped when it
is sent, and says so."""

TOLD = (
    "event", "run", "trial", "attempt", "phase", "frequency_hz", "level_n", "direction", "angle_deg", "polarity",
    "answer", "response_time_s", "status", "cause", "missed_ticks", "late_ticks", "latest_s", "delivered_mps2",
    "outcome",
)  # fmt: skip
"""Fields of each fact that are streamed: nothing about the person, no notes, no forms."""

LAST = "session_closed"
"""No fact of a trial follows it, and it is never taken back."""


class Outlet(Protocol):
    """Interface of the LSL outlet of a session's markers."""

    def clock_s(self) -> float:
        """LSL's own clock."""
        ...

    def push(self, marker: str, at_s: float) -> None:
        """Send a marker with its time. at_s: on LSL's clock."""
        ...


@dataclass(frozen=True, slots=True)
class SideTasks:
    """Tasks between two readings of the log."""

    on_offset: Callable[[float], None]
    """Called with the offset of the clocks at first, and whenever it has changed by `NOTED_S`."""
    push_signals: Callable[[float], int]
    """Given that offset: sends what the device's loop did meanwhile, and answers how many ticks were lost."""


NOTHING_BESIDE = SideTasks(lambda offset_s: None, lambda offset_s: 0)
"""No other tasks: no ticks are sent, and none lost."""


class LogFollower:
    """Whole lines as they are written: at the first look those that were there, then those that came since the last."""

    def __init__(self, log: Path) -> None:
        self._log = log
        self._offset = 0

    def lines(self) -> list[bytes]:
        """A last line that is still being written waits. Raises OSError, and ValueError where lines went."""
        with open_regular(self._log) as file:
            fresh = os.fstat(file.fileno()).st_size - self._offset
            if not 0 <= fresh <= TABLE_BYTES:
                raise ValueError("it became shorter" if fresh < 0 else f"it grew by {fresh} bytes at once")
            file.seek(self._offset)
            whole = file.read(fresh).split(b"\n")[:-1]
        self._offset += sum(len(line) + 1 for line in whole)
        return whole


def stream_session(
    log: Path,
    outlet: Outlet,
    on_marker: Callable[[str], None],
    now_s: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
    beside: SideTasks = NOTHING_BESIDE,
) -> int:
    """Follow the log until the session is closed or Ctrl-C; of one that is closed already nothing is sent. Returns how
    many facts became markers. Raises StudyError."""
    noted_s = math.inf
    try:
        follower, sent, offset_s, next_offset_s = LogFollower(log), 0, 0.0, now_s()
        if any(LAST.encode() in line and _fact(line).get("event") == LAST for line in follower.lines()):
            return 0
        while True:
            if now_s() >= next_offset_s:
                offset_s, next_offset_s = measure_offset_s(outlet, now_s), now_s() + OFFSET_EVERY_S
                outlet.push(_text({"event": "clock", "lsl_minus_monotonic_s": offset_s}), outlet.clock_s())
                if not abs(offset_s - noted_s) < NOTED_S:
                    noted_s = offset_s
                    beside.on_offset(offset_s)
            if lost := beside.push_signals(offset_s):
                outlet.push(_text({"event": "signals_lost", "ticks": lost}), outlet.clock_s())
            for line in follower.lines():
                fact = _fact(line)
                _send_fact(fact, outlet, offset_s, now_s(), on_marker)
                sent += 1
                if fact.get("event") == LAST:
                    return sent
            sleep(EVERY_S)
    except (OSError, ValueError, RecursionError) as problem:
        raise not_followed_error(log, problem) from problem


def measure_offset_s(outlet: Outlet, now_s: Callable[[], float]) -> float:
    """LSL's clock less the session's, from the reading that took least time."""
    pairs = []
    for _ in range(OFFSET_TRIES):
        before_s = now_s()
        theirs_s = outlet.clock_s()
        after_s = now_s()
        pairs.append((after_s - before_s, theirs_s - (before_s + after_s) / 2))
    return min(pairs)[1]


def _fact(line: bytes) -> dict[str, Any]:
    fact = json.loads(line)
    if not isinstance(fact, dict):
        raise ValueError(f"a line of it is no fact: {line[:40]!r}")
    return fact


def _send_fact(
    fact: dict[str, Any], outlet: Outlet, offset_s: float, now_s: float, on_marker: Callable[[str], None]
) -> None:
    fields = {name: fact[name] for name in TOLD if fact.get(name) is not None}
    happened_s = fact.get("monotonic_s")
    if isinstance(happened_s, float) and 0 <= now_s - happened_s <= FRESH_S:
        stamped_s = happened_s + offset_s
    else:
        fields["stamped"] = "when it was sent"
        stamped_s = outlet.clock_s()
    marker = _text(fields)
    outlet.push(marker, stamped_s)
    on_marker(marker)


def _text(fields: dict[str, Any]) -> str:
    return json.dumps(fields, separators=(",", ":"))
