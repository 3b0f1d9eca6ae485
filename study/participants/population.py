"""A population of simulated participants with individual thresholds, whose median rises with frequency up to 35 Hz.

In dB, the threshold of a participant at a frequency is the median of the population plus a normal deviation of the
person plus a normal deviation of person and frequency. All numbers are assumptions of the authors, chosen such that a
study of ten resembles the published figure 2: lowest threshold at 5 Hz, a significant rise at 35 Hz, some participants
at the cap there, 45 Hz similar to 35 Hz. No published threshold is copied.
"""

from dataclasses import replace

import numpy as np

from study.participants.delivered_feeler import DeliveredFeeler
from study.participants.detection_thresholds import TYPICAL_DETECTION_N
from study.participants.direction_feeler import DirectionFeeler
from study.participants.unsure_repeater import UnsureRepeater

TYPICAL_THRESHOLDS_N = ((5.0, 0.35), (15.0, 0.6), (25.0, 0.85), (35.0, 2.2), (45.0, 2.2))
"""Direction thresholds of the median participant: (frequency in Hz, level in N), frequencies ascending. With the
standard deviations below, 19 % of the participants have a threshold above 3 N at 35 Hz."""

PERSON_SD_DB = 2.5
"""Standard deviation (dB) between participants of the deviation that is common to all frequencies of a participant."""
FREQUENCY_SD_DB = 1.7
"""Standard deviation (dB) of the further deviation at each frequency; both together: 3 dB between participants."""
DETECTION_SD_DB = 2.5
"""Standard deviation (dB) of detection thresholds between participants, the same deviation at all frequencies of a
participant, independent of the direction thresholds."""

MEMBER_KINDS = ("person", "delivered", "repeating", "criterion_drift")
"""Kinds of participants: a `DirectionFeeler`; one who perceives the delivered acceleration (`DeliveredFeeler`); one who
asks for a repetition when unsure (`UnsureRepeater`); a `DirectionFeeler` whose criterion drifts."""
CRITERION_DRIFT_SD = 0.3
"""Standard deviation between participants of the drift per 100 trials, in units of the criterion (standard deviations
of the evidence): in a session of 350 trials the criterion moves by about 1."""


def make_member(kind: str, number: int, seed: int) -> DirectionFeeler | DeliveredFeeler | UnsureRepeater:
    """Make participant `number` (from 1) of the population of this seed, as a `kind` of `MEMBER_KINDS`; the thresholds
    are the same for all kinds. The name contains number and seed. Raises ValueError for another kind."""
    feeler, name = draw_person(number, seed), f"{kind}_{number}_seed_{seed}"
    match kind:
        case "person":
            return feeler
        case "delivered":
            return DeliveredFeeler(name, feeler)
        case "repeating":
            return UnsureRepeater(name, feeler)
        case "criterion_drift":
            criterion_drift = CRITERION_DRIFT_SD * float(np.random.default_rng([seed, number, 1]).standard_normal())
            return replace(feeler, name=name, criterion_per_100_trials=criterion_drift)
    raise ValueError(f"a population is made of {', '.join(MEMBER_KINDS)}, not of {kind}")


def draw_person(number: int, seed: int) -> DirectionFeeler:
    """Draw participant `number` (from 1) of the population of this seed. The name contains both numbers, so that the
    participant can be recreated from a log."""
    random = np.random.default_rng([seed, number])
    person_offset_db = random.normal(0.0, PERSON_SD_DB)
    offsets_db = person_offset_db + random.normal(0.0, FREQUENCY_SD_DB, len(TYPICAL_THRESHOLDS_N))
    return DirectionFeeler(
        name=f"person_{number}_seed_{seed}",
        thresholds_n=tuple(
            (frequency_hz, float(threshold_n * 10.0 ** (offset_db / 20.0)))
            for (frequency_hz, threshold_n), offset_db in zip(TYPICAL_THRESHOLDS_N, offsets_db, strict=True)
        ),
        # Slope: log-normal, median 2. Lapse rate: Beta(1, 60), mean 1/61. Criterion: normal. Drift: half-normal.
        slope=float(np.exp(random.normal(np.log(2.0), 0.25))),
        lapse=float(random.beta(1.0, 60.0)),
        criterion=-float(random.normal(0.0, 0.15)),
        drift_db_per_100_trials=float(abs(random.normal(0.0, 0.2))),
        # Drawn last, so that the participants of older studies stay the same.
        detection_n=_shift_thresholds(TYPICAL_DETECTION_N, random.normal(0.0, DETECTION_SD_DB)),
    )


def _shift_thresholds(
    thresholds_n: tuple[tuple[float, float], ...], offset_db: float
) -> tuple[tuple[float, float], ...]:
    """Multiply all levels of thresholds (Hz, N) by 10^(offset_db / 20)."""
    return tuple(
        (frequency_hz, float(threshold_n * 10.0 ** (offset_db / 20.0))) for frequency_hz, threshold_n in thresholds_n
    )
