"""Runs recomputed from the raw answers: the levels in the rows are checked, never trusted."""

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

from protocols.staircase import StaircaseState, begin, finished, level_n, step
from protocols.staircase_rule import StaircaseRule
from protocols.trial import Phase, Trial, TrialStatus

LEVEL_TOLERANCE = 1e-4
"""Relative: a thousandth of a dB. Covers rounding in a table, and is far below any step."""


class InconsistentTrialsError(ValueError):
    """Rows that cannot have come from the stated rule."""


@dataclass(frozen=True, slots=True)
class Run:
    """One staircase of one participant at one frequency."""

    subject: str
    session: str
    run: int
    frequency_hz: float
    answered: tuple[Trial, ...]
    """The trials that moved the staircase, in order."""
    spoiled_trials: int
    state: StaircaseState
    """Where the staircase stands after the last of them."""
    complete: bool
    """Whether the run has all reversals of its rule; one that ran out of trials has not."""


def recompute_runs(trials: Iterable[Trial], rule: StaircaseRule, phase: Phase = Phase.TEST) -> tuple[Run, ...]:
    """All runs of one phase, in the order in which they first occur.

    Raises InconsistentTrialsError naming subject, session, run and trial where a level is not the one that the
    answers before it lead to, or where a row is missing, doubled or too many.
    """
    grouped: dict[tuple[str, str, int], list[Trial]] = {}
    for trial in trials:
        if trial.phase is phase:
            grouped.setdefault((trial.subject, trial.session, trial.run), []).append(trial)
    return tuple(_recompute(rows, rule) for rows in grouped.values())


def _recompute(rows: list[Trial], rule: StaircaseRule) -> Run:
    first = rows[0]
    answered = tuple(sorted((trial for trial in rows if trial.counts), key=lambda trial: trial.trial))
    _refuse_strange_rows(rows, answered)
    state = _fold(answered, rule)
    return Run(
        subject=first.subject,
        session=first.session,
        run=first.run,
        frequency_hz=first.frequency_hz,
        answered=answered,
        spoiled_trials=sum(trial.status is TrialStatus.SPOILED for trial in rows),
        state=state,
        complete=state.reversals >= rule.reversals,
    )


def _fold(answered: tuple[Trial, ...], rule: StaircaseRule) -> StaircaseState:
    state = begin(rule)
    for trial in answered:
        if finished(rule, state):
            raise InconsistentTrialsError(
                f"{_place(trial)}: an answer follows although the run was over after {state.trials} trials "
                f"with {state.reversals} reversals"
            )
        expected_n = level_n(rule, state)
        if not math.isclose(trial.level_n, expected_n, rel_tol=LEVEL_TOLERANCE):
            raise InconsistentTrialsError(
                f"{_place(trial)}: level_n is {trial.level_n:.6g} N, but the answers before it lead to "
                f"{expected_n:.6g} N under the protocol's staircase; the rows belong to another rule or were changed"
            )
        if trial.correct is None:
            raise InconsistentTrialsError(f"{_place(trial)}: there is an answer, but correct is empty")
        state = step(rule, state, trial.correct)
    return state


def _refuse_strange_rows(rows: list[Trial], answered: tuple[Trial, ...]) -> None:
    first = rows[0]
    for trial in rows:
        if trial.frequency_hz != first.frequency_hz:
            raise InconsistentTrialsError(
                f"{_place(trial)}: {trial.frequency_hz:g} Hz in a run that began at {first.frequency_hz:g} Hz"
            )
    for before, after in itertools.pairwise(answered):
        if after.trial == before.trial:
            raise InconsistentTrialsError(f"{_place(after)}: two attempts of this trial have an answer that counts")
        if after.trial != before.trial + 1:
            raise InconsistentTrialsError(
                f"{_place(after)}: the trial before it with an answer is {before.trial}; those between are missing"
            )


def _place(trial: Trial) -> str:
    return f"subject {trial.subject}, session {trial.session}, run {trial.run}, trial {trial.trial}"
