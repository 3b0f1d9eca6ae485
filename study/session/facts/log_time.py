"""Elapsed time from a log: by the monotonic clock within a sitting, by the wall clock between sittings.

The wall clock can be set forward and back at any moment; the monotonic clock cannot. Entries of a sitting state both
(not in older logs, nor those of another program), so that exposure limits within a sitting do not depend on the wall
clock. Between sittings only the wall clock is available: setting it forward there cannot be distinguished from elapsed
time; setting it back is detected and counts as no time.

Where the monotonic clock stops while the computer sleeps, as on Linux, sleep within a sitting cannot be distinguished
from a clock set forward.
"""

from dataclasses import dataclass
from datetime import datetime

MIN_STEP_S = 5.0
"""Disagreement of the two clocks (s) from which the wall clock counts as set. Chosen: far above the corrections of a
running time service (NTP)."""


@dataclass(frozen=True, slots=True)
class Moment:
    """Time of a log entry, by wall clock and monotonic clock."""

    utc: str
    """Reading of the wall clock, ISO 8601; empty where nothing was logged before."""
    monotonic_s: float | None = None
    """Reading of the monotonic clock (s); None in logs of versions before 1.1 and in entries of another program."""


@dataclass(frozen=True, slots=True)
class ClockStep:
    """The wall clock of the computer was set between two entries of the log."""

    utc: str
    """UTC time of the first entry after the step, by the clock as it was set."""
    step_s: float
    """Size of the step in seconds; positive: forward."""
    between_sittings: bool
    """Whether the two entries belong to different sittings."""

    @property
    def sentence(self) -> str:
        """Sentence for the experimenter."""
        step_text = _format_duration(abs(self.step_s))
        limits_text = "Time limits and the vibration dose do not follow it; the times in the log do."
        if self.step_s > 0:
            return (
                f"The computer's clock was set forward by {step_text}, or the computer slept that long. {limits_text}"
            )
        if self.between_sittings:
            return (
                f"The computer's clock reads {step_text} earlier than at the last entry of the log. No time counts as "
                "passed since then: the vibration dose continues from there."
            )
        return f"The computer's clock was set back by {step_text}. {limits_text}"


def compute_elapsed_s(start: Moment, end: Moment) -> float:
    """Compute the time between two entries (s), never negative: by the monotonic clock where both state it, which must
    then be of the same sitting; otherwise by the wall clock, and 0 where `start.utc` is empty."""
    if start.monotonic_s is not None and end.monotonic_s is not None:
        return max(0.0, end.monotonic_s - start.monotonic_s)
    return max(0.0, compute_wall_clock_s(start.utc, end.utc))


def find_clock_step(start: Moment, end: Moment, between_sittings: bool = False) -> ClockStep | None:
    """Find the step of the wall clock between two entries; None below `MIN_STEP_S`. Unless both entries state the
    monotonic time, only a step back can be detected."""
    wall_s = compute_wall_clock_s(start.utc, end.utc)
    has_monotonic = start.monotonic_s is not None and end.monotonic_s is not None
    step_s = wall_s - compute_elapsed_s(start, end) if has_monotonic else min(0.0, wall_s)
    return ClockStep(end.utc, step_s, between_sittings) if abs(step_s) >= MIN_STEP_S else None


def compute_wall_clock_s(first_utc: str, second_utc: str) -> float:
    """Compute the time (s) from the first to the second reading of the wall clock, ISO 8601 each: negative if the clock
    was set back; 0 if the first is empty."""
    if not first_utc:
        return 0.0
    return (datetime.fromisoformat(second_utc) - datetime.fromisoformat(first_utc)).total_seconds()


def _format_duration(seconds: float) -> str:
    """Format a duration: in seconds below 2 minutes, otherwise in minutes, or hours and minutes."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"
