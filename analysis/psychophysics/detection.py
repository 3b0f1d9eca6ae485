"""Detection thresholds from two-interval forced choice: one of two intervals of each trial holds a stimulus.

Chance is 50 %, as in direction identification, so the same staircase converges at the same proportion correct.
Sensitivity is d' = (z(H) - z(F)) / sqrt(2). Direction thresholds are then expressed in dB above detection. A threshold
is censored ("cut") where the force cap limited its staircase (`thresholds.Threshold.censored`).

Source of the two-interval sensitivity: N. A. Macmillan, C. D. Creelman, Detection Theory: A User's Guide, 2nd ed.
(2005), chapter 7.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from analysis.psychophysics.runs import recompute_runs
from analysis.psychophysics.threshold_table import ThresholdTable
from analysis.psychophysics.thresholds import Threshold, compute_run_threshold
from protocols.definition.study_protocol import StudyProtocol
from protocols.procedure.run_rules import make_staircase_rule
from protocols.procedure.staircase import to_db
from protocols.trial import Phase, Trial


@dataclass(frozen=True, slots=True)
class ThresholdBelowDetection:
    """A direction threshold below the detection threshold of the same participant and frequency, which is not
    plausible: a direction cannot be identified without detection."""

    subject: str
    frequency_hz: float
    direction_n: float
    """Direction threshold, N."""
    detection_n: float
    """Detection threshold, N."""


def compute_detection_thresholds(trials: Iterable[Trial], protocol: StudyProtocol) -> tuple[Threshold, ...]:
    """Compute the threshold of each detection run. `d_prime` is that of two intervals; criterion as in
    `analysis.psychophysics.bias`.

    Raises InconsistentTrialsError (a ValueError) where the trials contradict the staircase rule.
    """
    detection_trials = [trial for trial in trials if trial.phase is Phase.DETECTION]
    if not detection_trials:
        # Without detection runs there may be no rule: the cap may be below the default of detection.start_n.
        return ()
    rule = make_staircase_rule(protocol, Phase.DETECTION)
    thresholds = (compute_run_threshold(run, rule) for run in recompute_runs(detection_trials, rule, Phase.DETECTION))
    # The decision depends on the difference of two intervals, whose variance is twice that of one.
    return tuple(
        threshold if threshold.d_prime is None else replace(threshold, d_prime=threshold.d_prime / math.sqrt(2))
        for threshold in thresholds
    )


def compute_thresholds_above_detection(direction: ThresholdTable, detection: ThresholdTable) -> ThresholdTable:
    """Express direction thresholds in dB above the detection threshold of the same participant and frequency; None
    where either is missing, or the detection threshold is censored, so that the value could only be too high. Both
    tables in newtons. A value is censored where the direction threshold is."""
    rows_db = []
    for subject, row in zip(direction.subjects, direction.values, strict=True):
        detection_cells = [detection.look_up(subject, frequency_hz) for frequency_hz in direction.frequencies_hz]
        rows_db.append(
            tuple(
                None if threshold is None or detection_n is None or is_cut else to_db(threshold) - to_db(detection_n)
                for threshold, (detection_n, is_cut) in zip(row, detection_cells, strict=True)
            )
        )
    return replace(direction, quantity="above_detection_db", values=tuple(rows_db), notes=())


def find_thresholds_below_detection(
    direction: ThresholdTable, detection: ThresholdTable
) -> tuple[ThresholdBelowDetection, ...]:
    """Find participants and frequencies whose direction threshold lies below their detection threshold. Both tables in
    newtons; censored direction thresholds are left out."""
    detection_thresholds_n = {
        (subject, frequency_hz): threshold_n
        for subject, row in zip(detection.subjects, detection.values, strict=True)
        for frequency_hz, threshold_n in zip(detection.frequencies_hz, row, strict=True)
        if threshold_n is not None
    }
    return tuple(
        ThresholdBelowDetection(subject, frequency_hz, threshold_n, detection_thresholds_n[subject, frequency_hz])
        for subject, row, censored_flags in zip(direction.subjects, direction.values, direction.censored, strict=True)
        for frequency_hz, threshold_n, is_censored in zip(direction.frequencies_hz, row, censored_flags, strict=True)
        if threshold_n is not None
        and not is_censored
        and threshold_n < detection_thresholds_n.get((subject, frequency_hz), 0.0)
    )
