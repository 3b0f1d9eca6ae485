"""Measure how well this computer keeps 1 kHz: hold a stimulus of zero force in real time and count late ticks."""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from queue import SimpleQueue

import numpy as np

from equalizer.signals.signal import Signal
from study.devices.clock import Clock
from study.devices.device import Device, Fault, Health
from study.devices.opening import before_others, loop_priority
from study.session.stimulus.held_stimulus import HeldStimulus
from study.session.stimulus.timing_verdict import (
    Lateness,
    judge_late,
    judge_lateness,
    judge_load,
    judge_missed,
    lateness_of,
)
from study.session.views.views import DeviceFinding
from study.workflows.checks.bare_loop import BareLoop

LOOP_S = 0.1
FADE_S = 0.05
SIGN_OF_LIFE_EVERY = 50

SITTING_S = 1.0
"""Duration of the check before a sitting: a thousand wake-ups at 1 kHz, of which the 99th percentile is the tenth
latest."""


@dataclass(frozen=True, slots=True)
class Timing:
    seconds: float
    health: Health
    """Lateness of the device's own loop."""
    lateness: Lateness
    findings: tuple[DeviceFinding, ...]
    bare: BareLoop | None = None
    """A bare C loop at the same time; None where none was compared with."""


def check_timing(
    device: Device,
    clock: Clock,
    seconds: float,
    on_progress: Callable[[float], None],
    load_per_processor: float | None = None,
) -> Timing:
    """Hold zero force for this long, which the device's settings must allow. `on_progress(seconds)` now and then.
    load_per_processor: measured before; None if unknown.

    The force is zero only if the device was opened without a centring spring. Raises DeviceError for a lost device.
    """
    rate_hz = device.info.sample_rate_hz
    zeros = Signal(np.zeros((round(LOOP_S * rate_hz), 3)), rate_hz, "force", "N", ("fx", "fy", "fz"))
    device.hold(HeldStimulus(zeros, FADE_S, FADE_S, "linear"))
    try:
        late_s = _wake_as_its_loop(device, clock, seconds, partial(_attend, device, on_progress))
    finally:
        health = device.release().health
    lateness = lateness_of(np.array(late_s), rate_hz)
    late = judge_late(health.late_ticks + health.missed_ticks, 1000 * health.latest_s, health.ticks, load_per_processor)
    return Timing(seconds, health, lateness, _findings(device, seconds, health, lateness, late))


def check_computer(
    clock: Clock, rate_hz: float, simulated: bool, load_per_processor: float | None
) -> tuple[DeviceFinding, ...]:
    """Findings before a sitting: takes `SITTING_S`, commands nothing. load_per_processor: None if unknown."""
    late_s = wake_at_every_tick(clock, rate_hz, SITTING_S, lambda done_s: True)
    lateness = judge_lateness(lateness_of(np.array(late_s), rate_hz), simulated)
    return (lateness, judge_load(load_per_processor), *(() if simulated else (loop_priority(),)))


def wake_at_every_tick(clock: Clock, rate_hz: float, seconds: float, go_on: Callable[[float], bool]) -> list[float]:
    """How late each wake-up was (s). `go_on(done_s)` is called now and then; stops early if it returns False."""
    late_s: list[float] = []
    tick_s = 1.0 / rate_hz
    started_s = clock.now_s()
    while len(late_s) * tick_s < seconds:
        due_s = started_s + (len(late_s) + 1) * tick_s
        clock.sleep(due_s - clock.now_s())
        late_s.append(max(0.0, clock.now_s() - due_s))
        if len(late_s) % SIGN_OF_LIFE_EVERY == 0 and not go_on(len(late_s) * tick_s):
            break
    return late_s


def _wake_as_its_loop(device: Device, clock: Clock, seconds: float, go_on: Callable[[float], bool]) -> list[float]:
    """In a thread of real-time priority if the device's loop has one. `go_on` is called in this one: what it asks the
    device takes longer than a tick on a busy computer, and is no lateness."""
    rate_hz = device.info.sample_rate_hz
    if device.info.simulated or clock.virtual:
        return wake_at_every_tick(clock, rate_hz, seconds, go_on)
    left, due = threading.Event(), SimpleQueue[float | None]()

    def tell(done_s: float) -> bool:
        due.put(done_s)
        return not left.is_set()

    def wake() -> list[float]:
        try:
            with before_others():
                return wake_at_every_tick(clock, rate_hz, seconds, tell)
        finally:
            due.put(None)

    with ThreadPoolExecutor(1, "timing") as pool:
        woken = pool.submit(wake)
        try:
            while (done_s := due.get()) is not None and go_on(done_s):
                pass
        finally:
            left.set()
        return woken.result()


def _attend(device: Device, on_progress: Callable[[float], None], done_s: float) -> bool:
    device.keep_alive()
    on_progress(done_s)
    return device.fault() is Fault.NONE


def _findings(
    device: Device, seconds: float, health: Health, lateness: Lateness, late: DeviceFinding
) -> tuple[DeviceFinding, ...]:
    simulated = device.info.simulated
    return (
        _loop(seconds, health),
        judge_missed(health.missed_ticks, health.ticks, simulated),
        *(() if simulated else (late,)),
        judge_lateness(lateness, simulated),
        DeviceFinding("Force", f"{health.peak_command_n:g} N commanded", fine=health.peak_command_n == 0.0),
    )


def _loop(seconds: float, health: Health) -> DeviceFinding:
    if health.fault is not Fault.NONE:
        advice = "Check the device's power and cable and what else runs on this computer, then measure again."
        return DeviceFinding("Loop", f"it let go: {health.fault.value}", fine=False, advice=advice)
    return DeviceFinding("Loop", f"{health.ticks} ticks in {seconds:g} s, zero force held to the end", fine=True)
