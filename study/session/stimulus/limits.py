"""Safety limits of a sitting or recording, computed from its protocol; the device's safety layer enforces them at every
tick.

The slew rate is the largest slope that a stimulus of the protocol can have, plus an allowance for the spring:

    |d/dt (fade(t) A sin(2 pi f t))| <= A (2 pi f + pi / (2 T)),        T: duration of the fade
"""

import math
from dataclasses import dataclass, field

from protocols.definition.apparatus import SafetySettings
from protocols.definition.plausibility import PlausibilitySettings
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.recording_segments import MultisineSegment, find_highest_hz
from protocols.definition.study_contradictions import compute_highest_roved_n
from protocols.definition.study_protocol import StudyProtocol

SPRING_SLEW_N_PER_S = 100.0
"""Allowance for the centring spring (N/s). Chosen: above 150 N/m at 0.6 m/s (90 N/s), faster than a hand moves in a
trial."""

SLEW_MARGIN = 1.05
"""Factor on the steepest slope of the stimuli, for rounding. Chosen."""

MULTISINE_PEAK_FACTOR = math.sqrt(2)
"""Bound of a multisine between its samples: with lines below a quarter of the rate the continuous signal exceeds the
largest sample by at most this factor (Ehlich and Zeller 1964), and Bernstein's inequality then bounds its slope like
that of a sine. Above a quarter, the bound exceeds twice the largest sample per tick, the most that two consecutive
samples can differ."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits that the device's safety layer enforces: caps of the forces (N), slew rate (N/s) and durations (s)."""

    stimulus_cap_n: float
    """Limit of the stimulus alone."""
    total_cap_n: float
    """Limit of the sum of stimulus, spring and damper."""
    slew_n_per_s: float
    """Limit of the change of the total force."""
    longest_hold_s: float
    """Longest duration of a stimulus, after which it is released."""
    watchdog_s: float
    """Longest time without a sign of life of the program, after which the force is faded out."""
    release_s: float
    """Duration of a safety fade."""
    feedback_cap_n: float = SafetySettings.feedback_cap_n
    """Limit of the forces of spring and damper: of each alone, and of their sum."""
    plausibility: PlausibilitySettings = field(default_factory=PlausibilitySettings)
    """Bounds of plausible position readings."""


def make_study_limits(protocol: StudyProtocol) -> Limits:
    """Make the limits of a study. The slew rate allows the steepest stimulus, the highest frequency at the highest
    level during a fade, and the spring."""
    stimulus = protocol.stimulus
    highest_frequency_hz = max(protocol.all_frequencies_hz)
    fade_s = min(stimulus.fade_in_s, stimulus.fade_out_s)
    return _make_limits(
        protocol.safety, _bound_slew_n_per_s(highest_frequency_hz, compute_highest_level_n(protocol), fade_s)
    )


def compute_highest_level_n(protocol: StudyProtocol) -> float:
    """Compute the highest level (N) of a trial: the staircase's cap plus the largest roving, limited by the safety
    cap."""
    return min(
        compute_highest_roved_n(protocol.staircase.cap_n, protocol.stimulus.rove_db), protocol.safety.stimulus_cap_n
    )


def make_recording_limits(protocol: RecordingProtocol) -> Limits:
    """Make the limits of a recording. The slew rate allows its steepest excitation and the spring."""
    slew_rates_n_per_s = [
        (MULTISINE_PEAK_FACTOR if isinstance(segment, MultisineSegment) else 1.0)
        * _bound_slew_n_per_s(find_highest_hz(segment), segment.amplitude_n, protocol.fade_s)
        for segment in protocol.segments
    ]
    return _make_limits(protocol.safety, max(slew_rates_n_per_s))


def describe_forces(safety: SafetySettings) -> str:
    """Describe the largest forces (N) on the hand in words, for messages on which a person decides."""
    feedback_n = min(safety.feedback_cap_n, safety.total_cap_n)
    return (
        f"stimulus at most {safety.stimulus_cap_n:g} N, spring and damper {feedback_n:g} N, "
        f"all together {safety.total_cap_n:g} N"
    )


def _bound_slew_n_per_s(frequency_hz: float, amplitude_n: float, fade_s: float) -> float:
    """Bound |d/dt (fade(t) A sin(2 pi f t))| (N/s), with margin and spring; amplitude A (N), fade of fade_s (s). The
    slope of a raised-cosine fade is at most pi / (2 fade_s), that of a linear fade less."""
    max_slope_n_per_s = amplitude_n * (2 * math.pi * frequency_hz + math.pi / (2 * fade_s))
    return SLEW_MARGIN * max_slope_n_per_s + SPRING_SLEW_N_PER_S


def _make_limits(safety: SafetySettings, slew_n_per_s: float) -> Limits:
    """Make the limits of a protocol's safety settings, with this slew rate (N/s)."""
    return Limits(
        stimulus_cap_n=safety.stimulus_cap_n,
        total_cap_n=safety.total_cap_n,
        slew_n_per_s=slew_n_per_s,
        longest_hold_s=safety.longest_trial_s,
        watchdog_s=safety.watchdog_s,
        release_s=safety.release_s,
        feedback_cap_n=safety.feedback_cap_n,
        plausibility=safety.plausibility,
    )
