"""Differences between two directions as delivered, other than the direction itself: strength, spectrum, coupling.

All in dB, so that they can be compared with one internal noise. Harmonics and motion across the direction count by
their contribution to the amplitude if in phase with it, an upper bound.
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
    """Delivered along the direction, over the level of the staircase; varies as a roved level does."""
    SPECTRUM = "spectrum"
    """Contribution of the harmonics to the amplitude."""
    COUPLING = "coupling"
    """Contribution of the motion across the direction to the amplitude."""


@dataclass(frozen=True, slots=True, eq=False)
class DeliveredTrials:
    """The counted and measured test trials at one frequency, (n,) each."""

    frequency_hz: float
    subjects: tuple[str, ...]
    person: NDArray[np.intp]
    """Places in `subjects`."""
    side: FloatArray
    """+1: the first direction of the two as angles in the plane; -1: the other. Labels may be swapped between people,
    the device's directions are not. Without angles: label 1 and 2."""
    answer: FloatArray
    """The direction that was answered, in the same signs."""
    nominal_db: FloatArray
    """Level of the staircase, re 1 N."""
    played_db: FloatArray
    """Level that was played, re 1 N: as the staircase's, unless it was roved."""
    values_db: dict[Cue, FloatArray]
    """NaN where a trial was not measured for the cue; without cues that no trial was measured for."""


@dataclass(frozen=True, slots=True)
class CueGap:
    """Trials at one frequency without information on one cue, among those with a measured amplitude."""

    frequency_hz: float
    cue: Cue
    missing: int
    trials: int


def select_delivered_trials(trials: Iterable[Trial]) -> tuple[DeliveredTrials, ...]:
    """Cues by rising frequency; only measured trials."""
    chosen = [t for t in trials if t.phase is Phase.TEST and t.counts and t.delivered_mps2 and t.level_n > 0]
    turned = _find_turned_sessions(chosen)
    found = []
    for frequency_hz in sorted({trial.frequency_hz for trial in chosen}):
        rows = [trial for trial in chosen if trial.frequency_hz == frequency_hz]
        subjects = tuple(dict.fromkeys(trial.subject for trial in rows))
        place = {subject: number for number, subject in enumerate(subjects)}
        signs = np.array([-1.0 if (trial.subject, trial.session) in turned else 1.0 for trial in rows])
        found.append(
            DeliveredTrials(
                frequency_hz=frequency_hz,
                subjects=subjects,
                person=np.array([place[trial.subject] for trial in rows]),
                side=signs * np.array([3.0 - 2.0 * trial.direction_shown for trial in rows]),
                answer=signs * np.array([3.0 - 2.0 * (trial.answer or 0) for trial in rows]),
                nominal_db=_db([trial.staircase_n for trial in rows]),
                played_db=_db([trial.level_n for trial in rows]),
                values_db={cue: _db(values) for cue, value in _VALUES.items() if (values := _known(rows, value))},
            )
        )
    return tuple(found)


def cue_gaps(trials: Iterable[Trial]) -> tuple[CueGap, ...]:
    """Missing measurements by frequency and cue; only where something is missing."""
    gaps = []
    for group in select_delivered_trials(trials):
        n = len(group.person)
        for cue in Cue:
            values_db = group.values_db.get(cue)
            missing = n if values_db is None else int(np.isnan(values_db).sum())
            if missing:
                gaps.append(CueGap(group.frequency_hz, cue, missing, n))
    return tuple(gaps)


def _find_turned_sessions(trials: list[Trial]) -> frozenset[tuple[str, str]]:
    """Participant and session where label 1 is the direction at the larger angle. Labels go with the session: a
    participant who comes twice may have them the other way round. A session in which only one of the two was measured
    is compared with the larger angle of all sessions."""
    angles: dict[tuple[str, str], dict[int, float]] = {}
    for trial in trials:
        if trial.angle_deg is not None:
            angles.setdefault((trial.subject, trial.session), {})[trial.direction_shown] = trial.angle_deg
    pooled = {angle for known in angles.values() for angle in known.values()}
    larger = max(pooled) if len(pooled) == 2 else None
    return frozenset(name for name, known in angles.items() if _is_turned(known, larger))


def _is_turned(known: dict[int, float], larger: float | None) -> bool:
    """known: angles of a session by label; larger: angle of the study's two directions, None where they are not two."""
    if len(known) == 2:
        return known[1] > known[2]
    ((label, angle),) = known.items()
    return larger is not None and (label == 1) == (angle == larger)


def _known(rows: list[Trial], value: Callable[[Trial], float | None]) -> list[float]:
    """NaN where a trial has no value; empty where none has."""
    values = [value(trial) for trial in rows]
    known = any(each is not None for each in values)
    return [math.nan if each is None else each for each in values] if known else []


def _intensity(trial: Trial) -> float | None:
    return (trial.delivered_mps2 or math.nan) / trial.staircase_n


def _spectrum(trial: Trial) -> float | None:
    return None if trial.harmonics_mps2 is None else 1.0 + trial.harmonics_mps2 / (trial.delivered_mps2 or math.nan)


def _coupling(trial: Trial) -> float | None:
    return None if trial.off_axis_mps2 is None else 1.0 + trial.off_axis_mps2 / (trial.delivered_mps2 or math.nan)


_VALUES: dict[Cue, Callable[[Trial], float | None]] = {
    Cue.INTENSITY: _intensity,
    Cue.SPECTRUM: _spectrum,
    Cue.COUPLING: _coupling,
}


def _db(values: list[float]) -> FloatArray:
    return 20.0 * np.log10(np.array(values, dtype=np.float64))
