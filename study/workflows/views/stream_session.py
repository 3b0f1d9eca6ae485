"""Stream a session's events as markers of the lab streaming layer (LSL), with the time at which they happened
(`hapteq stream`).

A separate process follows the log, so that streaming cannot delay or end the session. An event in the log states its
time t by the session's monotonic clock (older logs do not); its marker gets the time t + offset on LSL's clock. The
offset between the two clocks is measured every `OFFSET_INTERVAL_S` and is streamed as a marker too.
"""

import json
import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from study.regular_file import MAX_TABLE_BYTES, open_regular
from study.workflows.views.lsl_outlets import make_unreadable_log_error

POLL_INTERVAL_S = 0.02
"""Interval (s) between two readings of the log, about the largest delay of a marker; its time is correct. Chosen."""
OFFSET_INTERVAL_S = 10.0
"""Interval (s) at which the offset of the two clocks is measured. Chosen."""
OFFSET_READINGS = 10
"""Number of readings of both clocks in a measurement of the offset, of which that taken in the shortest time is used:
longer ones were interrupted. Chosen."""
REPORTED_CHANGE_S = 0.001
"""Least change of the offset (s) for which `SideTasks.on_offset` is called again. Chosen."""
MAX_EVENT_AGE_S = 5.0
"""Largest age (s) of an event by this computer's monotonic clock. Chosen. An event outside 0 to this age has the time
of another clock (simulated session, or before a restart): its marker gets the time of sending and states so."""

STREAMED_FIELDS = (
    "event", "run", "trial", "attempt", "phase", "frequency_hz", "level_n", "direction", "angle_deg", "polarity",
    "answer", "response_time_s", "status", "cause", "missed_ticks", "late_ticks", "latest_s", "delivered_mps2",
    "outcome",
)  # fmt: skip
"""Fields of an event that are streamed; none contains personal data, notes or forms."""

LAST_EVENT = "session_closed"
"""Event that closes a session, after which streaming ends."""


class Outlet(Protocol):
    """Interface of the LSL outlet of a session's markers."""

    def clock_s(self) -> float:
        """Time on LSL's own clock (s)."""
        ...

    def push(self, marker: str, at_s: float) -> None:
        """Send a marker. at_s: its time on LSL's clock (s)."""
        ...


@dataclass(frozen=True, slots=True)
class SideTasks:
    """Functions that are called between two readings of the log."""

    on_offset: Callable[[float], None]
    """Called with the offset, LSL's clock minus the session's (s), at first and when it has changed by
    `REPORTED_CHANGE_S`."""
    push_signals: Callable[[float], int]
    """Called with the offset (s) at every reading: sends the new signals of the device's control loop, and returns the
    number of lost ticks."""


NO_SIDE_TASKS = SideTasks(lambda offset_s: None, lambda offset_s: 0)
"""Side tasks that do nothing: no signals are sent, and no ticks are lost."""


class LogFollower:
    """Reads complete lines of a growing log: all existing lines at first, then the new lines since the last reading."""

    def __init__(self, log: Path) -> None:
        self._log = log
        self._read_byte_count = 0

    def read_new_lines(self) -> list[bytes]:
        """Read the new complete lines; an incomplete last line is returned once it is complete. Raises OSError, and
        ValueError where the log became shorter or grew by more than `MAX_TABLE_BYTES`."""
        with open_regular(self._log) as file:
            new_byte_count = os.fstat(file.fileno()).st_size - self._read_byte_count
            if not 0 <= new_byte_count <= MAX_TABLE_BYTES:
                raise ValueError(
                    "it became shorter" if new_byte_count < 0 else f"it grew by {new_byte_count} bytes at once"
                )
            file.seek(self._read_byte_count)
            complete_lines = file.read(new_byte_count).split(b"\n")[:-1]
        self._read_byte_count += sum(len(line) + 1 for line in complete_lines)
        return complete_lines


def stream_session(
    log: Path,
    outlet: Outlet,
    on_marker: Callable[[str], None],
    now_s: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
    side_tasks: SideTasks = NO_SIDE_TASKS,
) -> int:
    """Follow the log until the session is closed, and send the events that are logged after the call; nothing is sent
    for a session that is already closed. on_marker: called with each event's marker that was sent. now_s: monotonic
    clock of the session's computer (s). Returns the number of events sent. Raises StudyError where the log cannot be
    read."""
    reported_offset_s = math.inf
    try:
        follower, sent_count, offset_s, next_measurement_s = LogFollower(log), 0, 0.0, now_s()
        if any(
            LAST_EVENT.encode() in line and _parse_event(line).get("event") == LAST_EVENT
            for line in follower.read_new_lines()
        ):
            return 0
        while True:
            if now_s() >= next_measurement_s:
                offset_s, next_measurement_s = measure_offset_s(outlet, now_s), now_s() + OFFSET_INTERVAL_S
                outlet.push(_format_marker({"event": "clock", "lsl_minus_monotonic_s": offset_s}), outlet.clock_s())
                if not abs(offset_s - reported_offset_s) < REPORTED_CHANGE_S:
                    reported_offset_s = offset_s
                    side_tasks.on_offset(offset_s)
            if lost_ticks := side_tasks.push_signals(offset_s):
                outlet.push(_format_marker({"event": "signals_lost", "ticks": lost_ticks}), outlet.clock_s())
            for line in follower.read_new_lines():
                event = _parse_event(line)
                _send_event(event, outlet, offset_s, now_s(), on_marker)
                sent_count += 1
                if event.get("event") == LAST_EVENT:
                    return sent_count
            sleep(POLL_INTERVAL_S)
    except (OSError, ValueError, RecursionError) as problem:
        raise make_unreadable_log_error(log, problem) from problem


def measure_offset_s(outlet: Outlet, now_s: Callable[[], float]) -> float:
    """Measure the offset (s), LSL's clock minus `now_s`, by the quickest of `OFFSET_READINGS` readings: LSL's clock
    minus the mean of `now_s` before and after it."""
    readings = []
    for _ in range(OFFSET_READINGS):
        before_s = now_s()
        lsl_s = outlet.clock_s()
        after_s = now_s()
        readings.append((after_s - before_s, lsl_s - (before_s + after_s) / 2))
    return min(readings)[1]


def _parse_event(line: bytes) -> dict[str, Any]:
    """Parse the event in a line of the log. Raises ValueError where it is not a JSON object."""
    event = json.loads(line)
    if not isinstance(event, dict):
        raise ValueError(f"a line of it is no event: {line[:40]!r}")
    return event


def _send_event(
    event: dict[str, Any], outlet: Outlet, offset_s: float, now_s: float, on_marker: Callable[[str], None]
) -> None:
    """Send the streamed fields of an event, with its time if its age is 0 to `MAX_EVENT_AGE_S`, else with the time
    of sending and the field `stamped`."""
    fields = {name: event[name] for name in STREAMED_FIELDS if event.get(name) is not None}
    event_s = event.get("monotonic_s")
    if isinstance(event_s, float) and 0 <= now_s - event_s <= MAX_EVENT_AGE_S:
        marker_s = event_s + offset_s
    else:
        fields["stamped"] = "when it was sent"
        marker_s = outlet.clock_s()
    marker = _format_marker(fields)
    outlet.push(marker, marker_s)
    on_marker(marker)


def _format_marker(fields: dict[str, Any]) -> str:
    """Format a marker: the fields as compact JSON."""
    return json.dumps(fields, separators=(",", ":"))
