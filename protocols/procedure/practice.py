"""A short practice at a fixed level: when it ends, and whether it was passed."""

from dataclasses import dataclass

from protocols.definition.preparation import PracticeSettings


@dataclass(frozen=True, slots=True)
class PracticeState:
    """State of a practice run before its next trial."""

    correct: tuple[bool, ...] = ()
    """Whether each answer so far was correct, in order."""


def add_answer(state: PracticeState, correct: bool) -> PracticeState:
    """The state after one more answer."""
    return PracticeState((*state.correct, correct))


def right_of_last(settings: PracticeSettings, state: PracticeState) -> int:
    """Number of right answers among the last `of_last`."""
    return sum(state.correct[-settings.of_last :])


def practice_passed(settings: PracticeSettings, state: PracticeState) -> bool:
    """Whether enough of the last answers are right."""
    return right_of_last(settings, state) >= settings.right_needed


def practice_over(settings: PracticeSettings, state: PracticeState) -> bool:
    """Whether the practice is passed or its trial limit reached."""
    return practice_passed(settings, state) or len(state.correct) >= settings.trial_limit
