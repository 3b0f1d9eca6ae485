"""Logged event of an answer, with the counters of the device at that moment.

If the program is killed before the measurement of the trial is logged, these counters decide whether the trial counts.
"""

from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from study.session.facts.fact_types import Count, Index, Magnitude, Seconds, UtcTime
from study.session.facts.sitting_events import FACT_CONFIG


@dataclass(frozen=True, config=FACT_CONFIG)
class AnswerHealth:
    """Faults and counters of the device from the start of the stimulus to the answer, as in
    `study.devices.device.Health`."""

    fault: Annotated[str, Field(pattern="^[A-Z_]{1,40}$")]
    """Name of the fault of the device; NONE without a fault."""
    felt_whole: bool
    """Whether the stimulus was complete until the answer: no fault had ended it."""
    ticks: Count
    """Ticks of the control loop, missed ones included."""
    missed_ticks: Count
    """Ticks that were not run in time."""
    stimulus_clipped: Count
    """Ticks in which the stimulus was limited to its cap."""
    total_clipped: Count
    """Ticks in which the sum of all forces was limited to the total cap."""
    slew_limited: Count
    """Ticks in which the change of the force was limited."""
    sensor_clipped: Count
    """Ticks with an accelerometer channel at its limit."""
    peak_command_n: Magnitude
    """Largest norm of a commanded force (N)."""
    late_ticks: Count | None = None
    """Ticks that ended after the next one was due."""
    latest_s: Seconds | None = None
    """Longest time from when a tick was due to the end of its work (s). This field and `late_ticks` are null in logs of
    older versions."""


@dataclass(frozen=True, config=FACT_CONFIG)
class AnswerGiven:
    """The participant's answer, logged before the program acts on it. Run, trial and attempt are indices from 0; the
    answer is the number of a direction or interval; the response time counts from the start of the stimulus (s).
    `monotonic_s`: see `sitting_events`."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    answer: Literal[1, 2]
    response_time_s: Seconds
    monotonic_s: Seconds | None = None
    health: AnswerHealth | None = None
    """Counters at the answer; null in logs of older versions."""
    event: Literal["answer_given"] = "answer_given"
