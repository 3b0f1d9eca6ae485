"""Timing requirements of a device's control loop, and the verdict on a computer whose timing was measured.

Lateness is the time from the moment at which a tick of the control loop is due to its actual wake-up. A real device
does not wait: a loop that wakes up more than one tick late has missed that tick. A simulated device waits for its
computer, so that lateness is only a warning there. Whether a single trial is void for its timing is decided by
`study.workflows.trial.judge_trial`.
"""

import math
from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from study.session.facts.void_reasons import LOAD_PER_PROCESSOR
from study.session.views.participant_views import DeviceFinding

MS_PER_S = 1000.0

MAX_P99_TICKS = 1.0
"""Limit, exclusive, of the 99th percentile of the lateness, in ticks: 1 ms at 1 kHz. A tick that is later is missed."""

MAX_LATE_FRACTION = 0.002
"""Allowed fraction of late ticks, missed ones included, on an idle computer. Chosen: a loop with real-time priority
stays below it."""

MAX_LATE_FRACTION_BUSY = 0.01
"""Allowed fraction of late ticks, missed ones included, with all cores busy. Chosen: five times that of an idle
computer."""

BUSY_LOAD = 1.0
"""Load average per processor from which all cores count as busy: one running task per processor."""

ADVICE = "Close other programs, switch power saving off, and measure again."
"""Advice for a finding that is not fine because of lateness."""


@dataclass(frozen=True, slots=True)
class Lateness:
    """Statistics of the lateness (ms) of a control loop, or of a test loop of this program that wakes up at every
    tick."""

    median_ms: float
    p99_ms: float
    longest_ms: float
    missed_fraction: float
    """Fraction of the wake-ups that were more than one tick late."""
    tick_ms: float
    """Duration of a tick."""

    @property
    def too_late(self) -> bool:
        """Whether the 99th percentile is not below `MAX_P99_TICKS` ticks. NaN counts as too late."""
        return not self.p99_ms < MAX_P99_TICKS * self.tick_ms


def summarize_lateness(late_s: FloatArray, rate_hz: float) -> Lateness:
    """Compute statistics of the lateness. late_s (n,): lateness of each wake-up (s), not negative; rate_hz: tick rate.
    Raises ValueError if empty."""
    if len(late_s) == 0:
        raise ValueError("no wake-up was measured")
    late_ms = MS_PER_S * np.asarray(late_s, dtype=float)
    tick_ms = MS_PER_S / rate_hz
    return Lateness(
        median_ms=float(np.median(late_ms)),
        p99_ms=float(np.percentile(late_ms, 99)),
        longest_ms=float(late_ms.max()),
        missed_fraction=float(np.mean(late_ms > tick_ms)),
        tick_ms=tick_ms,
    )


def judge_lateness(lateness: Lateness, simulated: bool) -> DeviceFinding:
    """Judge the lateness of the wake-ups; for a simulated device, too late is only a warning."""
    value_text = (
        f"half of the wake-ups within {lateness.median_ms:.2f} ms, 99 % within {lateness.p99_ms:.2f} ms, "
        f"the latest {lateness.longest_ms:.1f} ms"
    )
    if not lateness.too_late:
        return DeviceFinding("Lateness", value_text, fine=True)
    limit_text = f"99 % must come within {MAX_P99_TICKS * lateness.tick_ms:g} ms"
    if simulated:
        value_text += f"; too late for a real device ({limit_text}); a simulated one waits"
    else:
        value_text += f"; too late for this device ({limit_text})"
    return DeviceFinding("Lateness", value_text, fine=False, advice=ADVICE, warning=simulated)


def judge_missed_ticks(
    missed_ticks: int, ticks: int, simulated: bool, load_per_processor: float | None
) -> DeviceFinding:
    """Judge the number of missed ticks among `ticks`, by the allowed fraction of late ticks, which include them.
    load_per_processor: None if unknown, which counts as idle."""
    late_fraction, allowed_fraction = missed_ticks / max(ticks, 1), _choose_late_limit(load_per_processor)
    is_within_limit = late_fraction <= allowed_fraction
    value_text = f"{missed_ticks} of {ticks} ({late_fraction:.2%})"
    if simulated:
        value_text += "; a simulated device's loop catches up, so it misses none"
    elif not is_within_limit:
        value_text += f"; at most {allowed_fraction:.1%} are fine"
    return DeviceFinding("Missed ticks", value_text, is_within_limit, "" if is_within_limit else ADVICE)


def _is_busy(load_per_processor: float | None) -> bool:
    """Whether all cores are busy; False if the load is unknown."""
    return load_per_processor is not None and load_per_processor >= BUSY_LOAD


def _choose_late_limit(load_per_processor: float | None) -> float:
    """Choose the allowed fraction of late ticks for this load; that of an idle computer if the load is unknown
    (None)."""
    return MAX_LATE_FRACTION_BUSY if _is_busy(load_per_processor) else MAX_LATE_FRACTION


def judge_late_ticks(late_ticks: int, latest_ms: float, ticks: int, load_per_processor: float | None) -> DeviceFinding:
    """Judge the late ticks of a real device. late_ticks: of `ticks`, those whose work ended after the next tick was
    due, missed ones included; latest_ms: longest time from when a tick was due to the end of its work;
    load_per_processor: None if unknown, which counts as idle."""
    late_fraction = late_ticks / max(ticks, 1)
    is_busy, allowed_fraction = _is_busy(load_per_processor), _choose_late_limit(load_per_processor)
    is_within_limit = late_fraction <= allowed_fraction
    value_text = f"{late_ticks} of {ticks} ({late_fraction:.2%}) ended after the next was due, missed ones among them"
    value_text += f"; the latest {latest_ms:.1f} ms after its time"
    if late_fraction > MAX_LATE_FRACTION:
        normal_limit = f"{MAX_LATE_FRACTION:.1%}"
        value_text += (
            f"; at most {allowed_fraction:.1%} are fine with all cores busy ({normal_limit} else)"
            if is_busy
            else f"; at most {normal_limit} are fine"
        )
    return DeviceFinding("Late ticks", value_text, is_within_limit, "" if is_within_limit else ADVICE)


def judge_load(per_processor: float | None) -> DeviceFinding:
    """Judge the load average per processor, a fraction; None if unknown, which is fine. Above `LOAD_PER_PROCESSOR` is
    only a warning, because the measured lateness is decisive."""
    if per_processor is None:
        return DeviceFinding("Load", "this system does not report it, so it was not checked", fine=True)
    value_text = f"{per_processor:.0%} of what its processors can do, over the last minute"
    if math.isfinite(per_processor) and per_processor <= LOAD_PER_PROCESSOR:
        return DeviceFinding("Load", value_text, fine=True)
    value_text += f"; above {LOAD_PER_PROCESSOR:.0%} trials may be cut short"
    return DeviceFinding("Load", value_text, fine=False, advice="Close other programs.", warning=True)
