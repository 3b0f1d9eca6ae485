"""Discriminability of the directions by each cue alone: difference over the participant's internal noise.

A sensor distinguishes two nearly repeatable stimuli even with tiny differences, so that its own error says nothing
about people. A participant has an internal noise, which is declared here, and adds to the variation of the delivery
from trial to trial (a roved level): d' = difference / sqrt(internal noise^2 + spread^2). At d' = 1 the difference is
one just noticeable difference of that participant; the cue alone then makes Phi(1/2) = 69 % of the answers right.

With friction, the delivered stimulus depends on the level in a way that a participant can learn: differences and spread
are those at the same level, which enters as a parabola in dB.

Source: N. A. Macmillan, C. D. Creelman, Detection Theory: A User's Guide, 2nd ed. (2005), chapter 1.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from analysis.psychophysics.cues.delivered_cues import Cue, DeliveredTrials
from equalizer.signals.signal import FloatArray

INTERNAL_NOISE_DB = (0.5, 1.0, 2.0)
"""A very keen, a usual and a dull judge of strength: difference limens of vibration are near 1 dB."""
USUAL_NOISE_DB = 1.0
"""Standard deviation of a person's perceived level, dB."""
NOTICEABLE = 1.0
"""d' of one just noticeable difference."""
CONFIDENCE = 0.95
"""Confidence of the intervals."""


@dataclass(frozen=True, slots=True)
class CueAbility:
    """One cue of one participant at one frequency."""

    subject: str
    frequency_hz: float
    cue: Cue
    trials: int
    difference_db: float
    """First direction minus second, by angle, at the same level."""
    lower_db: float
    upper_db: float
    """95 % interval of the difference, from how much trials vary."""
    spread_db: float
    """Standard deviation over trials of one direction at the same level."""

    def ability(self, noise_db: float) -> float:
        """d' of a participant with this internal noise who uses nothing but this cue."""
        return abs(self.difference_db) / math.hypot(noise_db, self.spread_db)

    @property
    def noticeable(self) -> bool:
        """Whether the end of the interval that is nearer to 0 reaches d' = 1 at an internal noise of
        `USUAL_NOISE_DB`."""
        if self.lower_db <= 0.0 <= self.upper_db:
            return False
        nearest_db = min(abs(self.lower_db), abs(self.upper_db))
        return nearest_db >= NOTICEABLE * math.hypot(USUAL_NOISE_DB, self.spread_db)


def cue_abilities(trials: DeliveredTrials) -> tuple[CueAbility, ...]:
    """Discriminability by cue and participant, over the trials measured for the cue; participants with too few trials
    for a spread are left out."""
    abilities = []
    for cue, values_db in trials.values_db.items():
        for person, subject in enumerate(trials.subjects):
            of_person = (trials.person == person) & np.isfinite(values_db)
            fit = same_level_difference(values_db[of_person], trials.nominal_db[of_person], trials.side[of_person])
            if fit is None:
                continue
            half_width = float(student.ppf(0.5 + CONFIDENCE / 2, fit.df)) * fit.error_db
            abilities.append(
                CueAbility(
                    subject=subject,
                    frequency_hz=trials.frequency_hz,
                    cue=cue,
                    trials=len(fit.residual_db),
                    difference_db=fit.difference_db,
                    lower_db=fit.difference_db - half_width,
                    upper_db=fit.difference_db + half_width,
                    spread_db=math.sqrt(float(fit.residual_db @ fit.residual_db) / fit.df),
                )
            )
    return tuple(abilities)


@dataclass(frozen=True, slots=True, eq=False)
class SameLevelFit:
    """Difference of a cue between two directions at the same level, with its standard error and residuals."""

    difference_db: float
    error_db: float
    """Standard error."""
    df: int
    residual_db: FloatArray
    """(n,): each trial against those of its direction at its level."""


def same_level_difference(values_db: FloatArray, nominal_db: FloatArray, side: FloatArray) -> SameLevelFit | None:
    """Least squares of one participant's values (n,) on a parabola of the level and the side (+1 or -1). None where
    one direction is missing, where each was played at levels of its own that a parabola explains as well, or too few
    trials are left for a spread."""
    if len(set(side.tolist())) < 2:
        return None
    level_deviation = nominal_db - nominal_db.mean()
    design = np.column_stack([side / 2.0, np.ones(len(level_deviation)), level_deviation, level_deviation**2])
    # Levels may be one or two: then the parabola is not determined, and need not be.
    inverse = np.linalg.pinv(design)
    rank = int(np.linalg.matrix_rank(design))
    df = len(level_deviation) - rank
    if df < 1 or int(np.linalg.matrix_rank(design[:, 1:])) == rank:
        return None
    coefficients = inverse @ values_db
    residual = values_db - design @ coefficients
    spread = math.sqrt(float(residual @ residual) / df)
    return SameLevelFit(float(coefficients[0]), spread * float(np.linalg.norm(inverse[0])), df, residual)
