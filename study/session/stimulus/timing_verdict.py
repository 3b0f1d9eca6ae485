"""Timing requirements of a device, and the verdict on a computer whose timing was measured (`hapteq doctor`, device
check). Whether a single trial is void for its timing is decided by `study.workflows.trial.judge_trial`.

Lateness is the time from the moment at which a tick of the control loop is due to its actual wake-up. A real device
does not wait: a loop that wakes up more than one tick late has missed that tick. A simulated device waits for its
computer, so that lateness is only a warning there.
"""

import math
from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from study.session.facts.void_reasons import LOAD_PER_PROCESSOR
from study.session.views.views import DeviceFinding

MS_PER_S = 1000.0

LATE_TICKS = 1.0
"""Limit of the 99th percentile of the lateness, in ticks: 1 ms at 1 kHz."""

LATE_SHARE = 0.002
"""Allowed fraction of late ticks, missed ones included, on an idle computer: a loop with real-time priority stays
below it."""

BUSY_LATE_SHARE = 0.01
"""Allowed fraction of late ticks, missed ones included, with all cores busy."""

ALL_BUSY = 1.0
"""Load average per processor from which all cores are taken as busy."""

ADVICE = "Close other programs, switch power saving off, and measure again."
"""Advice that is shown where the timing is too late."""


@dataclass(frozen=True, slots=True)
class Lateness:
    """Statistics of the lateness (ms) of a real device's own loop, or of this program when it wakes up at every
    tick."""

    median_ms: float
    p99_ms: float
    longest_ms: float
    missing_a_tick: float
    """Fraction of the wake-ups that were more than one tick late."""
    tick_ms: float
    """Duration of a tick."""

    @property
    def too_late(self) -> bool:
        """Whether a real device's loop is too late. NaN counts as too late."""
        return not self.p99_ms < LATE_TICKS * self.tick_ms


def measure_lateness(late_s: FloatArray, rate_hz: float) -> Lateness:
    """Lateness statistics. late_s (n,): how late each wake-up was (s), not negative. Raises ValueError if empty."""
    if len(late_s) == 0:
        raise ValueError("no wake-up was measured")
    late_ms = MS_PER_S * np.asarray(late_s, dtype=float)
    tick_ms = MS_PER_S / rate_hz
    return Lateness(
        median_ms=float(np.median(late_ms)),
        p99_ms=float(np.percentile(late_ms, 99)),
        longest_ms=float(late_ms.max()),
        missing_a_tick=float(np.mean(late_ms > tick_ms)),
        tick_ms=tick_ms,
    )


def judge_lateness(lateness: Lateness, simulated: bool) -> DeviceFinding:
    """Verdict on the wake-ups. Too late is only a warning for a simulated device."""
    value = (
        f"half of the wake-ups within {lateness.median_ms:.2f} ms, 99 % within {lateness.p99_ms:.2f} ms, "
        f"the latest {lateness.longest_ms:.1f} ms"
    )
    if not lateness.too_late:
        return DeviceFinding("Lateness", value, fine=True)
    limit = f"99 % must come within {LATE_TICKS * lateness.tick_ms:g} ms"
    if simulated:
        value += f"; too late for a real device ({limit}); a simulated one waits"
    else:
        value += f"; too late for this device ({limit})"
    return DeviceFinding("Lateness", value, fine=False, advice=ADVICE, warning=simulated)


def judge_missed(missed_ticks: int, ticks: int, simulated: bool, load_per_processor: float | None) -> DeviceFinding:
    """Verdict on missed ticks, by the limit of late ticks: missed ticks have no limit of their own. load_per_processor:
    None if unknown."""
    share, limit = missed_ticks / max(ticks, 1), _late_limit(load_per_processor)
    fine = share <= limit
    value = f"{missed_ticks} of {ticks} ({share:.2%})"
    if simulated:
        value += "; a simulated device's loop catches up, so it misses none"
    elif not fine:
        value += f"; at most {limit:.1%} are fine"
    return DeviceFinding("Missed ticks", value, fine, "" if fine else ADVICE)


def _is_busy(load_per_processor: float | None) -> bool:
    return load_per_processor is not None and load_per_processor >= ALL_BUSY


def _late_limit(load_per_processor: float | None) -> float:
    """Allowed fraction of late ticks at this load; None: that of an idle computer."""
    return BUSY_LATE_SHARE if _is_busy(load_per_processor) else LATE_SHARE


def judge_late(late_ticks: int, latest_ms: float, ticks: int, load_per_processor: float | None) -> DeviceFinding:
    """Verdict on late ticks of a real device. late_ticks: ticks whose work ended after the next tick was due, missed
    ones included. load_per_processor: None if unknown; the limit is then that of an idle computer."""
    share = late_ticks / max(ticks, 1)
    busy, limit = _is_busy(load_per_processor), _late_limit(load_per_processor)
    fine = share <= limit
    value = f"{late_ticks} of {ticks} ({share:.2%}) ended after the next was due, missed ones among them"
    value += f"; the latest {latest_ms:.1f} ms after its time"
    if share > LATE_SHARE:
        normal_limit = f"{LATE_SHARE:.1%}"
        value += (
            f"; at most {limit:.1%} are fine with all cores busy ({normal_limit} else)"
            if busy
            else f"; at most {normal_limit} are fine"
        )
    return DeviceFinding("Late ticks", value, fine, "" if fine else ADVICE)


def judge_load(per_processor: float | None) -> DeviceFinding:
    """Verdict on the load average; per_processor: None if unknown. A high load is only a warning, because the measured
    lateness decides."""
    if per_processor is None:
        return DeviceFinding("Load", "this system does not report it, so it was not checked", fine=True)
    value = f"{per_processor:.0%} of what its processors can do, over the last minute"
    if math.isfinite(per_processor) and per_processor <= LOAD_PER_PROCESSOR:
        return DeviceFinding("Load", value, fine=True)
    value += f"; above {LOAD_PER_PROCESSOR:.0%} trials may be cut short"
    return DeviceFinding("Load", value, fine=False, advice="Close other programs.", warning=True)
