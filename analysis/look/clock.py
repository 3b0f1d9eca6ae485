"""Checks of the time stamps of a recording against its stated sample rate: gaps, jitter and drift.

A straight line is fitted by least squares to the stamps over the sample numbers (gaps counted as lost samples). Its
slope gives the true period, hence the drift in ppm; the deviations from it are the jitter. Without stamps only the
plausibility of the rate, and the notes of a resampling at import, can be checked.
"""

from collections.abc import Sequence

import numpy as np

from analysis.look.channels import Stretch
from analysis.look.check import Check
from equalizer.signals.recording import Recording

CLOCK = "clock"
GAP_PERIODS = 1.5
"""Difference of two successive stamps, in sample periods, above which samples were lost between them."""
JITTER, WRONG_JITTER = 0.02, 0.2
"""Rms deviation of the stamps from the fitted line, in sample periods: above the first it is a notice; above the
second it is "wrong", because phases are then not reliable."""
SLOWEST_HZ, FASTEST_HZ = 1.0, 1e5
"""Range of sample rates of known devices and sensors. Outside it, stamps in s were probably labelled ms, or the
reverse."""
DRIFT_PPM, RATE_PPM = 100.0, 5000.0
"""Deviation from the stated rate in ppm: above the first, that of a cheap oscillator, it is a notice; above the second
the stated rate is wrong."""


def check_clock(recording: Recording, stretches: Sequence[Stretch]) -> tuple[Check, ...]:
    """Checks of the time stamps in each stretch; without stamps, of the stated rate and of resampling. A notice alone
    where no time is known."""
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
        checks = (*_check_resampling(recording), *_rate_checks(recording.sample_rate_hz))
        return checks or (Check(CLOCK, "fine", _clock_source(recording)),)
    stamp_checks = tuple(check for start, stop in stretches for check in _stamp_checks(recording, start, stop))
    return stamp_checks or (Check(CLOCK, "fine", "All time stamps are evenly spaced."),)


def rate_objection(rate_hz: float) -> str:
    """Sentence on an implausible rate, as it comes from stamps in another unit; empty for a plausible rate."""
    if SLOWEST_HZ <= rate_hz <= FASTEST_HZ:
        return ""
    mislabelling = "s, called ms" if rate_hz > FASTEST_HZ else "ms, called s"
    return f"{rate_hz:g} Hz is an unlikely rate of a haptic device: the time may be in another unit ({mislabelling})."


def _rate_checks(rate_hz: float) -> tuple[Check, ...]:
    """A notice where the rate is implausible; else empty."""
    objection = rate_objection(rate_hz)
    return (Check(CLOCK, "notice", objection, "Check the unit of the time, and import again."),) if objection else ()


def _clock_source(recording: Recording) -> str:
    """Sentence on where the sample rate comes from: even stamps at the import, or the user."""
    if recording.meta.get("time") == "stamps":
        return f"The time stamps of the file were even at its import; they give {recording.sample_rate_hz:g} Hz."
    return f"There are no time stamps; {recording.sample_rate_hz:g} Hz is taken as stated."


def _check_resampling(recording: Recording) -> tuple[Check, ...]:
    """Notices from the notes of an import that resampled uneven stamps; empty without such notes."""
    origin = recording.meta.get("import")
    notes = origin.get("notes", ()) if isinstance(origin, dict) else ()
    uneven = [str(note) for note in notes if "uneven stamps" in str(note)] if isinstance(notes, list) else []
    return tuple(
        Check(
            CLOCK, "notice", f"The import has evened it out: {note}", "Use phases only far below half the sample rate."
        )
        for note in uneven
    )


def _stamp_checks(recording: Recording, start: int, stop: int) -> tuple[Check, ...]:
    """Checks of gaps, jitter and drift in one stretch; empty for fewer than three stamps."""
    assert recording.time_s is not None
    stamps, rate_hz = recording.time_s[start:stop], recording.sample_rate_hz
    if len(stamps) < 3:
        return ()
    steps = np.diff(stamps) * rate_hz
    gaps = steps > GAP_PERIODS
    sample_numbers = np.concatenate([[0.0], np.cumsum(np.where(gaps, np.round(steps), 1.0))])
    slope, offset_s = np.polyfit(sample_numbers, stamps - stamps[0], 1)
    deviations = (stamps - stamps[0] - offset_s - slope * sample_numbers) / slope
    jitter, drift_ppm = float(np.std(deviations)), (slope * rate_hz - 1) * 1e6
    return tuple(
        check
        for check in (
            _gap_check(steps, gaps, stamps, rate_hz),
            _jitter_check(jitter, float(np.abs(deviations).max()), slope),
            _drift_check(drift_ppm, rate_hz),
        )
        if check is not None
    )


def _gap_check(steps: np.ndarray, gaps: np.ndarray, stamps: np.ndarray, rate_hz: float) -> Check | None:
    """steps: (n - 1,), differences of successive stamps in sample periods; gaps: (n - 1,), those above
    `GAP_PERIODS`."""
    if not gaps.any():
        return None
    first, longest = int(np.argmax(gaps)), float(steps.max())
    return Check(
        CLOCK,
        "wrong",
        f"{int(gaps.sum())} gaps between time stamps, the first after {stamps[first] - stamps[0]:.4g} s; the longest "
        f"is {longest / rate_hz * 1e3:.4g} ms in place of {1e3 / rate_hz:.4g} ms.",
        "Import with the stamps as the clock: lost samples become missing ones, and what follows keeps its time.",
    )


def _jitter_check(jitter: float, largest: float, step_s: float) -> Check | None:
    """jitter, largest: rms and largest deviation, in sample periods of step_s seconds."""
    text = (
        f"Time stamps deviate by {jitter * step_s * 1e6:.3g} us rms from even spacing ({jitter:.1%} of a step), "
        f"{largest * step_s * 1e6:.3g} us at most."
    )
    if jitter > WRONG_JITTER:
        return Check(CLOCK, "wrong", text, "Import with the stamps as the clock, and resample.")
    if jitter > JITTER:
        return Check(CLOCK, "notice", text, "Expect noise near strong lines; resample by the stamps where it matters.")
    return Check(CLOCK, "fine", text)


def _drift_check(drift_ppm: float, rate_hz: float) -> Check | None:
    """drift_ppm: relative excess of the measured over the stated sample period, in ppm."""
    slower = "slower" if drift_ppm > 0 else "faster"
    text = f"By its stamps the clock is {abs(drift_ppm):.4g} ppm {slower} than {rate_hz:g} Hz."
    if abs(drift_ppm) > RATE_PPM:
        true_hz = rate_hz / (1 + drift_ppm * 1e-6)
        return Check(CLOCK, "wrong", text, f"State the rate as {true_hz:.6g} Hz, or import with the stamps.")
    if abs(drift_ppm) > DRIFT_PPM:
        return Check(CLOCK, "notice", text, "State the rate of the stamps where frequencies matter.")
    return Check(CLOCK, "fine", text)
