"""Cues of each trial other than the direction: intensity, spectrum and coupling of the delivered vibration, in dB.

With the amplitudes of the acceleration along the direction (a), across it (c) and of the harmonics (h), in m/s^2, and
the level of the staircase L in N:

    intensity 20 log10(a / L)      spectrum 20 log10(1 + h / a)      coupling 20 log10(1 + c / a)

Spectrum and coupling are the contributions of h and c to the amplitude if they were in phase with it, an upper bound.
In dB all three can be compared with the same internal noise of a participant.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from equalizer.signals.signal import FloatArray
from protocols.trial import Phase, Trial


class Cue(StrEnum):
    """A quantity other than the direction by which two directions may differ as delivered."""

    INTENSITY = "intensity"
    """Amplitude along the direction, over the level of the staircase; where levels are roved, it varies with them."""
    SPECTRUM = "spectrum"
    """Contribution of the harmonics to the amplitude."""
    COUPLING = "coupling"
    """Contribution of the motion across the direction to the amplitude."""


@dataclass(frozen=True, slots=True, eq=False)
class DeliveredTrials:
    """The valid test trials at one frequency with a measured acceleration; arrays are (n,)."""

    frequency_hz: float
    subjects: tuple[str, ...]
    """Codes of the participants, in the order of their first trial."""
    person: NDArray[np.intp]
    """Index of each trial's participant in `subjects`."""
    side: FloatArray
    """+1: the direction at the smaller angle in the plane was shown; -1: the other. Labels may be swapped between
    people, angles are not. Without angles: +1 for label 1, -1 for label 2."""
    answer: FloatArray
    """The direction that was answered, in the same signs."""
    nominal_db: FloatArray
    """Level of the staircase, re 1 N."""
    played_db: FloatArray
    """Level that was played, re 1 N; equal to `nominal_db` unless levels were roved."""
    values_db: dict[Cue, FloatArray]
    """Values by cue; NaN where a trial has no measurement of the cue. A cue without any measurement is missing."""


@dataclass(frozen=True, slots=True)
class CueGap:
    """Number of trials at one frequency without a measurement of a cue, among those with a measured acceleration."""

    frequency_hz: float
    cue: Cue
    missing: int
    trials: int
    """Number of trials with a measured acceleration."""


def select_delivered_trials(trials: Iterable[Trial]) -> tuple[DeliveredTrials, ...]:
    """Select the valid test trials with a measured acceleration and a level, both above 0, grouped by frequency,
    ascending; empty without any."""
    measured_trials = [
        played_trial
        for played_trial in trials
        if played_trial.phase is Phase.TEST
        and played_trial.is_valid
        and played_trial.delivered_mps2
        and played_trial.level_n > 0
    ]
    swapped_sessions = _find_swapped_sessions(measured_trials)
    delivered_groups = []
    for frequency_hz in sorted({trial.frequency_hz for trial in measured_trials}):
        frequency_trials = [trial for trial in measured_trials if trial.frequency_hz == frequency_hz]
        subjects = tuple(dict.fromkeys(trial.subject for trial in frequency_trials))
        person_index = {subject: index for index, subject in enumerate(subjects)}
        label_signs = np.array(
            [-1.0 if (trial.subject, trial.session) in swapped_sessions else 1.0 for trial in frequency_trials]
        )
        delivered_groups.append(
            DeliveredTrials(
                frequency_hz=frequency_hz,
                subjects=subjects,
                person=np.array([person_index[trial.subject] for trial in frequency_trials]),
                side=label_signs * np.array([3.0 - 2.0 * trial.direction_shown for trial in frequency_trials]),
                answer=label_signs * np.array([3.0 - 2.0 * (trial.answer or 0) for trial in frequency_trials]),
                nominal_db=_convert_to_db([trial.staircase_n for trial in frequency_trials]),
                played_db=_convert_to_db([trial.level_n for trial in frequency_trials]),
                values_db={
                    cue: _convert_to_db(ratios)
                    for cue, compute_ratio in _RATIO_FUNCTIONS.items()
                    if (ratios := _compute_cue_ratios(frequency_trials, compute_ratio))
                },
            )
        )
    return tuple(delivered_groups)


