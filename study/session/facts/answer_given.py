"""An answer, with what is known of the device when it comes: a trial whose program dies before its measurement is
judged by what happened until then."""

from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from study.session.facts.fact_types import Count, Index, Magnitude, Seconds, UtcTime
from study.session.facts.sitting_events import FACT


@dataclass(frozen=True, config=FACT)
class AnswerHealth:
    """Counted since the stimulus began, in ticks, as `study.devices.device.Health` counts."""

    fault: Annotated[str, Field(pattern="^[A-Z_]{1,40}$")]
    """Name of the device's fault; NONE where there was none."""
    felt_whole: bool
    """No fault stopped the stimulus before the answer."""
    ticks: Count
    missed_ticks: Count
    stimulus_clipped: Count
    total_clipped: Count
    slew_limited: Count
    sensor_clipped: Count
    peak_command_n: Magnitude
    late_ticks: Count | None = None
    latest_s: Seconds | None = None
    """Null, both, in logs of older versions."""


@dataclass(frozen=True, config=FACT)
class AnswerGiven:
    """Written before anything reacts to it."""

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
