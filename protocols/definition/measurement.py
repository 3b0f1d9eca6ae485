"""Settings of the recording of a trial: what is kept, and the conditions under which the trial is valid.

Table `measurement` of a `StudyProtocol`; `study.workflows.trial.judge_trial` applies the conditions.
"""

from pydantic import Field
from pydantic.dataclasses import dataclass

from protocols.definition.staircase_rule import STRICT


@dataclass(frozen=True, config=STRICT)
class MeasurementSettings:
    """Settings of the recording of every trial (table `measurement` of a protocol), and the conditions under which a
    trial is void because of the device."""

    keep_s: float = Field(
        default=1.0,
        gt=0,
        le=60,
        description="Length of the recording that is kept of each trial: the last whole periods of the steady "
        "part, at most this long. Default 1: five periods at 5 Hz.",
    )
    missed_ticks_limit: float = Field(
        default=0.02,
        ge=0,
        le=1,
        description="Largest share of missed 1 kHz ticks; above it a trial is void and is presented again. "
        "Default 0.02: smaller shares cannot be felt.",
    )
    late_ticks_limit: float = Field(
        default=1.0,
        ge=0,
        le=1,
        description="Largest share of late or missed ticks until the answer, such as 0.02; above it a trial is "
        "void and is presented again. A tick is late if its work ended after the next tick was due. Default 1: "
        "no limit. Devices that wait for the computer are never late.",
    )
    longest_late_ms: float = Field(
        default=1000.0,
        gt=0,
        le=1000,
        description="Largest lateness of a tick until the answer, such as 10, a quarter of a period at 25 Hz. If "
        "a tick's work ended later than this after it was due, the device held its last force meanwhile; the "
        "trial is void and is presented again. Default 1000: no limit, because a loop without a step for 100 ms "
        "counts as lost.",
    )
    lost_packets_limit: float = Field(
        default=0.05,
        ge=0,
        le=1,
        description="Largest share of missing packets of the accelerometer, or of missing recorded ticks. Above "
        "it a trial has no trustworthy acceleration, and no delivered amplitude is reported for it. Default "
        "0.05: gaps of this size change an amplitude by less than 1 %.",
    )
    accelerometer_needed: bool = Field(
        default=False,
        description="Whether a trial without a trustworthy acceleration is void and is presented again, and "
        "whether no session begins on a device without an accelerometer. Default: no, such an answer counts.",
    )
