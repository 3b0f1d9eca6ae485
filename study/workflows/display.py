"""The display port: how a session talks with whoever answers. A line-mode prompt, a screen, or a simulation."""

from collections.abc import Callable
from typing import Protocol

from study.session.due_trial import Present
from study.session.views import Goodbye, Question, Reply, RestNotice, Welcome

SignOfLife = Callable[[], bool]
"""To be called at least every 100 ms while waiting: it keeps the device alive. False: a fault ended the stimulus."""


class Display(Protocol):
    def welcome(self, notice: Welcome) -> None:
        """Returns when the participant is ready. Raises KeyboardInterrupt to leave."""
        ...

    def ask(self, question: Question, sign_of_life: SignOfLife) -> Reply:
        """Wait for 1 or 2. Must return at once when `sign_of_life()` is False."""
        ...

    def feedback(self, correct: bool) -> None: ...

    def rest(self, notice: RestNotice) -> float:
        """An enforced rest; returns the seconds rested, never fewer than `notice.seconds`."""
        ...

    def await_return(self, reason: str) -> None:
        """Nothing is played until somebody is there. Raises KeyboardInterrupt to leave."""
        ...

    def goodbye(self, notice: Goodbye) -> None: ...

    def trouble(self, sentence: str) -> None:
        """Something to know that does not end the session."""
        ...


class Hand(Protocol):
    """What holds the handle. A person feels by being there; a simulated participant must be told."""

    def feel(self, stimulus: Present, answers_before: int) -> None: ...


class PersonsHand:
    """Feels without the program's help."""

    def feel(self, stimulus: Present, answers_before: int) -> None:
        return None
