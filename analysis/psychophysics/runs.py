"""Recompute the runs of a study from the recorded answers, and check the recorded levels against them.

The rule of the protocol (`protocols.procedure.staircase`: staircase or Psi) is replayed with the recorded answers.
"""

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

from protocols.definition.staircase_rule import StaircaseRule
from protocols.procedure.staircase import (
    StaircaseState,
    begin_staircase,
    compute_level_n,
    is_complete,
    is_finished,
    step,
    to_db,
)
from protocols.trial import PARTICIPANT_CAUSES, Phase, Trial, TrialStatus

LEVEL_TOLERANCE = 1e-4
"""Relative tolerance of a level, about 0.001 dB. Chosen: above rounding in a table, and far below any step."""
ROUNDING_DB = 1e-3
"""Tolerance (dB) of a roved level beyond its range, for rounding in a table. Chosen."""


class InconsistentTrialsError(ValueError):
    """Rows of trials that cannot result from the protocol's rule, or that cannot enter one analysis."""


@dataclass(frozen=True, slots=True)
class Run:
    """One run (staircase or Psi) of one participant at one frequency."""

    subject: str
    session: str
    run: int
    """Number of the run in its session."""
    frequency_hz: float
    answered: tuple[Trial, ...]
    """The valid trials with an answer, in order, without catch trials."""
    spoiled_trials: int
    """Number of presentations with the status SPOILED, without those of catch trials."""
    state: StaircaseState
    """State of the rule after the last answer."""
    complete: bool
    """Whether the run has a threshold by its rule; False where it ended before, as at the trial limit."""
    presentations: int = 0
    """Number of all presentations, including void ones and catch trials."""
    repeats_at_will: int = 0
    """Number of presentations that the participant made void: asked for again, paused, left, answered too late or too
    early."""


def recompute_runs(
    trials: Iterable[Trial], rule: StaircaseRule, phase: Phase = Phase.TEST, rove_db: float = 0.0
) -> tuple[Run, ...]:
    """Recompute all runs of one phase, in the order in which they first occur. rove_db: width (dB) of the range around
    the staircase's level from which the protocol draws the level of a trial; 0 = no roving.

    Catch trials lie within test runs, numbered in the same sequence, and do not move the staircase. Practice runs
    follow no staircase: a caller who passes TRAINING must leave them out of `trials` (see `study_analysis`).

    Raises InconsistentTrialsError naming subject, session, run and trial where a level is not the one that the
    answers before it lead to, or lies outside its roving range, a run has two frequencies, `correct` does not follow
    from an answer, a catch trial was not played at the cap, or a row between others is missing, or one is doubled or
    too many.
    """
    phases = {phase, Phase.CATCH} if phase is Phase.TEST else {phase}
    trials_by_run: dict[tuple[str, str, int], list[Trial]] = {}
    for trial in trials:
        if trial.phase in phases:
            trials_by_run.setdefault((trial.subject, trial.session, trial.run), []).append(trial)
    return tuple(_recompute_run(rows, rule, rove_db) for rows in trials_by_run.values())


def _recompute_run(rows: list[Trial], rule: StaircaseRule, rove_db: float) -> Run:
    """Recompute the run of these rows, at least one, of one subject, session and run number."""
    first_trial = rows[0]
    valid_trials = tuple(sorted((trial for trial in rows if trial.is_valid), key=lambda trial: trial.trial))
    _refuse_inconsistent_rows(rows, valid_trials)
    state = _replay_answers(valid_trials, rule, rove_db)
    staircase_trials = [trial for trial in rows if trial.phase is not Phase.CATCH]
    return Run(
        subject=first_trial.subject,
        session=first_trial.session,
        run=first_trial.run,
        frequency_hz=first_trial.frequency_hz,
        answered=tuple(trial for trial in valid_trials if trial.phase is not Phase.CATCH),
        spoiled_trials=sum(trial.status is TrialStatus.SPOILED for trial in staircase_trials),
        state=state,
        complete=is_complete(rule, state),
        presentations=len(rows),
        repeats_at_will=sum(trial.void_cause in PARTICIPANT_CAUSES for trial in rows),
    )


