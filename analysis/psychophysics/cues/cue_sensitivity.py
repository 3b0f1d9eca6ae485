"""Sensitivity d' to the two directions by each cue alone: difference of the cue over the participant's noise.

The precision of the sensor does not limit a participant; the participant's internal noise does. It is assumed here, and
adds to the variation of the delivered stimulus from trial to trial, as by roved levels:

    d' = difference / sqrt(internal noise^2 + spread^2)        all in dB

At d' = 1 the difference is one just noticeable difference (JND) of that participant; the cue alone then makes
Phi(1/2) = 69 % of the answers right.

With friction, the delivered stimulus depends on the level in a way that a participant can learn. Difference and spread
are therefore those at the same level: a parabola of the level (dB) is fitted with them.

Source: N. A. Macmillan, C. D. Creelman, Detection Theory: A User's Guide, 2nd ed. (2005), chapter 1.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from analysis.psychophysics.cues.delivered_cues import Cue, DeliveredTrials
from equalizer.signals.signal import FloatArray

INTERNAL_NOISE_DB = (0.5, 1.0, 2.0)
"""Internal noise (dB) of participants with a high, a typical and a low sensitivity to intensity: chosen around 1 dB,
near the difference limens of vibration."""
TYPICAL_NOISE_DB = 1.0
"""Internal noise of a typical participant: standard deviation of the perceived level, dB."""
JND_D_PRIME = 1.0
"""d' of one just noticeable difference (JND)."""
CONFIDENCE = 0.95
"""Confidence level of the intervals of the difference."""


@dataclass(frozen=True, slots=True)
class CueSensitivity:
    """Difference of one cue between the directions, for one participant at one frequency, and the d' that follows."""

    subject: str
    frequency_hz: float
    cue: Cue
    trials: int
    """Number of trials with a value of the cue."""
    difference_db: float
    """Direction of side +1 minus that of side -1 (`DeliveredTrials.side`), at the same level."""
    lower_db: float
    upper_db: float
    """95 % confidence interval of the difference, from the residuals of the trials."""
    spread_db: float
    """Standard deviation over trials of one direction at the same level (residual standard deviation of the fit)."""

    def compute_d_prime(self, noise_db: float) -> float:
        """Compute d' of a participant with this internal noise (dB, > 0) who uses this cue alone."""
        return abs(self.difference_db) / math.hypot(noise_db, self.spread_db)

    @property
    def is_noticeable(self) -> bool:
        """Whether the end of the interval that is nearer to 0 reaches d' = 1 at an internal noise of
        `TYPICAL_NOISE_DB`."""
        if self.lower_db <= 0.0 <= self.upper_db:
            return False
        nearest_db = min(abs(self.lower_db), abs(self.upper_db))
        return nearest_db >= JND_D_PRIME * math.hypot(TYPICAL_NOISE_DB, self.spread_db)


def estimate_cue_sensitivities(trials: DeliveredTrials) -> tuple[CueSensitivity, ...]:
    """Estimate the sensitivity by cue and participant, over the trials with a measurement of the cue. Participants for
    whom `fit_same_level_difference` returns None are left out."""
    sensitivities = []
    for cue, values_db in trials.values_db.items():
        for person, subject in enumerate(trials.subjects):
            is_of_person = (trials.person == person) & np.isfinite(values_db)
            fit = fit_same_level_difference(
                values_db[is_of_person], trials.nominal_db[is_of_person], trials.side[is_of_person]
            )
            if fit is None:
                continue
            half_width_db = float(student.ppf(0.5 + CONFIDENCE / 2, fit.df)) * fit.error_db
            sensitivities.append(
                CueSensitivity(
                    subject=subject,
                    frequency_hz=trials.frequency_hz,
                    cue=cue,
                    trials=len(fit.residual_db),
                    difference_db=fit.difference_db,
                    lower_db=fit.difference_db - half_width_db,
                    upper_db=fit.difference_db + half_width_db,
                    spread_db=math.sqrt(float(fit.residual_db @ fit.residual_db) / fit.df),
                )
            )
    return tuple(sensitivities)


@dataclass(frozen=True, slots=True, eq=False)
class SameLevelFit:
    """Difference of a cue between two directions at the same level, with its standard error and residuals."""

    difference_db: float
    """Values at side +1 minus those at side -1."""
    error_db: float
    """Standard error."""
    df: int
    """Degrees of freedom of the residuals."""
    residual_db: FloatArray
    """(n,): value of each trial minus the fitted value for its direction and level."""


def fit_same_level_difference(values_db: FloatArray, nominal_db: FloatArray, side: FloatArray) -> SameLevelFit | None:
    """Fit one participant's values (n,) by least squares: a parabola of the level nominal_db (n,) plus half the
    difference times the side (n,), +1 or -1. None where one direction is missing, where the levels of the two
    directions differ such that the parabola alone explains the difference (collinear), or where no degree of freedom
    remains for the residuals."""
    if len(set(side.tolist())) < 2:
        return None
    level_deviation_db = nominal_db - nominal_db.mean()
    design = np.column_stack([side / 2.0, np.ones(len(level_deviation_db)), level_deviation_db, level_deviation_db**2])
    # With one or two levels the parabola is not determined; the difference still is, by the pseudoinverse.
    pseudoinverse = np.linalg.pinv(design)
    rank = int(np.linalg.matrix_rank(design))
    df = len(level_deviation_db) - rank
    if df < 1 or int(np.linalg.matrix_rank(design[:, 1:])) == rank:
        return None
    coefficients = pseudoinverse @ values_db
    residual_db = values_db - design @ coefficients
    residual_sd_db = math.sqrt(float(residual_db @ residual_db) / df)
    return SameLevelFit(
        float(coefficients[0]), residual_sd_db * float(np.linalg.norm(pseudoinverse[0])), df, residual_db
    )
