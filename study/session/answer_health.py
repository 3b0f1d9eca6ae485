"""What is known of a device when an answer comes: logged with it, so that a trial whose program dies before its
measurement is judged by what happened until then."""

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from study.session.fact_types import Count, Magnitude
from study.session.sitting_events import FACT


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
