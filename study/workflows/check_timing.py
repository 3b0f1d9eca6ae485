"""How well this computer keeps 1 kHz: a stimulus of zero force is held in real time, and what came late is counted."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import Signal
from study.devices.clock import Clock
from study.devices.device import Device, Fault, Health
from study.session.held_stimulus import HeldStimulus
from study.session.views import DeviceFinding

MISSED_SHARE = 0.001
"""Missed ticks that are still fine: a twentieth of what makes a trial void by default."""

LATE_MS = 1.0
"""Whoever is later than this has missed the next tick."""

LOOP_S = 0.1
FADE_S = 0.05
SIGN_OF_LIFE_EVERY = 50

MS_PER_S = 1000.0


@dataclass(frozen=True, slots=True)
class Lateness:
    """Of this program, which wanted to wake up at every tick of the device's rate."""

    median_ms: float
    p99_ms: float
    longest_ms: float
    missing_a_tick: float
    """Share of the wake-ups that were later than a tick."""


@dataclass(frozen=True, slots=True)
class Timing:
    seconds: float
    health: Health
    """Of the device's own loop."""
    lateness: Lateness
    findings: tuple[DeviceFinding, ...]


def check_timing(device: Device, clock: Clock, seconds: float, on_progress: Callable[[float], None]) -> Timing:
    """Hold zero force for so long, which the device's settings must allow. `on_progress(seconds)` now and then.

    Only zero force where the device was opened without a centring spring. Raises DeviceError for a lost device.
    """
    rate_hz = device.info.sample_rate_hz
    zeros = Signal(np.zeros((round(LOOP_S * rate_hz), 3)), rate_hz, "force", "N", ("fx", "fy", "fz"))
    device.hold(HeldStimulus(zeros, FADE_S, FADE_S, "linear"))
    try:
        late_s = _wake_at_every_tick(device, clock, seconds, on_progress)
    finally:
        health = device.release().health
    late_ms = MS_PER_S * np.array(late_s)
    lateness = Lateness(
        median_ms=float(np.median(late_ms)),
        p99_ms=float(np.percentile(late_ms, 99)),
        longest_ms=float(late_ms.max()),
        missing_a_tick=float(np.mean(late_ms > MS_PER_S / rate_hz)),
    )
    return Timing(seconds, health, lateness, _findings(device, seconds, health, lateness))


def _wake_at_every_tick(
    device: Device, clock: Clock, seconds: float, on_progress: Callable[[float], None]
) -> list[float]:
    """How late each wake-up was, s. Ends early where the device lets go."""
    late_s: list[float] = []
    tick_s = 1.0 / device.info.sample_rate_hz
    started_s = clock.now_s()
    while len(late_s) * tick_s < seconds:
        due_s = started_s + (len(late_s) + 1) * tick_s
        clock.sleep(due_s - clock.now_s())
        late_s.append(max(0.0, clock.now_s() - due_s))
        if len(late_s) % SIGN_OF_LIFE_EVERY == 0:
            device.keep_alive()
            on_progress(len(late_s) * tick_s)
            if device.fault() is not Fault.NONE:
                break
    return late_s


def _findings(device: Device, seconds: float, health: Health, lateness: Lateness) -> tuple[DeviceFinding, ...]:
    simulated = device.info.simulated
    return (
        _loop(seconds, health),
        _missed(health, simulated),
        _lateness(lateness, simulated),
        DeviceFinding("Force", f"{health.peak_command_n:g} N commanded", fine=health.peak_command_n == 0.0),
    )


def _loop(seconds: float, health: Health) -> DeviceFinding:
    if health.fault is not Fault.NONE:
        advice = "Check the device's power and cable and what else runs on this computer, then measure again."
        return DeviceFinding("Loop", f"it let go: {health.fault.value}", fine=False, advice=advice)
    return DeviceFinding("Loop", f"{health.ticks} ticks in {seconds:g} s, zero force held to the end", fine=True)


def _missed(health: Health, simulated: bool) -> DeviceFinding:
    share = health.missed_ticks / max(health.ticks, 1)
    fine = share <= MISSED_SHARE
    value = f"{health.missed_ticks} of {health.ticks} ({share:.2%})"
    if simulated:
        value += "; a simulated device's loop catches up, so it misses none"
    return DeviceFinding("Missed ticks", value, fine, "" if fine else _CALM)


def _lateness(lateness: Lateness, simulated: bool) -> DeviceFinding:
    """A simulated device waits for its computer: then this says what a real one would meet, and is no fault."""
    value = (
        f"half of the wake-ups within {lateness.median_ms:.2f} ms, 99 % within {lateness.p99_ms:.2f} ms, "
        f"the latest {lateness.longest_ms:.1f} ms"
    )
    calm = lateness.p99_ms < LATE_MS
    if simulated and not calm:
        value += "; too late for a real device"
    fine = calm or simulated
    return DeviceFinding("Lateness", value, fine, "" if calm else _CALM)


_CALM = "Close other programs, switch power saving off, and measure again."
