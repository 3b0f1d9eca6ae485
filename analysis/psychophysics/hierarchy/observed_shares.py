"""Observed shares of right answers by level, and fitted curves, for figures of psychometric functions.

Levels are binned; each bin has the share of right answers with Wilson's 95 % interval. The curve of a person is the
probability of a right answer of `curve.share_right`, averaged over both directions.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.psychophysics.catch_trials import wilson_interval
from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import AT_THRESHOLD, NEPER_PER_DB, Family, sensitivity, share_right
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
    upper: float
    """Wilson's 95 % interval of the share."""

    @property
    def share(self) -> float:
        """Share of right answers, 0 to 1."""
        return self.right / self.trials


def shares_of_person(answers: Answers, person: int, place: int) -> tuple[ObservedShare, ...]:
    """Observed shares of a person at one frequency, by bins of levels in dB re 1 N, ascending. person, place: indices
    of the person and the frequency. Empty without answers."""
    return _shares(answers, answers.run == person * len(answers.frequencies_hz) + place, answers.level_db)


def shares_of_people(answers: Answers, fit: FittedCurves, place: int) -> tuple[ObservedShare, ...]:
    """Observed shares of all people at one frequency, over levels in dB re each person's own threshold by the model.

    Over absolute levels the shares would be nearly constant: a staircase keeps each person near 79 %, so that low
    levels come from sensitive people and high levels from insensitive people.
    """
    thresholds_db = np.array([to_db(person.thresholds_n[place]) for person in fit.persons])
    chosen = answers.run % len(answers.frequencies_hz) == place
    return _shares(answers, chosen, answers.level_db - thresholds_db[answers.person])


def people_curve(above_db: FloatArray, answers: Answers, fit: FittedCurves, place: int) -> FloatArray:
    """Mean of the persons' curves at one frequency, weighted by their trials there. above_db: re the threshold."""
    chosen = answers.run % len(answers.frequencies_hz) == place
    trials = np.bincount(answers.person[chosen], (answers.right + answers.wrong)[chosen], minlength=answers.persons)
    mean: FloatArray = np.average([person_curve(above_db, each, fit) for each in fit.persons], axis=0, weights=trials)
    return mean


def person_curve(above_db: FloatArray, person: PersonEstimate, fit: FittedCurves) -> FloatArray:
    """Probability of a right answer, the mean over both directions. above_db: levels re the threshold, any shape."""
    q = sensitivity(AT_THRESHOLD[fit.family] + person.slope * NEPER_PER_DB * above_db, fit.family)[0]
    return (share_right(q - person.criterion, fit.lapse) + share_right(q + person.criterion, fit.lapse)) / 2.0


def _shares(answers: Answers, chosen: NDArray[np.bool_], level_db: FloatArray) -> tuple[ObservedShare, ...]:
    """Shares of the chosen cells by bins of `level_db`. chosen, level_db: (m,), an entry per cell."""
    level, right, trials = level_db[chosen], answers.right[chosen], (answers.right + answers.wrong)[chosen]
    bins, found = np.round(level / BIN_DB), []
    for number in np.unique(bins):
        inside = bins == number
        given, good = int(trials[inside].sum()), int(right[inside].sum())
        middle = float(np.average(level[inside], weights=trials[inside]))
        found.append(ObservedShare(middle, given, good, *wilson_interval(good, given)))
    return tuple(found)
