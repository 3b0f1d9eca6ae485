"""A population of simulated participants with individual thresholds that rise with frequency.

All numbers are assumptions of the authors, chosen such that a study of ten resembles the published figure 2: lowest
threshold at 5 Hz, a significant rise at 35 Hz, some participants at the cap there, 45 Hz similar to 35 Hz. No published
threshold is copied.
"""

from dataclasses import replace

import numpy as np

from study.participants.delivered_feeler import DeliveredFeeler
from study.participants.detection import TYPICAL_DETECTION_N
from study.participants.direction_feeler import DirectionFeeler
from study.participants.unsure import UnsureRepeater

TYPICAL_THRESHOLDS_N = ((5.0, 0.35), (15.0, 0.6), (25.0, 0.85), (35.0, 2.2), (45.0, 2.2))
"""(Hz, N): the median participant. A quarter of the participants is above the cap of 3 N at 35 Hz."""

SPREAD_OF_PERSON_DB = 2.5
"""Standard deviation between participants, common to all frequencies."""
SPREAD_OF_FREQUENCY_DB = 1.7
"""Standard deviation per frequency. Together 3 dB between participants."""
SPREAD_OF_DETECTION_DB = 2.5
"""Standard deviation of detection thresholds between participants, at all frequencies; independent of the direction
thresholds."""


def population(n: int, seed: int) -> tuple[DirectionFeeler, ...]:
    """n participants; the first ones do not change when n grows."""
    return tuple(person(number, seed) for number in range(1, n + 1))


KINDS = ("person", "delivered", "repeating", "criterion_drift")
"""What a population can be made of: as they are; feeling what was delivered; asking again when unsure; with a criterion
that drifts."""
CRITERION_DRIFT_SD = 0.3
"""Per 100 trials, between participants: a session of 350 trials moves a criterion by about 1."""


def member(kind: str, number: int, seed: int) -> DirectionFeeler | DeliveredFeeler | UnsureRepeater:
    """Participant `number` (from 1) of the population of this seed, made `kind` of `KINDS`, with the same thresholds.
    The name contains all three."""
    one, name = person(number, seed), f"{kind}_{number}_seed_{seed}"
    match kind:
        case "person":
            return one
        case "delivered":
            return DeliveredFeeler(name, one)
        case "repeating":
            return UnsureRepeater(name, one)
        case "criterion_drift":
            drift = CRITERION_DRIFT_SD * float(np.random.default_rng([seed, number, 1]).standard_normal())
            return replace(one, name=name, criterion_per_100_trials=drift)
    raise ValueError(f"a population is made of {', '.join(KINDS)}, not of {kind}")


def person(number: int, seed: int) -> DirectionFeeler:
    """Participant `number` (from 1) of the population of this seed; the name contains both, so that a log can
    recreate it."""
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
        # Drawn last, so that the participants of older studies stay the same.
        detection_n=_shift_thresholds(TYPICAL_DETECTION_N, rng.normal(0.0, SPREAD_OF_DETECTION_DB)),
    )


def _shift_thresholds(
    thresholds_n: tuple[tuple[float, float], ...], offset_db: float
) -> tuple[tuple[float, float], ...]:
    """Thresholds (Hz, N) changed by an offset in dB."""
    return tuple((frequency_hz, float(n * 10.0 ** (offset_db / 20.0))) for frequency_hz, n in thresholds_n)
