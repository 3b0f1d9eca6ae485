"""Practice runs: short, at a fixed level, passed or not. They enter no result."""

from collections.abc import Iterable
from dataclasses import dataclass

from protocols.definition.study_protocol import StudyProtocol
from protocols.procedure.practice import PracticeState, practice_over, practice_passed, right_of_last
from protocols.trial import Phase, Trial


@dataclass(frozen=True, slots=True)
class PracticeRun:
    subject: str
    session: str
    run: int
    frequency_hz: float
    trials: int
    """Answered and counted."""
    right: int
    right_of_last: int
    """Of the last trials that the criterion looks at."""
    passed: bool
    over: bool
    """False: broken off before it was passed or out of trials."""


def practice_runs(trials: Iterable[Trial], protocol: StudyProtocol) -> tuple[PracticeRun, ...]:
    """In the order in which they first occur. Practice has the phase TRAINING and follows the training staircases."""
    first = len(protocol.training.frequencies_hz)
    places = range(first, first + len(protocol.practice.frequencies_hz))
    grouped: dict[tuple[str, str, int], list[Trial]] = {}
    for trial in trials:
        if trial.phase is Phase.TRAINING and trial.run in places:
            grouped.setdefault((trial.subject, trial.session, trial.run), []).append(trial)
    return tuple(_practice_run(rows, protocol) for rows in grouped.values())


def _practice_run(rows: list[Trial], protocol: StudyProtocol) -> PracticeRun:
    first, settings = rows[0], protocol.practice
    counted = sorted((trial for trial in rows if trial.counts), key=lambda trial: trial.trial)
    state = PracticeState(tuple(bool(trial.correct) for trial in counted))
    return PracticeRun(
        subject=first.subject,
        session=first.session,
        run=first.run,
        frequency_hz=first.frequency_hz,
        trials=len(counted),
        right=sum(state.correct),
        right_of_last=right_of_last(settings, state),
        passed=practice_passed(settings, state),
        over=practice_over(settings, state),
    )
