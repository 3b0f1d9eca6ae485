"""The display port: how a session talks to the participant. Implemented by line mode, a screen, and a simulation.

Any method may raise KeyboardInterrupt to leave: the force is released at once, and the session can be resumed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from study.session.views.form_views import Form, FormReply
from study.session.views.views import (
    AfterPause,
    DemoChoice,
    DemoMenu,
    DeviceReport,
    Goodbye,
    HandleView,
    PauseNotice,
    PlayingNotice,
    PracticeResult,
    Question,
    Reply,
    RestNotice,
    Unanswered,
    Welcome,
)

if TYPE_CHECKING:
    from study.session.state.due_trial import Present

SignOfLife = Callable[[], bool]
"""To be called at least every 100 ms while waiting: it keeps the device alive and takes requests to stop or pause.
False: something ended the wait (a fault, a request, a device button); return at once with any reply."""


class Display(Protocol):
    """Interface of the participant's screen: shows notices, forms and questions, and waits for the replies."""

    def fill_in(self, form: Form) -> FormReply:
        """Show a form. Returns when every required field has an answer that is one of its choices."""
        ...

    def device_checked(self, report: DeviceReport) -> bool:
        """Show the findings. True: go on. False: check again."""
        ...

    def welcome(self, notice: Welcome) -> None:
        """Instructions. Returns when the participant is ready."""
        ...

    def choose_demo(self, menu: DemoMenu, sign_of_life: SignOfLife) -> DemoChoice:
        """Choose the next demonstration, if any."""
        ...

    def show_playing(self, notice: PlayingNotice, sign_of_life: SignOfLife) -> Unanswered | None:
        """Wait while something of a fixed length plays. None when its time is over; else why it was cut short."""
        ...

    def await_handle(self, look: Callable[[], HandleView], sign_of_life: SignOfLife) -> Unanswered | None:
        """Wait until `look().ready`, checking about every 100 ms. None when it is; else why the wait was cut short."""
        ...

    def ask(self, question: Question, sign_of_life: SignOfLife) -> Reply:
        """Wait for the answer 1 or 2."""
        ...

    def feedback(self, correct: bool) -> None:
        """Show whether the answer was right. Only where the protocol gives feedback."""
        ...

    def practice_over(self, result: PracticeResult) -> None:
        """Show a notice. Returns when the participant has read it."""
        ...

    def rest(self, notice: RestNotice, sign_of_life: SignOfLife) -> float:
        """An enforced rest; returns the seconds rested. Fewer than `notice.seconds` only where `sign_of_life` ended
        it."""
        ...

    def pause(self, notice: PauseNotice, sign_of_life: SignOfLife) -> AfterPause:
        """Show a pause: nothing is played until the participant decides how to continue. LEAVE where `sign_of_life`
        ended the wait."""
        ...

    def await_return(self, reason: str) -> None:
        """Wait, after a void trial, until the participant is ready."""
        ...

    def goodbye(self, notice: Goodbye) -> None:
        """Show the end of the sitting."""
        ...

    def trouble(self, sentence: str) -> None:
        """Show a message that does not end the session."""
        ...


class Hand(Protocol):
    """The hand on the handle. A person feels the device; a simulated hand is given the stimulus."""

    def feel(self, stimulus: Present, answers_before: int) -> None:
        """Told what is played: as soon as a stimulus is held; in a detection trial, before its first interval.
        answers_before: answers of the session so far, training included."""
        ...


class PersonsHand:
    """A person's hand, which needs no information."""

    def feel(self, stimulus: Present, answers_before: int) -> None:
        return None
