"""Checks of the time stamps of a recording against its stated sample rate: gaps, jitter and drift.

A straight line is fitted by least squares to the stamps over the sample numbers (gaps counted as lost samples). Its
slope gives the true period, hence the drift in ppm; the deviations from it are the jitter. Without stamps only the
plausibility of the rate, and the notes of a resampling at import, can be checked. All limits are chosen by hand.
"""

from collections.abc import Sequence

import numpy as np

from analysis.look.channels import Stretch
from analysis.look.check import Check
from equalizer.signals.recording import Recording

CLOCK = "clock"
GAP_PERIODS = 1.5
"""Difference of two successive stamps, in sample periods, above which samples were lost between them."""
NOTICE_JITTER_PERIODS, WRONG_JITTER_PERIODS = 0.02, 0.2
"""Rms deviation of the stamps from the fitted line, in sample periods: above the first it is a notice; above the
second it is "wrong", because phases are then not reliable."""
LOWEST_RATE_HZ, HIGHEST_RATE_HZ = 1.0, 1e5
"""Range of sample rates of known devices and sensors. Outside it, stamps in s were probably labelled ms, or the
reverse."""
NOTICE_DRIFT_PPM, WRONG_DRIFT_PPM = 100.0, 5000.0
"""Deviation from the stated rate in ppm: above the first, that of a cheap oscillator, it is a notice; above the second
the stated rate is wrong."""


def check_clock(recording: Recording, stretches: Sequence[Stretch]) -> tuple[Check, ...]:
    """Check the time stamps in each stretch; without stamps, the stated rate and the resampling. A notice alone
    where no time is known; a single "fine" check where no stretch has three stamps."""
    if recording.meta.get("time") == "unknown":
        return (
            Check(
                CLOCK,
                "notice",
                "No time is known: samples are numbered, and the rate of 1 Hz is nominal.",
                "Speeds, frequencies and delays cannot be determined.",
            ),
        )
    if recording.time_s is None:
        checks = (*_check_resampling(recording), *_check_rate(recording.sample_rate_hz))
        return checks or (Check(CLOCK, "fine", _describe_rate_source(recording)),)
    stamp_checks = tuple(check for start, stop in stretches for check in _check_stamps(recording, start, stop))
    return stamp_checks or (Check(CLOCK, "fine", "Fewer than three time stamps in a row: not checked."),)


def describe_implausible_rate(rate_hz: float) -> str:
    """Describe an implausible sample rate, as results from stamps in another unit, in a sentence; empty for a plausible
    rate."""
    if LOWEST_RATE_HZ <= rate_hz <= HIGHEST_RATE_HZ:
        return ""
    unit_confusion = "s, called ms" if rate_hz > HIGHEST_RATE_HZ else "ms, called s"
    return f"{rate_hz:g} Hz is an unlikely rate of a haptic device: the time may be in another unit ({unit_confusion})."


def _check_rate(rate_hz: float) -> tuple[Check, ...]:
    """Check the plausibility of the stated rate: a notice where it is implausible, else empty."""
    implausibility = describe_implausible_rate(rate_hz)
    return (
        (Check(CLOCK, "notice", implausibility, "Check the unit of the time, and import again."),)
        if implausibility
        else ()
    )


def _describe_rate_source(recording: Recording) -> str:
    """Describe the source of the sample rate in a sentence: even stamps at the import, or the user."""
    if recording.meta.get("time") == "stamps":
        return f"The time stamps of the file were even at its import; they give {recording.sample_rate_hz:g} Hz."
    return f"There are no time stamps; {recording.sample_rate_hz:g} Hz is taken as stated."


def _check_resampling(recording: Recording) -> tuple[Check, ...]:
    """Make notices from the notes of an import that resampled uneven stamps; empty without such notes."""
    import_metadata = recording.meta.get("import")
    notes = import_metadata.get("notes", ()) if isinstance(import_metadata, dict) else ()
    resampling_notes = [str(note) for note in notes if "uneven stamps" in str(note)] if isinstance(notes, list) else []
    return tuple(
        Check(
            CLOCK,
            "notice",
            f"The import resampled uneven stamps. {note}",
            "Use phases only far below half the sample rate.",
        )
        for note in resampling_notes
    )


