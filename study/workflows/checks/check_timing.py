"""Measure how well this computer keeps the rate of a device's loop (1 kHz): hold a stimulus of zero force in real time.

Two measures: the ticks that the loop itself counts as late or missed, and the lateness of its readings or, without
telemetry and for a simulated device, of this program's wake-ups. `study.session.stimulus.timing_verdict` holds the
limits. `check_computer` is a shorter check before a sitting.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from equalizer.signals.signal import FloatArray, Signal
from study.devices.clock import Clock
from study.devices.device import Device, Fault, Health
from study.devices.opening import check_loop_priority, open_telemetry
from study.session.stimulus.held_stimulus import HeldStimulus
from study.session.stimulus.timing_verdict import (
    Lateness,
    judge_late_ticks,
    judge_lateness,
    judge_load,
    judge_missed_ticks,
    summarize_lateness,
)
from study.session.views.participant_views import DeviceFinding

ZERO_FORCE_PERIOD_S = 0.1
"""Length of the period of zero forces that is repeated (s). Any length serves."""
FADE_S = 0.05
"""Duration of fade-in and fade-out of the held stimulus (s); without effect on zero force."""
KEEP_ALIVE_TICKS = 50
"""Number of ticks between two keep-alive calls, which reset the device's watchdog: 50 ms at 1 kHz. Chosen well below
the watchdog times of the shipped protocols."""

COMPUTER_CHECK_S = 1.0
"""Duration of the check before a sitting (s). At 1 kHz it has a thousand wake-ups, enough for a 99th percentile: about
ten are later."""


@dataclass(frozen=True, slots=True)
class Timing:
    """Result of `check_timing`."""

    seconds: float
    """Requested duration of the measurement (s)."""
    health: Health
    """Counts of the device's own loop: ticks, late and missed ticks, fault."""
    lateness: Lateness
    """Lateness of the readings or wake-ups, see `check_timing`."""
    findings: tuple[DeviceFinding, ...]
    """Judgements of loop, missed ticks, late ticks (of a real device), lateness and force."""


def check_timing(
    device: Device,
    clock: Clock,
    duration_s: float,
    on_progress: Callable[[float], None],
    load_per_processor: float | None = None,
) -> Timing:
    """Hold zero force for duration_s (s, above 0), and judge the timing. The device's limit of a hold
    (`Limits.longest_hold_s`) must not be shorter.

    on_progress: called with the seconds done. load_per_processor: measured before; None if unknown. The force is zero
    only if the device was opened without a centring spring. Raises DeviceError for a lost device.
    """
    rate_hz = device.info.sample_rate_hz
    zero_forces = Signal(np.zeros((round(ZERO_FORCE_PERIOD_S * rate_hz), 3)), rate_hz, "force", "N", ("fx", "fy", "fz"))
    device.hold(HeldStimulus(zero_forces, FADE_S, FADE_S, "linear"))
    try:
        lateness_s = _measure_loop_lateness_s(
            device, clock, duration_s, partial(_keep_device_alive, device, on_progress)
        )
    finally:
        health = device.release().health
    lateness = summarize_lateness(lateness_s, rate_hz)
    return Timing(duration_s, health, lateness, _judge_timing(device, duration_s, health, lateness, load_per_processor))


def check_computer(
    clock: Clock, rate_hz: float, simulated: bool, load_per_processor: float | None
) -> tuple[DeviceFinding, ...]:
    """Check the computer before a sitting: wake-ups at rate_hz, load, and for a real device the priority of the loop.
    Takes `COMPUTER_CHECK_S`; no device is commanded. load_per_processor: None if unknown."""
    lateness_s = measure_wake_lateness_s(clock, rate_hz, COMPUTER_CHECK_S, lambda done_s: True)
    lateness_finding = judge_lateness(summarize_lateness(np.array(lateness_s), rate_hz), simulated)
    return (lateness_finding, judge_load(load_per_processor), *(() if simulated else (check_loop_priority(),)))


