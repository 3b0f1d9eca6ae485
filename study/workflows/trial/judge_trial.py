"""Judge from the device's counters whether an answered trial counts.

A trial is void if the participant did not feel the stimulus as planned (a fault of the device, or too many missed or
late ticks of its control loop), or if a measurement that the protocol requires is missing. A void trial is repeated;
its answer stays in the log but is not used. The limits are those of the protocol (`MeasurementSettings`).
"""

from dataclasses import dataclass

from protocols.definition.measurement import MeasurementSettings
from protocols.trial import VoidCause
from study.devices.device import Fault, Health
from study.session.facts.void_reasons import ACCELERATION_MISSING, LATEST_TICK_LATE, TICKS_LATE, TICKS_MISSED


@dataclass(frozen=True, slots=True)
class Judgement:
    """Verdict on an answered trial: whether it counts, and remarks on it."""

    void_reason: str
    """Why the trial is void; empty if it counts."""
    flags: tuple[str, ...]
    """Remarks on a trial that counts, as clauses; empty for a void trial."""
    cause: VoidCause = VoidCause.FAULT
    """Cause of a void trial; meaningless for a trial that counts."""
    is_measurable: bool = True
    """Whether enough of the acceleration was received to measure the stimulus, of a trial that counts; meaningless for
    a void trial."""


def judge_trial(
    health: Health, settings: MeasurementSettings, felt_whole: bool, health_at_answer: Health | None = None
) -> Judgement:
    """Judge an answered trial. health: counters until the release, or until the answer where later ones are not known;
    health_at_answer: counters at the answer, None if they equal `health`. felt_whole: whether the stimulus was complete
    until the answer, as in the log; a later fault is then only a remark.

    Late ticks are judged until the answer, because later ones were not felt before it. Missed ticks are judged until
    the release, because they also falsify the recorded spectrum.
    """
    if health.fault is not Fault.NONE and not felt_whole:
        return Judgement(health.fault.value, (), get_void_cause(health.fault))
    if health.missed_ticks > settings.missed_ticks_limit * max(health.ticks, 1):
        missed_percent = 100 * health.missed_ticks / max(health.ticks, 1)
        return Judgement(f"{missed_percent:.1f} % {TICKS_MISSED}", (), VoidCause.MISSED_TICKS)
    if late_text := _describe_lateness(health_at_answer or health, settings):
        return Judgement(late_text, (), VoidCause.MISSED_TICKS)
    missing_text = _describe_missing_acceleration(health, settings)
    if missing_text and settings.accelerometer_needed:
        return Judgement(missing_text, (), VoidCause.NO_ACCELERATION)
    remarks = (
        (health.fault is not Fault.NONE, f"after the answer: {health.fault.value}"),
        (health.stimulus_clipped > 0, "stimulus clipped at its cap"),
        (health.feedback_clipped > 0, "leaned on the spring: its pull held at the feedback's cap"),
        (health.total_clipped > 0, "leaned on the spring: stimulus reduced at the total cap"),
        (health.slew_limited > 0, "slew limited"),
        (health.sensor_clipped > 0, "accelerometer clipped"),
        (bool(missing_text), f"no trustworthy acceleration: {missing_text}"),
    )
    return Judgement("", tuple(remark for is_true, remark in remarks if is_true), is_measurable=not missing_text)


def _describe_lateness(health: Health, settings: MeasurementSettings) -> str:
    """Describe the limit for late ticks that was exceeded: the share of late and missed ticks (%), or the delay of the
    latest tick (ms); empty if none was."""
    late_share = (health.missed_ticks + health.late_ticks) / max(health.ticks, 1)
    if late_share > settings.late_ticks_limit:
        return f"{100 * late_share:.1f} % {TICKS_LATE}"
    latest_ms = 1000 * health.latest_s
    return f"{latest_ms:.1f} ms {LATEST_TICK_LATE}" if latest_ms > settings.longest_late_ms else ""


def _describe_missing_acceleration(health: Health, settings: MeasurementSettings) -> str:
    """Describe the missing share (%) of the acceleration; empty within the protocol's limit, or where the device has no
    accelerometer that sends packets."""
    if health.sensor is None or health.sensor.missing <= settings.lost_packets_limit:
        return ""
    return f"{100 * health.sensor.missing:.1f} % {ACCELERATION_MISSING}"


def get_void_cause(fault: Fault) -> VoidCause:
    """Get the cause of a trial that is void because of this fault: a stalled program counts as a late screen."""
    return VoidCause.SCREEN_LATE if fault is Fault.STALLED else VoidCause.FAULT
