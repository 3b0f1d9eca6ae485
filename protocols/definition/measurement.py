"""Recording of a trial: what is kept, and the conditions under which its measurement is valid."""

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from protocols.definition.staircase_rule import STRICT


@dataclass(frozen=True, config=STRICT)
class MeasurementSettings:
    """What is kept of every trial, and when a trial is void because of the device."""

    keep_s: Annotated[
        float,
        Field(
            gt=0,
            le=60,
            description="The last whole periods of the steady part, this long at the most, are kept as a recording. "
            "Default 1: five periods at 5 Hz.",
        ),
    ] = 1.0
    missed_ticks_limit: Annotated[
        float,
        Field(
            ge=0,
            le=1,
            description="A trial with a larger share of missed 1 kHz ticks is void and is presented again. Default "
            "0.02: fewer cannot be felt.",
        ),
    ] = 0.02
    late_ticks_limit: Annotated[
        float,
        Field(
            ge=0,
            le=1,
            description="A trial in which, until the answer, a larger share of ticks was late (their work ended "
            "after the next was due) or missed is void and is presented again: 0.02, say. Default 1: no limit. "
            "Devices that wait for the computer are never late.",
        ),
    ] = 1.0
    longest_late_ms: Annotated[
        float,
        Field(
            gt=0,
            le=1000,
            description="A trial is void and is presented again where, until the answer, a tick's work ended later "
            "than this after it was due, so that the device held its last force: 10, say, a quarter of a period "
            "at 25 Hz. Default 1000: no limit, for a loop that makes no step for 100 ms is lost.",
        ),
    ] = 1000.0
    lost_packets_limit: Annotated[
        float,
        Field(
            ge=0,
            le=1,
            description="A trial that lacks a larger share of the accelerometer's packets, or of the recorded "
            "ticks, has no trustworthy acceleration, and no delivered amplitude is reported for it. Default "
            "0.05: gaps of this size change an amplitude by less than a percent.",
        ),
    ] = 0.05
    accelerometer_needed: Annotated[
        bool,
        Field(
            description="Whether a trial without a trustworthy acceleration is void and is presented again, and no "
            "session begins on a device without an accelerometer. Default: no, its answer counts."
        ),
    ] = False