def measure_wake_lateness_s(
    clock: Clock, rate_hz: float, duration_s: float, should_continue: Callable[[float], bool]
) -> list[float]:
    """Sleep until each tick (1 / rate_hz) for duration_s. Returns the lateness of each wake-up (s), not negative.
    `should_continue(done_s)` is called every `KEEP_ALIVE_TICKS` wake-ups; the measurement stops if it returns False."""
    lateness_s: list[float] = []
    tick_s = 1.0 / rate_hz
    started_s = clock.now_s()
    while len(lateness_s) * tick_s < duration_s:
        due_s = started_s + (len(lateness_s) + 1) * tick_s
        clock.sleep(due_s - clock.now_s())
        lateness_s.append(max(0.0, clock.now_s() - due_s))
        if len(lateness_s) % KEEP_ALIVE_TICKS == 0 and not should_continue(len(lateness_s) * tick_s):
            break
    return lateness_s


def _measure_loop_lateness_s(
    device: Device, clock: Clock, duration_s: float, should_continue: Callable[[float], bool]
) -> FloatArray:
    """Measure the lateness (s), (n,), of the readings of a real device's loop, from the time stamps of its telemetry (a
    single value, duration_s, where it has no tick); without telemetry, and for a simulated device, of this program's
    wake-ups.

    The lateness of tick k is its time stamp minus k / rate, relative to the smallest such difference. After missed
    ticks it is counted from the time at which the first of them was due.
    """
    rate_hz = device.info.sample_rate_hz
    if device.info.simulated or not device.telemetry:
        return np.array(measure_wake_lateness_s(clock, rate_hz, duration_s, should_continue))
    reader, raw_lateness_blocks_s, missed_count_blocks = open_telemetry(device.telemetry), [], []
    started_s = clock.now_s()
    while should_continue(done_s := clock.now_s() - started_s) and done_s < duration_s:
        clock.sleep(KEEP_ALIVE_TICKS / rate_hz)
        ticks = reader.read()
        raw_lateness_blocks_s.append(ticks.time_s - ticks.tick / rate_hz)
        missed_count_blocks.append(ticks.missed)
    raw_lateness_s = np.concatenate(raw_lateness_blocks_s or [np.zeros(0)])
    if not len(raw_lateness_s):
        return np.array([duration_s])  # late by the whole time
    cumulative_missed: FloatArray = np.concatenate(missed_count_blocks)
    lateness_s: FloatArray = (
        raw_lateness_s - raw_lateness_s.min() + np.diff(cumulative_missed, prepend=cumulative_missed[:1]) / rate_hz
    )
    return lateness_s


def _keep_device_alive(device: Device, on_progress: Callable[[float], None], done_s: float) -> bool:
    """Reset the device's watchdog and report the progress. Returns False after a fault of the device, which ends the
    measurement."""
    device.keep_alive()
    on_progress(done_s)
    return device.fault() is Fault.NONE


def _judge_timing(
    device: Device, duration_s: float, health: Health, lateness: Lateness, load_per_processor: float | None
) -> tuple[DeviceFinding, ...]:
    """Make the findings of `Timing.findings`."""
    simulated, late_ticks = device.info.simulated, health.late_ticks + health.missed_ticks
    late_finding = judge_late_ticks(late_ticks, 1000 * health.latest_s, health.ticks, load_per_processor)
    return (
        _judge_loop(duration_s, health),
        judge_missed_ticks(health.missed_ticks, health.ticks, simulated, load_per_processor),
        *(() if simulated else (late_finding,)),
        judge_lateness(lateness, simulated),
        DeviceFinding("Force", f"{health.peak_command_n:g} N commanded", fine=health.peak_command_n == 0.0),
    )


def _judge_loop(duration_s: float, health: Health) -> DeviceFinding:
    """Judge whether the loop held the zero force to the end, without a fault of the device."""
    if health.fault is not Fault.NONE:
        advice = "Check the device's power and cable and what else runs on this computer, then measure again."
        cause = f": {health.why}" if health.why else ""
        return DeviceFinding("Loop", f"it let go: {health.fault.value}{cause}", fine=False, advice=advice)
    return DeviceFinding("Loop", f"{health.ticks} ticks in {duration_s:g} s, zero force held to the end", fine=True)
