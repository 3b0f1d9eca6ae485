"""Counts of a study's answers by person, frequency, level and direction: the data of the hierarchical likelihood.

Trials that agree in all four form a cell; with its numbers of right and wrong answers, a cell enters the binomial
likelihood of the psychometric function once instead of trial by trial.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from equalizer.signals.signal import FloatArray
from protocols.trial import Phase, Trial

LEVEL_GRID_DB = 1e-6
"""Levels (dB) that round to the same multiple of this count as equal: the grid absorbs the rounding errors of levels,
and is far finer than any step of a staircase."""

FEWEST_ANSWERS = 20
"""A person with at least this many answers at a frequency counts among the people there (`Answers.has_enough_answers`).
With fewer answers, a person counts if they are at least half of the most that any person has at that frequency, or at
least half of the person's own longest run, where the person has answers at every frequency. Otherwise the run counts as
broken off."""


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """Counts per cell; all arrays are (m,), sorted by run, then level, then direction. Every person has at least one
    cell."""

    subjects: tuple[str, ...]
    """Codes of the persons."""
    frequencies_hz: tuple[float, ...]
    """Ascending; some may have no answer."""
    run: NDArray[np.intp]
    """Index of the run: index of the person times the number of frequencies, plus index of the frequency."""
    level_db: FloatArray
    """Levels in dB re 1 N, or re 1 of the chosen unit."""
    side: FloatArray
    """+1 where direction 1 was shown, -1 for direction 2."""
    right: FloatArray
    """Number of correct answers."""
    wrong: FloatArray
    """Number of wrong answers."""

    @property
    def persons(self) -> int:
        return len(self.subjects)

    @property
    def trials(self) -> int:
        """Number of answers in all cells."""
        return int(self.right.sum() + self.wrong.sum())

    @property
    def person(self) -> NDArray[np.intp]:
        """(m,): index of each cell's person in `subjects`."""
        return self.run // len(self.frequencies_hz)

    @property
    def has_enough_answers(self) -> NDArray[np.bool_]:
        """(persons, frequencies): whether a person has enough answers at a frequency to count as an independent
        observation of the population there; see `FEWEST_ANSWERS`."""
        shape = self.persons, len(self.frequencies_hz)
        trials = np.bincount(self.run, weights=self.right + self.wrong, minlength=math.prod(shape))
        trials = trials.reshape(shape)
        # A person without answers at some frequency stopped early, so that even their longest run may be broken off.
        longest_run = np.where(trials.min(axis=1) > 0, trials.max(axis=1), math.inf)
        reference_count = np.minimum(trials.max(axis=0), longest_run[:, None])
        sufficient: NDArray[np.bool_] = trials >= np.clip(0.5 * reference_count, 1.0, FEWEST_ANSWERS)
        return sufficient


def count_answers(trials: Iterable[Trial], frequencies_hz: Iterable[float]) -> Answers | None:
    """Count all valid answers (`Trial.is_valid`) of the test phase at these frequencies. None without any such answer.

    Answers of an unfinished run count too: where a run stops depends on the answers before, not on the threshold
    itself, so that the stopping rule does not enter the likelihood.
    """
    sorted_hz = tuple(sorted(frequencies_hz))
    rows = [t for t in trials if t.phase is Phase.TEST and t.is_valid and t.frequency_hz in sorted_hz]
    if not rows:
        return None
    subjects = tuple(dict.fromkeys(trial.subject for trial in rows))
    person_index = {subject: index for index, subject in enumerate(subjects)}
    frequency_index = {frequency: index for index, frequency in enumerate(sorted_hz)}
    run = np.array([person_index[t.subject] * len(sorted_hz) + frequency_index[t.frequency_hz] for t in rows])
    level_db = 20.0 * np.log10(np.array([trial.level_n for trial in rows]))
    side = np.array([1.0 if trial.direction_shown == 1 else -1.0 for trial in rows])
    is_correct = np.array([bool(trial.correct) for trial in rows])
    return count_cells(subjects, sorted_hz, run, level_db, side, is_correct)


def count_cells(
    subjects: tuple[str, ...],
    frequencies_hz: tuple[float, ...],
    run: NDArray[np.intp],
    level_db: FloatArray,
    side: FloatArray,
    is_correct: NDArray[np.bool_],
) -> Answers:
    """Count the trials of each cell; run, level_db, side and is_correct: (trials,), at least one, as the fields of
    `Answers`."""
    level_steps = np.round(level_db / LEVEL_GRID_DB).astype(np.int64)
    level_steps -= level_steps.min()
    # One integer key per cell, ordered by run, then level, then side, is quicker to sort than rows of three.
    key = (run.astype(np.int64) * (int(level_steps.max()) + 1) + level_steps) * 2 + (side > 0)
    _, first_trial, cell_index = np.unique(key, return_index=True, return_inverse=True)
    return Answers(
        subjects=subjects,
        frequencies_hz=frequencies_hz,
        run=run[first_trial],
        level_db=level_db[first_trial],
        side=side[first_trial],
        right=np.bincount(cell_index[is_correct], minlength=len(first_trial)).astype(np.float64),
        wrong=np.bincount(cell_index[~is_correct], minlength=len(first_trial)).astype(np.float64),
    )
