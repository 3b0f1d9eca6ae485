"""Readings of a clipped sensor: significantly many of them lie at a limit.

The counts at a limit and of repeated readings are compared by `is_unusual_count`, here between the levels of one
recording, in `model_free_faults` with a reference device.
"""

import numpy as np

from analysis.diagnosis.limits import READINGS_DEVIATIONS, READINGS_FACTOR, READINGS_LEAST
from equalizer.signals.signal import FloatArray

READING_TOLERANCE = 1e-9
"""Relative difference up to which readings count as equal to a limit."""
NEXT_LEVEL_COUNT, NEXT_LEVELS_FACTOR = 4, 2.0
"""Number of levels below the largest reading, and least ratio of the readings at the largest to those at any of these,
for a limit (`stays_at_limit`). Chosen: a periodic command repeats its peak, whose few readings one step lower, by
noise, are a level of their own. Compared with the next level alone, 78 of 800 simulated periodic recordings without a
fault would count as clipped; with these, 1 of 1700."""


def stays_at_limit(readings: FloatArray) -> bool:
    """Whether significantly more readings (n,) lie at the highest, at the lowest, or at the largest magnitude than at
    the next level, and than at any of the next `NEXT_LEVEL_COUNT`, as with a clipped sensor. The limits of a converter
    differ by one step, and those of a sensor by its offset. A sine that was rounded has up to 2.4 times as many there,
    which is below `READINGS_FACTOR`."""
    known = readings[np.isfinite(readings) & (readings != 0)]
    return any(_has_limit(side) for side in (known[known > 0], -known[known < 0], np.abs(known)) if len(side))


def _has_limit(magnitudes: FloatArray) -> bool:
    """Whether magnitudes (n,), n >= 1, above 0, stay at the largest. Levels differ by `READING_TOLERANCE` of it."""
    levels = np.round(magnitudes / magnitudes.max() / READING_TOLERANCE)
    *lower_counts, top_count = np.unique(levels, return_counts=True)[1].tolist()
    return bool(lower_counts) and (
        is_unusual_count(top_count, lower_counts[-1])
        and top_count > NEXT_LEVELS_FACTOR * max(lower_counts[-NEXT_LEVEL_COUNT:])
    )


def is_unusual_count(count: int, usual_count: float) -> bool:
    """Whether a count is at least `READINGS_LEAST` and exceeds the usual one by the factor `READINGS_FACTOR` and by
    `READINGS_DEVIATIONS` standard deviations of a Poisson count, sqrt(usual_count)."""
    return (
        count >= READINGS_LEAST
        and count > READINGS_FACTOR * usual_count
        and count > usual_count + READINGS_DEVIATIONS * np.sqrt(usual_count)
    )
