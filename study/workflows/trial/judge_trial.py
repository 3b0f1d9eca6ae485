"""Judge from the device's counters whether an answered trial counts.

A trial is void where the participant did not feel the stimulus as planned (a fault, or ticks of the 1 kHz loop that
were missed or late), or where a measurement that the protocol requires is missing. It then comes again; the answer is
kept in the log, and counts for nothing.
"""

from dataclasses import dataclass

from protocols.definition.measurement import MeasurementSettings
from protocols.trial import VoidCause
from study.devices.device import Fault, Health
from study.session.facts.void_reasons import ACCELERATION_MISSING, TICK_HELD, TICKS_LATE, TICKS_MISSED


@dataclass(frozen=True, slots=True)
class Judgement:
    """Verdict on an answered trial: whether it counts, and remarks on it."""

    spoiled: str
    """Why the trial is void; empty if it counts."""
    flags: tuple[str, ...]
    """Remarks on a trial that counts."""
    cause: VoidCause = VoidCause.FAULT
    """Cause of a void trial."""
    measured: bool = True
    """Whether the acceleration can be trusted, where there is any."""


def judge(
    health: Health, settings: MeasurementSettings, felt_whole: bool, at_answer: Health | None = None
) -> Judgement:
    """Judge the trial. health: counters until the release; at_answer: those at the answer, None where both are the
    same. felt_whole: whether the stimulus was complete until the answer; later faults are then only flagged.

    Late ticks are counted until the answer, because later ones change nothing that was felt; missed ticks, which also
    make the recorded spectrum wrong, until the release.
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
    """Which limit for late ticks was passed; empty if none was."""
    share = (health.missed_ticks + health.late_ticks) / max(health.ticks, 1)
    if share > settings.late_ticks_limit:
        return f"{100 * share:.1f} % {TICKS_LATE}"
    latest_ms = 1000 * health.latest_s
    return f"{latest_ms:.1f} ms {TICK_HELD}" if latest_ms > settings.longest_late_ms else ""


def _acceleration_missing(health: Health, settings: MeasurementSettings) -> str:
    """How much of the acceleration is missing, in words; empty where that is within the protocol's limit, or there is
    no accelerometer."""
    if health.sensor is None or health.sensor.missing <= settings.lost_packets_limit:
        return ""
    return f"{100 * health.sensor.missing:.1f} % {ACCELERATION_MISSING}"


def cause_of(fault: Fault) -> VoidCause:
    """Cause of a trial that this fault made void."""
    return VoidCause.SCREEN_LATE if fault is Fault.STALLED else VoidCause.FAULT
