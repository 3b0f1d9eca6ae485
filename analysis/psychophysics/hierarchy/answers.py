"""Counts of a study's answers by person, frequency, level and direction, the data of the likelihood."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from equalizer.signals.signal import FloatArray
from protocols.trial import Phase, Trial

LEVEL_GRID_DB = 1e-6
"""Levels closer than this are one level: rounding in a table, far below any step."""

FEWEST_ANSWERS = 20
"""A person with fewer at a frequency, and with less than half of the most that a person has there, is no independent
witness of its median; but is where none of their runs, at all frequencies, is so much shorter than their longest."""


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """Cells (m,), sorted by run = person * frequencies + frequency. Every person has at least one cell."""

    subjects: tuple[str, ...]
    frequencies_hz: tuple[float, ...]
    run: NDArray[np.intp]
    level_db: FloatArray
    """Levels in dB re 1 N, or re 1 of the chosen unit."""
    side: FloatArray
    """+1 where direction 1 was shown, -1 for direction 2."""
    right: FloatArray
    """Number of correct answers."""
    wrong: FloatArray

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
    def played(self) -> NDArray[np.bool_]:
        """Whether a person has enough answers at a frequency to count among the people there (persons, frequencies)."""
        shape = self.persons, len(self.frequencies_hz)
        trials = np.bincount(self.run, weights=self.right + self.wrong, minlength=math.prod(shape))
        trials = trials.reshape(shape)
        # Of a person who lacks a frequency the longest run shows nothing: it may be broken off, too.
        own = np.where(trials.min(axis=1) > 0, trials.max(axis=1), math.inf)
        most = np.minimum(trials.max(axis=0), own[:, None])
        enough: NDArray[np.bool_] = trials >= np.clip(0.5 * most, 1.0, FEWEST_ANSWERS)
        return enough


def count_answers(trials: Iterable[Trial], frequencies_hz: Iterable[float]) -> Answers | None:
    """All answers that count, of the test phase, at these frequencies: nothing is censored, no participant is dropped.

    None where there is no such answer. Answers of an unfinished run count too: where a run stops depends on the answers
    before, never on the threshold itself.
    """
    wanted = tuple(sorted(frequencies_hz))
    rows = [t for t in trials if t.phase is Phase.TEST and t.counts and t.frequency_hz in wanted]
    if not rows:
        return None
    subjects = tuple(dict.fromkeys(trial.subject for trial in rows))
    number = {subject: index for index, subject in enumerate(subjects)}
    place = {frequency: index for index, frequency in enumerate(wanted)}
    run = np.array([number[t.subject] * len(wanted) + place[t.frequency_hz] for t in rows])
    level_db = 20.0 * np.log10(np.array([trial.level_n for trial in rows]))
    side = np.array([1.0 if trial.direction_shown == 1 else -1.0 for trial in rows])
    right = np.array([bool(trial.correct) for trial in rows])
    return tally(subjects, wanted, run, level_db, side, right)


def tally(
    subjects: tuple[str, ...],
    frequencies_hz: tuple[float, ...],
    run: NDArray[np.intp],
    level_db: FloatArray,
    side: FloatArray,
    right: NDArray[np.bool_],
) -> Answers:
    """Count equal trials together; the arrays have an entry per trial, (trials,)."""
    grid = np.round(level_db / LEVEL_GRID_DB).astype(np.int64)
    grid -= grid.min()
    # Sorted by run, then level, then side: one number per cell is quicker to sort than rows.
    key = (run.astype(np.int64) * (int(grid.max()) + 1) + grid) * 2 + (side > 0)
    _, first, cell = np.unique(key, return_index=True, return_inverse=True)
    return Answers(
        subjects=subjects,
        frequencies_hz=frequencies_hz,
        run=run[first],
        level_db=level_db[first],
        side=side[first],
        right=np.bincount(cell[right], minlength=len(first)).astype(np.float64),
        wrong=np.bincount(cell[~right], minlength=len(first)).astype(np.float64),
    )
