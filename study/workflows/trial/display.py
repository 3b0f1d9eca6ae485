"""Interfaces from a session to the participant: display (notices, forms, questions) and hand (receives the stimulus).

The display is implemented by line mode (`study.tui.line_mode`), by the screen (`study.tui.engine.remote_display`) and
by a simulated participant (`workflows.session.simulated_display`). A method of a display may raise KeyboardInterrupt to
leave: the force is released at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from study.session.views.form_views import Form, FormReply
from study.session.views.participant_views import (
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
    from study.session.state.due_trial import PresentTrial

SignOfLife = Callable[[], bool]
"""Keep-alive callback, which a display calls at least every 100 ms while it waits: it resets the device's watchdog and
reads requests to stop or pause. Where it returns False (a fault, a request, a device button), the display returns at
once, with any reply."""


class Display(Protocol):
    """Interface of the participant's screen: shows notices, forms and questions, and waits for the replies."""

    def listen_with(self, listen: Callable[[], None]) -> None:
        """Set the function that is called at least every 100 ms in each further wait without a sign of life: forms,
        notices, the goodbye. It takes requests; an error that it raises ends the wait and is raised to the caller."""
        ...

    def fill_in(self, form: Form) -> FormReply:
        """Show a form and return its answers, when every required field has a valid one."""
        ...

    def device_checked(self, report: DeviceReport) -> bool:
        """Show the findings of the device check and wait for the choice: True to continue, False to repeat the
        check."""
        ...

    def welcome(self, notice: Welcome) -> None:
        """Show the instructions. Returns when the participant is ready."""
        ...

    def choose_demo(self, menu: DemoMenu, sign_of_life: SignOfLife) -> DemoChoice:
        """Return the participant's choice: the next demonstration, or the end of the demonstration."""
        ...

    def show_playing(self, notice: PlayingNotice, sign_of_life: SignOfLife) -> Unanswered | None:
        """Show a notice during a stimulus or interval of fixed duration. Returns None when its time is over, else the
        reason for the early end."""
        ...

    def await_handle(self, look: Callable[[], HandleView], sign_of_life: SignOfLife) -> Unanswered | None:
        """Wait until the handle is in position: `look().ready`. Returns None then, else the reason for the early
        end."""
        ...

    def ask(self, question: Question, sign_of_life: SignOfLife) -> Reply:
        """Show the question and wait for the answer, 1 or 2. Returns it, or the reason why there is none."""
        ...

    def feedback(self, correct: bool) -> None:
        """Show whether the answer was right. Called only where the protocol gives feedback."""
        ...

    def practice_over(self, result: PracticeResult) -> None:
        """Show the result of a practice. Returns when the participant confirms."""
        ...

    def rest(self, notice: RestNotice, sign_of_life: SignOfLife) -> float:
        """Show an enforced rest; returns its duration (s), less than `notice.seconds` only where `sign_of_life` ended
        it."""
        ...

    def pause(self, notice: PauseNotice, sign_of_life: SignOfLife) -> AfterPause:
        """Show a pause, during which nothing is played, and return how the participant continues.
        `AfterPause.END_SITTING` where `sign_of_life` ended the wait."""
        ...

    def await_return(self, reason: str) -> None:
        """Show the reason for a void trial, and wait until the participant is ready."""
        ...

    def goodbye(self, notice: Goodbye) -> None:
        """Show the end of the sitting."""
        ...

    def trouble(self, sentence: str) -> None:
        """Show a message that does not end the session."""
        ...


class Hand(Protocol):
    """Interface of the hand on the handle: a simulated hand receives the stimulus as data, a person through the
    device."""

    def feel(self, stimulus: PresentTrial, answers_before: int) -> None:
        """Receive the stimulus: called after it began to be held; in a detection trial before the first interval.
        answers_before: number of answers of the session so far, training included."""
        ...


class HumanHand:
    """Hand of a person, who feels the device."""

    def feel(self, stimulus: PresentTrial, answers_before: int) -> None:
        return None