def _replay_answers(valid_trials: tuple[Trial, ...], rule: StaircaseRule, rove_db: float) -> StaircaseState:
    """Replay the rule with all valid answers, and compare each level with that of the rule. Returns the last state.
    Raises InconsistentTrialsError for another level, an answer after the end of the run, or a `correct` that does not
    follow from the answer."""
    state = begin_staircase(rule)
    for trial in valid_trials:
        if is_finished(rule, state):
            raise InconsistentTrialsError(
                f"{_describe_trial(trial)}: an answer follows although the run was over after {state.trials} trials "
                f"with {state.reversals} reversals"
            )
        if trial.correct is None:
            raise InconsistentTrialsError(f"{_describe_trial(trial)}: there is an answer, but correct is empty")
        if bool(trial.correct) != (trial.answer == trial.direction_shown):
            raise InconsistentTrialsError(
                f"{_describe_trial(trial)}: correct is {bool(trial.correct)}, but {trial.direction_shown} was shown "
                f"and {trial.answer} answered; the row was changed"
            )
        if trial.phase is Phase.CATCH:
            _refuse_weak_catch_trial(trial, rule)
            continue
        expected_n = compute_level_n(rule, state)
        if not math.isclose(trial.staircase_n, expected_n, rel_tol=LEVEL_TOLERANCE):
            column_name = "level_n" if trial.nominal_n is None else "nominal_n"
            raise InconsistentTrialsError(
                f"{_describe_trial(trial)}: {column_name} is {trial.staircase_n:.6g} N, but the answers before it lead "
                f"to {expected_n:.6g} N under the protocol's staircase; the rows belong to another rule or were changed"
            )
        _refuse_level_beyond_roving(trial, rove_db)
        state = step(rule, state, trial.correct)
    return state


def _refuse_level_beyond_roving(trial: Trial, rove_db: float) -> None:
    """Raise InconsistentTrialsError where the level played is farther from the staircase's level (`nominal_n`) than
    half the roving range, or where there is a `nominal_n` without roving. A trial without one is not checked."""
    if trial.nominal_n is None:
        return
    deviation_db = abs(to_db(trial.level_n) - to_db(trial.nominal_n)) if trial.nominal_n > 0 else math.inf
    if rove_db == 0 or deviation_db > rove_db / 2 + ROUNDING_DB:
        roving_text = f"roves by {rove_db / 2:g} dB to either side" if rove_db else "roves no levels"
        raise InconsistentTrialsError(
            f"{_describe_trial(trial)}: level_n is {trial.level_n:.6g} N around a nominal_n of {trial.nominal_n:.6g} "
            f"N, but the protocol {roving_text}; the rows belong to another protocol or were changed"
        )


def _refuse_weak_catch_trial(trial: Trial, rule: StaircaseRule) -> None:
    """Raise InconsistentTrialsError where a catch trial was not played at the cap: it may be a test trial whose phase
    was changed."""
    if not math.isclose(trial.level_n, rule.cap_n, rel_tol=LEVEL_TOLERANCE):
        raise InconsistentTrialsError(
            f"{_describe_trial(trial)}: level_n of a catch trial is {trial.level_n:.6g} N; catch trials are played "
            f"at the cap of {rule.cap_n:g} N"
        )


def _refuse_inconsistent_rows(rows: list[Trial], valid_trials: tuple[Trial, ...]) -> None:
    """Raise InconsistentTrialsError where a run has two frequencies, or valid trials that are doubled or not numbered
    consecutively; the first may have any number."""
    first_trial = rows[0]
    for trial in rows:
        if trial.frequency_hz != first_trial.frequency_hz:
            raise InconsistentTrialsError(
                f"{_describe_trial(trial)}: {trial.frequency_hz:g} Hz in a run that began at "
                f"{first_trial.frequency_hz:g} Hz"
            )
    for previous_trial, next_trial in itertools.pairwise(valid_trials):
        if next_trial.trial == previous_trial.trial:
            raise InconsistentTrialsError(
                f"{_describe_trial(next_trial)}: two attempts of this trial have an answer that counts"
            )
        if next_trial.trial != previous_trial.trial + 1:
            raise InconsistentTrialsError(
                f"{_describe_trial(next_trial)}: the trial before it with an answer is {previous_trial.trial}; those "
                "between are missing"
            )


def _describe_trial(trial: Trial) -> str:
    """Describe the position of a trial, for messages."""
    return f"subject {trial.subject}, session {trial.session}, run {trial.run}, trial {trial.trial}"