def _check_stamps(recording: Recording, start: int, stop: int) -> tuple[Check, ...]:
    """Check one stretch, samples start to stop - 1, for gaps, jitter and drift; empty for fewer than three stamps,
    which a straight line fits exactly."""
    assert recording.time_s is not None
    stamps_s, rate_hz = recording.time_s[start:stop], recording.sample_rate_hz
    if len(stamps_s) < 3:
        return ()
    intervals_periods = np.diff(stamps_s) * rate_hz
    is_gap = intervals_periods > GAP_PERIODS
    sample_numbers = np.concatenate([[0.0], np.cumsum(np.where(is_gap, np.round(intervals_periods), 1.0))])
    period_s, start_s = np.polyfit(sample_numbers, stamps_s - stamps_s[0], 1)
    deviations_periods = (stamps_s - stamps_s[0] - start_s - period_s * sample_numbers) / period_s
    jitter_periods, drift_ppm = float(np.std(deviations_periods)), (period_s * rate_hz - 1) * 1e6
    return tuple(
        check
        for check in (
            _check_gaps(intervals_periods, is_gap, stamps_s, rate_hz),
            _check_jitter(jitter_periods, float(np.abs(deviations_periods).max()), period_s),
            _check_drift(drift_ppm, rate_hz),
        )
        if check is not None
    )


def _check_gaps(
    intervals_periods: np.ndarray, is_gap: np.ndarray, stamps_s: np.ndarray, rate_hz: float
) -> Check | None:
    """Check for gaps between stamps; None without gaps. intervals_periods: (n - 1,), differences of successive stamps
    in sample periods; is_gap: (n - 1,), whether above `GAP_PERIODS`; stamps_s: (n,), s; rate_hz: stated sample rate."""
    if not is_gap.any():
        return None
    first_gap, longest_periods = int(np.argmax(is_gap)), float(intervals_periods.max())
    return Check(
        CLOCK,
        "wrong",
        f"{int(is_gap.sum())} gaps between time stamps, the first after {stamps_s[first_gap] - stamps_s[0]:.4g} s; "
        f"the longest is {longest_periods / rate_hz * 1e3:.4g} ms in place of {1e3 / rate_hz:.4g} ms.",
        "Import with the stamps as the clock: lost samples become missing ones, and what follows keeps its time.",
    )


def _check_jitter(jitter_periods: float, largest_deviation_periods: float, period_s: float) -> Check | None:
    """Check the deviations of the stamps from even spacing. jitter_periods, largest_deviation_periods: their rms and
    largest magnitude, in sample periods; period_s: fitted sample period (s)."""
    text = (
        f"Time stamps deviate by {jitter_periods * period_s * 1e6:.3g} us rms from even spacing "
        f"({jitter_periods:.1%} of a step), "
        f"{largest_deviation_periods * period_s * 1e6:.3g} us at most."
    )
    if jitter_periods > WRONG_JITTER_PERIODS:
        return Check(CLOCK, "wrong", text, "Import with the stamps as the clock, and resample.")
    if jitter_periods > NOTICE_JITTER_PERIODS:
        return Check(CLOCK, "notice", text, "Expect noise near strong lines; resample by the stamps where it matters.")
    return Check(CLOCK, "fine", text)


def _check_drift(drift_ppm: float, rate_hz: float) -> Check | None:
    """Check the fitted against the stated sample period. drift_ppm: relative excess of the fitted over the stated
    sample period, in ppm."""
    direction = "slower" if drift_ppm > 0 else "faster"
    text = f"By its stamps the clock is {abs(drift_ppm):.4g} ppm {direction} than {rate_hz:g} Hz."
    if abs(drift_ppm) > WRONG_DRIFT_PPM:
        measured_rate_hz = rate_hz / (1 + drift_ppm * 1e-6)
        return Check(CLOCK, "wrong", text, f"State the rate as {measured_rate_hz:.6g} Hz, or import with the stamps.")
    if abs(drift_ppm) > NOTICE_DRIFT_PPM:
        return Check(CLOCK, "notice", text, "State the rate of the stamps where frequencies matter.")
    return Check(CLOCK, "fine", text)
