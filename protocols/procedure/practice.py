"""Short practice run around a fixed level, before the test: when it ends, and whether it was passed.

Criterion: `right_needed` correct answers among the last `of_last`, within `trial_limit` trials (`PracticeSettings`).
The state is a value: `add_answer` returns the next one.
"""

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


def count_right_of_last(settings: PracticeSettings, state: PracticeState) -> int:
    """Number of correct answers among the last `of_last`."""
    return sum(state.correct[-settings.of_last :])


def is_practice_passed(settings: PracticeSettings, state: PracticeState) -> bool:
    """Whether at least `right_needed` of the last `of_last` answers are correct."""
    return count_right_of_last(settings, state) >= settings.right_needed


def is_practice_over(settings: PracticeSettings, state: PracticeState) -> bool:
    """Whether the practice has ended: it is passed, or its trial limit is reached."""
    return is_practice_passed(settings, state) or len(state.correct) >= settings.trial_limit
