"""A short practice at a fixed level: when it is over, and whether it was passed."""

from dataclasses import dataclass

from protocols.definition.preparation import PracticeSettings


@dataclass(frozen=True, slots=True)
class PracticeState:
    """Where one practice run stands before its next trial."""

    correct: tuple[bool, ...] = ()
    """Of all answers so far, in order."""


def practised(state: PracticeState, correct: bool) -> PracticeState:
    return PracticeState((*state.correct, correct))


def right_of_last(settings: PracticeSettings, state: PracticeState) -> int:
    return sum(state.correct[-settings.of_last :])


def practice_passed(settings: PracticeSettings, state: PracticeState) -> bool:
    return right_of_last(settings, state) >= settings.right_needed


def practice_over(settings: PracticeSettings, state: PracticeState) -> bool:
    return practice_passed(settings, state) or len(state.correct) >= settings.trial_limit
