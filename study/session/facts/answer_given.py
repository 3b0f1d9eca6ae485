"""The event of an answer, with the device's counters at that moment.

If the program is killed before the measurement of the trial is logged, the trial is judged by these counters.
"""

from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from study.session.facts.fact_types import Count, Index, Magnitude, Seconds, UtcTime
from study.session.facts.sitting_events import FACT


@dataclass(frozen=True, config=FACT)
class AnswerHealth:
    """Device counters in ticks since the stimulus began, as in `study.devices.device.Health`."""

    fault: Annotated[str, Field(pattern="^[A-Z_]{1,40}$")]
    """Name of the device's fault; NONE where there was none."""
    felt_whole: bool
    """Whether the stimulus was complete until the answer: no fault had stopped it."""
    ticks: Count
    missed_ticks: Count
    stimulus_clipped: Count
    total_clipped: Count
    slew_limited: Count
    sensor_clipped: Count
    peak_command_n: Magnitude
    late_ticks: Count | None = None
    latest_s: Seconds | None = None
    """Both are null in logs of older versions."""


@dataclass(frozen=True, config=FACT)
class AnswerGiven:
    """The participant's answer, written before the program acts on it."""

    utc: UtcTime
    run: Index
    trial: Index
    attempt: Index
    answer: Literal[1, 2]
    response_time_s: Seconds
    monotonic_s: Seconds | None = None
    health: AnswerHealth | None = None
    """Null in logs of older versions."""
    event: Literal["answer_given"] = "answer_given"