def find_cue_gaps(trials: Iterable[Trial]) -> tuple[CueGap, ...]:
    """Find the cues without a measurement in some trials, and count these, by frequency (ascending) and cue; empty
    where none is missing."""
    gaps = []
    for group in select_delivered_trials(trials):
        trial_count = len(group.person)
        for cue in Cue:
            values_db = group.values_db.get(cue)
            missing_count = trial_count if values_db is None else int(np.isnan(values_db).sum())
            if missing_count:
                gaps.append(CueGap(group.frequency_hz, cue, missing_count, trial_count))
    return tuple(gaps)


def _find_swapped_sessions(trials: list[Trial]) -> frozenset[tuple[str, str]]:
    """Find participant and session of each session in which label 1 is the direction at the larger angle. Labels belong
    to the session, because they may be swapped in another one of the participant. For a session with trials of one
    direction only, its angle is compared with the larger of the study's two."""
    angles_by_session: dict[tuple[str, str], dict[int, float]] = {}
    for trial in trials:
        if trial.angle_deg is not None:
            angles_by_session.setdefault((trial.subject, trial.session), {})[trial.direction_shown] = trial.angle_deg
    all_angles_deg = {
        angle_deg for session_angles in angles_by_session.values() for angle_deg in session_angles.values()
    }
    larger_angle_deg = max(all_angles_deg) if len(all_angles_deg) == 2 else None
    return frozenset(
        session_key
        for session_key, session_angles in angles_by_session.items()
        if _is_swapped(session_angles, larger_angle_deg)
    )


def _is_swapped(session_angles: dict[int, float], larger_angle_deg: float | None) -> bool:
    """Whether label 1 is the larger angle. session_angles: angles of a session by label; larger_angle_deg: larger angle
    of the study's two directions, None where their number is not two."""
    if len(session_angles) == 2:
        return session_angles[1] > session_angles[2]
    ((label, angle_deg),) = session_angles.items()
    return larger_angle_deg is not None and (label == 1) == (angle_deg == larger_angle_deg)


def _compute_cue_ratios(trials: list[Trial], compute_ratio: Callable[[Trial], float | None]) -> list[float]:
    """Compute the ratio of each trial, NaN where it is None; empty where it is None for all trials."""
    ratios = [compute_ratio(trial) for trial in trials]
    is_measured = any(ratio is not None for ratio in ratios)
    return [math.nan if ratio is None else ratio for ratio in ratios] if is_measured else []


def _compute_intensity_ratio(trial: Trial) -> float | None:
    """Compute the delivered amplitude over the level of the staircase, m/s^2 per N."""
    return (trial.delivered_mps2 or math.nan) / trial.staircase_n


def _compute_spectrum_ratio(trial: Trial) -> float | None:
    """Compute 1 + h / a; None without a measurement of the harmonics."""
    return None if trial.harmonics_mps2 is None else 1.0 + trial.harmonics_mps2 / (trial.delivered_mps2 or math.nan)


def _compute_coupling_ratio(trial: Trial) -> float | None:
    """Compute 1 + c / a; None without a measurement across the direction."""
    return None if trial.off_axis_mps2 is None else 1.0 + trial.off_axis_mps2 / (trial.delivered_mps2 or math.nan)


_RATIO_FUNCTIONS: dict[Cue, Callable[[Trial], float | None]] = {
    Cue.INTENSITY: _compute_intensity_ratio,
    Cue.SPECTRUM: _compute_spectrum_ratio,
    Cue.COUPLING: _compute_coupling_ratio,
}
"""Function that computes the ratio of a trial whose dB value is the cue, by cue."""


def _convert_to_db(amplitudes: list[float]) -> FloatArray:
    """Convert amplitudes, ratios or levels to dB, 20 log10; NaN for NaN, and for values that are not positive, which
    only a damaged log holds."""
    amplitude_array = np.array(amplitudes, dtype=np.float64)
    return 20.0 * np.log10(np.where(amplitude_array > 0, amplitude_array, np.nan))
