"""Judge from the device's counters whether an answered trial counts.

A trial is void if the participant did not feel the stimulus as planned (a fault of the device, or missed or late ticks
of its 1 kHz loop), or if a measurement that the protocol requires is missing. A void trial is repeated; its answer
stays in the log but is not used. The limits are those of the protocol (`MeasurementSettings`).
"""

from dataclasses import dataclass

from protocols.definition.measurement import MeasurementSettings
from protocols.trial import VoidCause
from study.devices.device import Fault, Health
from study.session.facts.void_reasons import ACCELERATION_MISSING, TICK_HELD, TICKS_LATE, TICKS_MISSED


@dataclass(frozen=True, slots=True)
class Judgement:
    """Verdict on an answered trial: whether it counts, and remarks on it."""

    void_reason: str
    """Why the trial is void; empty if it counts."""
    flags: tuple[str, ...]
    """Remarks on a trial that counts, in words."""
    cause: VoidCause = VoidCause.FAULT
    """Cause of a void trial; without meaning for a trial that counts."""
    measured: bool = True
    """Whether enough of the acceleration was received to measure the stimulus."""


def judge(
    health: Health, settings: MeasurementSettings, felt_whole: bool, at_answer: Health | None = None
) -> Judgement:
    """Judge an answered trial. health: counters until the release; at_answer: counters at the answer, None if both are
    equal. felt_whole: whether the stimulus was complete until the answer; a later fault is then only a remark.

    Late ticks are judged until the answer, because later ones were not felt before it. Missed ticks are judged until
    the release, because they also falsify the recorded spectrum.
    """
    if health.fault is not Fault.NONE and not felt_whole:
        return Judgement(health.fault.value, (), cause_of(health.fault))
    if health.missed_ticks > settings.missed_ticks_limit * max(health.ticks, 1):
        share = 100 * health.missed_ticks / max(health.ticks, 1)
        return Judgement(f"{share:.1f} % {TICKS_MISSED}", (), VoidCause.MISSED_TICKS)
    if late := _too_late(at_answer or health, settings):
        return Judgement(late, (), VoidCause.MISSED_TICKS)
    missing = _acceleration_missing(health, settings)
    if missing and settings.accelerometer_needed:
        return Judgement(missing, (), VoidCause.NO_ACCELERATION)
    observed = (
        (health.fault is not Fault.NONE, f"after the answer: {health.fault.value}"),
        (health.stimulus_clipped > 0, "stimulus clipped at its cap"),
        (health.feedback_clipped > 0, "leaned on the spring: its pull held at the feedback's cap"),
        (health.total_clipped > 0, "leaned on the spring: stimulus reduced at the total cap"),
        (health.slew_limited > 0, "slew limited"),
        (health.sensor_clipped > 0, "accelerometer clipped"),
        (bool(missing), f"no trustworthy acceleration: {missing}"),
    )
    return Judgement("", tuple(text for is_so, text in observed if is_so), measured=not missing)


def _too_late(health: Health, settings: MeasurementSettings) -> str:
    """Which limit for late ticks was exceeded, in words; empty if none was."""
    share = (health.missed_ticks + health.late_ticks) / max(health.ticks, 1)
    if share > settings.late_ticks_limit:
        return f"{100 * share:.1f} % {TICKS_LATE}"
    latest_ms = 1000 * health.latest_s
    return f"{latest_ms:.1f} ms {TICK_HELD}" if latest_ms > settings.longest_late_ms else ""


def _acceleration_missing(health: Health, settings: MeasurementSettings) -> str:
    """Missing share of the acceleration, in words; empty within the protocol's limit, or where the device has no
    accelerometer that sends packets."""
    if health.sensor is None or health.sensor.missing <= settings.lost_packets_limit:
        return ""
    return f"{100 * health.sensor.missing:.1f} % {ACCELERATION_MISSING}"


def cause_of(fault: Fault) -> VoidCause:
    """Cause of a trial that is void because of this fault: a stalled program counts as a late screen."""
    return VoidCause.SCREEN_LATE if fault is Fault.STALLED else VoidCause.FAULT
