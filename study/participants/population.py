"""Simulated participants who differ as people do, with thresholds that rise with frequency.

All numbers are ours. They are chosen so that a study of ten looks like the published figure 2 in its main lines:
lowest at 5 Hz, a significant rise at 35 Hz, some who never find the direction there and end at the cap, 45 Hz much
like 35 Hz. No published threshold is copied.
"""

import numpy as np

from study.participants.detection import TYPICAL_DETECTION_N
from study.participants.direction_feeler import DirectionFeeler

TYPICAL_THRESHOLDS_N = ((5.0, 0.35), (15.0, 0.6), (25.0, 0.85), (35.0, 2.2), (45.0, 2.2))
"""(Hz, N): the median participant. A fourth of the participants lies above the cap of 3 N at 35 Hz."""

SPREAD_OF_PERSON_DB = 2.5
"""Standard deviation of what makes one person better or worse at all frequencies."""
SPREAD_OF_FREQUENCY_DB = 1.7
"""And of what differs from frequency to frequency. Together 3 dB between participants."""
SPREAD_OF_DETECTION_DB = 2.5
"""Standard deviation of what makes one person feel weaker vibrations than another, at all frequencies. Nothing of it
is shared with the sense of direction."""


def population(n: int, seed: int) -> tuple[DirectionFeeler, ...]:
    """n participants. The first ones do not change when n grows."""
    return tuple(person(number, seed) for number in range(1, n + 1))


def person(number: int, seed: int) -> DirectionFeeler:
    """One of the population of this seed, numbered from 1; the name says both, so that a log can call it back."""
    rng = np.random.default_rng([seed, number])
    person_db = rng.normal(0.0, SPREAD_OF_PERSON_DB)
    offsets_db = person_db + rng.normal(0.0, SPREAD_OF_FREQUENCY_DB, len(TYPICAL_THRESHOLDS_N))
    return DirectionFeeler(
        name=f"person_{number}_seed_{seed}",
        thresholds_n=tuple(
            (frequency_hz, float(threshold_n * 10.0 ** (offset_db / 20.0)))
            for (frequency_hz, threshold_n), offset_db in zip(TYPICAL_THRESHOLDS_N, offsets_db, strict=True)
        ),
        slope=float(np.exp(rng.normal(np.log(2.0), 0.25))),
        lapse=float(rng.beta(1.0, 60.0)),
        criterion=-float(rng.normal(0.0, 0.15)),
        drift_db_per_100_trials=float(abs(rng.normal(0.0, 0.2))),
        # Drawn last, so that the people of older studies are still the same.
        detection_n=_shifted(TYPICAL_DETECTION_N, rng.normal(0.0, SPREAD_OF_DETECTION_DB)),
    )


def _shifted(thresholds_n: tuple[tuple[float, float], ...], offset_db: float) -> tuple[tuple[float, float], ...]:
    return tuple((frequency_hz, float(n * 10.0 ** (offset_db / 20.0))) for frequency_hz, n in thresholds_n)
