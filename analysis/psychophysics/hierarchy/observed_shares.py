"""Observed shares of right answers by level, and fitted curves, for figures of psychometric functions.

Levels are binned; each bin has the share of right answers with Wilson's 95 % interval. The curve of a person is the
probability of a right answer of `curve.compute_proportion_correct`, averaged over both directions.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.psychophysics.catch_trials import compute_wilson_interval
from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import (
    NEPER_PER_DB,
    T_AT_THRESHOLD,
    Family,
    compute_proportion_correct,
    differentiate_evidence,
)
from analysis.psychophysics.hierarchy.primary import PersonEstimate
from equalizer.signals.signal import FloatArray
from protocols.procedure.staircase import to_db

BIN_DB = 2.0
"""Width of a bin of levels: two small steps of the published staircase."""


class FittedCurves(Protocol):
    """The part of a fit that figures need: `PrimaryAnalysis` of a study, or `SinglePersons`."""

    @property
    def frequencies_hz(self) -> tuple[float, ...]:
        """Frequencies with answers, ascending."""

    @property
    def persons(self) -> tuple[PersonEstimate, ...]:
        """Estimates of each person, in the order of `Answers.subjects`."""

    @property
    def lapse(self) -> float:
        """Lapse rate common to all persons, 0 to 1."""

    @property
    def family(self) -> Family:
        """Family of the psychometric functions."""


@dataclass(frozen=True, slots=True)
class ObservedShare:
    """Right answers among the trials of a bin of levels, with Wilson's 95 % interval."""

    level_db: float
    """Mean over the trials of the bin, re 1 N or re each person's threshold."""
    trials: int
    right: int
    lower: float
    """Lower end of Wilson's 95 % interval of the share."""
    upper: float
    """Upper end of that interval."""

    @property
    def share(self) -> float:
        """Share of right answers, 0 to 1."""
        return self.right / self.trials


def compute_person_shares(answers: Answers, person: int, frequency_index: int) -> tuple[ObservedShare, ...]:
    """Compute the observed shares of a person at one frequency, by bins of levels in dB re 1 N, ascending. person,
    frequency_index: indices of the person and the frequency. Empty without answers."""
    return _bin_shares(answers, answers.run == person * len(answers.frequencies_hz) + frequency_index, answers.level_db)


def compute_group_shares(answers: Answers, fit: FittedCurves, frequency_index: int) -> tuple[ObservedShare, ...]:
    """Compute the observed shares of all people at one frequency, over levels in dB re each person's fitted threshold.

    Over absolute levels the shares would be nearly constant: a staircase keeps each person near 79 %, so that low
    levels come from sensitive people and high levels from insensitive people.
    """
    thresholds_db = np.array([to_db(person.thresholds_n[frequency_index]) for person in fit.persons])
    at_frequency = answers.run % len(answers.frequencies_hz) == frequency_index
    return _bin_shares(answers, at_frequency, answers.level_db - thresholds_db[answers.person])


def average_person_curves(
    above_db: FloatArray, answers: Answers, fit: FittedCurves, frequency_index: int
) -> FloatArray:
    """Average the persons' curves at one frequency, weighted by their trials there. above_db: levels re the threshold,
    (p,). Raises ZeroDivisionError where the frequency has no answers."""
    at_frequency = answers.run % len(answers.frequencies_hz) == frequency_index
    trial_counts = np.bincount(
        answers.person[at_frequency], (answers.right + answers.wrong)[at_frequency], minlength=answers.persons
    )
    mean_curve: FloatArray = np.average(
        [evaluate_person_curve(above_db, person, fit) for person in fit.persons], axis=0, weights=trial_counts
    )
    return mean_curve


def evaluate_person_curve(above_db: FloatArray, person: PersonEstimate, fit: FittedCurves) -> FloatArray:
    """Evaluate the probability of a right answer, the mean over both directions. above_db: levels re the threshold, any
    shape."""
    q = differentiate_evidence(T_AT_THRESHOLD[fit.family] + person.slope * NEPER_PER_DB * above_db, fit.family)[0]
    return (
        compute_proportion_correct(q - person.criterion, fit.lapse)
        + compute_proportion_correct(q + person.criterion, fit.lapse)
    ) / 2.0


def _bin_shares(answers: Answers, selected: NDArray[np.bool_], level_db: FloatArray) -> tuple[ObservedShare, ...]:
    """Compute the shares of the selected cells by bins of `level_db`. selected, level_db: (m,), an entry per cell."""
    selected_level_db, correct_counts, trial_counts = (
        level_db[selected],
        answers.right[selected],
        (answers.right + answers.wrong)[selected],
    )
    bin_numbers, shares = np.round(selected_level_db / BIN_DB), []
    for bin_number in np.unique(bin_numbers):
        in_bin = bin_numbers == bin_number
        answer_count, correct_count = int(trial_counts[in_bin].sum()), int(correct_counts[in_bin].sum())
        mean_level_db = float(np.average(selected_level_db[in_bin], weights=trial_counts[in_bin]))
        shares.append(
            ObservedShare(
                mean_level_db, answer_count, correct_count, *compute_wilson_interval(correct_count, answer_count)
            )
        )
    return tuple(shares)
