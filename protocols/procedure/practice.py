"""Criterion of a practice run (short, around a fixed level, before the test): when it ends, and whether it is passed.

Passed with `right_needed` correct answers among the last `of_last`, within `trial_limit` trials (`PracticeSettings`).
The state is immutable: `add_answer` returns the next one.
"""

from dataclasses import dataclass

from protocols.definition.preparation import PracticeSettings


@dataclass(frozen=True, slots=True)
class PracticeState:
    """State of a practice run before its next trial."""

    correct: tuple[bool, ...] = ()
    """Whether each answer so far was correct, in order."""


def add_answer(state: PracticeState, correct: bool) -> PracticeState:
    """Return the state after one more answer."""
    return PracticeState((*state.correct, correct))


def count_right_of_last(settings: PracticeSettings, state: PracticeState) -> int:
    """Count the correct answers among the last `of_last`, or among all while fewer were given."""
    return sum(state.correct[-settings.of_last :])


def is_practice_passed(settings: PracticeSettings, state: PracticeState) -> bool:
    """Whether at least `right_needed` of the last `of_last` answers are correct; also before `of_last` were given."""
    return count_right_of_last(settings, state) >= settings.right_needed


def is_practice_over(settings: PracticeSettings, state: PracticeState) -> bool:
    """Whether the practice has ended: it is passed, or its trial limit is reached."""
    return is_practice_passed(settings, state) or len(state.correct) >= settings.trial_limit
