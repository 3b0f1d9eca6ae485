"""The engine's implementation of the display port (`display.Display`), by messages to the screen process.

While a stimulus may play, `sign_of_life` (the keep-alive call that resets the device's watchdog) is called at least
every `KEEPALIVE_INTERVAL_S`, so that the safety limits of the vibration hold even if the screen hangs. A missing
heartbeat of the screen ends the trial.
"""

import math
from collections.abc import Callable
from typing import Any

from protocols.trial import VoidCause
from study.devices.clock import Clock
from study.session.facts.void_reasons import explain_silent_screen
from study.session.views.form_views import Form, FormReply
from study.session.views.views import (
    AfterPause,
    DemoChoice,
    DemoDone,
    DemoMenu,
    DeviceReport,
    Goodbye,
    HandleView,
    PauseNotice,
    PlayingNotice,
    PracticeResult,
    Question,
    RestNotice,
    Unanswered,
    Welcome,
)
from study.session.views.views import Reply as Answer
from study.tui.engine.from_engine import Ask, Call, CloseRequest, Feedback, LookUpdate, Trouble
from study.tui.engine.screen_link import ScreenLink
from study.tui.engine.to_engine import Reply
from study.workflows.checks.computer_load import load_per_processor
from study.workflows.trial.display import SignOfLife

KEEPALIVE_INTERVAL_S = 0.04
"""Longest interval (s) between two calls of `sign_of_life`; the port allows 0.1 s."""
HANDLE_POLL_INTERVAL_S = 0.1
"""Interval (s) at which the wait for the handle reads its position again."""
SHOW_WAIT_AFTER_S = 1.0
"""Time (s) from which a wait for the handle is shown even where the handle is in its place."""
SILENT_AFTER_S = 0.5
"""Time (s) without a heartbeat after which the screen counts as suspended, ended or hung. The participant could then
not stop a stimulus."""

ENDED_EARLY = Unanswered("the stimulus ended early", ends_sitting=False)
"""Reply where `sign_of_life` returned False, which ends the wait."""
TIMED_OUT = Unanswered("no answer within the time limit", ends_sitting=False, cause=VoidCause.LATE)
"""Reply after the question's time limit."""


class RemoteDisplay:
    """The display port over a pipe; the docstrings of `Display` apply. Any method raises KeyboardInterrupt if the
    screen process has ended. load: gives the load average per processor, None if unknown."""

    def __init__(self, link: ScreenLink, clock: Clock, load: Callable[[], float | None] = load_per_processor) -> None:
        self._link = link
        self._clock = clock
        self._load = load
        self._number = 0
        self._late_s = 0.0
        """Longest delay (s) of this process's own wake-ups since the last request was shown."""

    def fill_in(self, form: Form) -> FormReply:
        reply: FormReply = self._ask_screen(Call.FILL_IN, form)
        return reply

    def device_checked(self, report: DeviceReport) -> bool:
        return bool(self._ask_screen(Call.DEVICE_CHECKED, report))

    def welcome(self, notice: Welcome) -> None:
        self._ask_screen(Call.WELCOME, notice)

    def choose_demo(self, menu: DemoMenu, sign_of_life: SignOfLife) -> DemoChoice:
        number = self._send_request(Call.CHOOSE_DEMO, menu)
        while sign_of_life():
            reply = self._await_reply(number)
            if reply is not None:
                choice: DemoChoice = reply.value
                return choice
        self._link.send(CloseRequest(number))
        return DemoDone()

    def show_playing(self, notice: PlayingNotice, sign_of_life: SignOfLife) -> Unanswered | None:
        number = self._send_request(Call.SHOW_PLAYING, notice)
        until_s = self._clock.now_s() + notice.seconds
        while (remaining_s := until_s - self._clock.now_s()) > 0:
            reply = self._await_reply(number, min(KEEPALIVE_INTERVAL_S, remaining_s))
            if not sign_of_life():
                return self._close_request(number, ENDED_EARLY)
            if reply is not None:
                early_end: Unanswered | None = reply.value
                return early_end
            if self._is_screen_silent():
                return self._close_request(number, make_silent_screen_reply(self._late_s, self._load()))
        self._link.send(CloseRequest(number))
        return None

    def await_handle(self, look: Callable[[], HandleView], sign_of_life: SignOfLife) -> Unanswered | None:
        """As in the port. The wait is shown only if the handle is away from its place or the wait is long, because in
        most trials the handle is in its place already."""
        number, view, self._late_s = 0, look(), 0.0
        began_s = read_s = self._clock.now_s()
        while not view.ready:
            is_wait_shown = (
                math.hypot(*view.offset_mm) > view.radius_mm or self._clock.now_s() - began_s > SHOW_WAIT_AFTER_S
            )
            if is_wait_shown and not number:
                number = self._send_request(Call.AWAIT_HANDLE, view)
            reply = self._await_reply(number)
            if not sign_of_life():
                return self._close_request(number, ENDED_EARLY)
            if reply is not None and number:
                early_end: Unanswered | None = reply.value
                return early_end
            if self._is_screen_silent():
                return self._close_request(number, make_silent_screen_reply(self._late_s, self._load()))
            if self._clock.now_s() - read_s >= HANDLE_POLL_INTERVAL_S:
                view, read_s = look(), self._clock.now_s()
                if number:
                    self._link.send(LookUpdate(number, view))
        if number:
            self._link.send(CloseRequest(number))
        return None

    def ask(self, question: Question, sign_of_life: SignOfLife) -> Answer:
        number = self._send_request(Call.ASK, question)
        until_s = self._clock.now_s() + question.time_limit_s if question.time_limit_s else float("inf")
        while True:
            reply = self._await_reply(number)
            if not sign_of_life():
                return self._close_request(number, ENDED_EARLY)
            if reply is not None:
                answer: Answer = reply.value
                return answer
            if self._is_screen_silent():
                return self._close_request(number, make_silent_screen_reply(self._late_s, self._load()))
            if self._clock.now_s() > until_s:
                return self._close_request(number, TIMED_OUT)

    def feedback(self, correct: bool) -> None:
        self._link.send(Feedback(correct))

    def practice_over(self, result: PracticeResult) -> None:
        self._ask_screen(Call.PRACTICE_OVER, result)

    def rest(self, notice: RestNotice, sign_of_life: SignOfLife) -> float:
        """As in the port. The duration is enforced here: if the screen replies too early, the remaining time is
        waited."""
        number = self._send_request(Call.REST, notice)
        started_s = self._clock.now_s()
        has_replied = False
        while not has_replied or self._clock.now_s() - started_s < notice.seconds:
            has_replied = self._await_reply(number) is not None or has_replied
            if not sign_of_life():
                self._link.send(CloseRequest(number))
                break
        return self._clock.now_s() - started_s

    def pause(self, notice: PauseNotice, sign_of_life: SignOfLife) -> AfterPause:
        number = self._send_request(Call.PAUSE, notice)
        while sign_of_life():
            reply = self._await_reply(number)
            if reply is not None:
                decision: AfterPause = reply.value
                return decision
        self._link.send(CloseRequest(number))
        return AfterPause.END_SITTING

    def await_return(self, reason: str) -> None:
        self._ask_screen(Call.AWAIT_RETURN, reason)

    def goodbye(self, notice: Goodbye) -> None:
        self._ask_screen(Call.GOODBYE, notice)

    def trouble(self, sentence: str) -> None:
        self._link.send(Trouble(sentence))

    def _ask_screen(self, call: Call, content: Any) -> Any:
        """Show a request and wait without limit for the reply. Only while nothing plays, because the screen may be
        suspended for any time."""
        number = self._send_request(call, content)
        while (reply := self._await_reply(number)) is None:
            pass
        return reply.value

    def _send_request(self, call: Call, content: Any) -> int:
        """Send a request to the screen; returns its number, which the reply carries."""
        self._number += 1
        self._late_s = 0.0
        self._link.send(Ask(self._number, call, content))
        return self._number

    def _await_reply(self, number: int, timeout_s: float = KEEPALIVE_INTERVAL_S) -> Reply | None:
        """The screen's reply to this request; None if no reply came within `timeout_s` (s), or only a reply to an
        earlier request."""
        began_s = self._clock.now_s()
        reply = self._link.reply(timeout_s)
        self._late_s = max(self._late_s, self._clock.now_s() - began_s - timeout_s)
        return reply if reply is not None and reply.number == number else None

    def _is_screen_silent(self) -> bool:
        """Whether the screen's last heartbeat is older than `SILENT_AFTER_S`."""
        return self._link.silent_s() > SILENT_AFTER_S

    def _close_request(self, number: int, reason: Unanswered) -> Unanswered:
        """Close the request on the screen and return the reason. number: of the request, 0 where nothing is shown."""
        if number:
            self._link.send(CloseRequest(number))
        return reason


def make_silent_screen_reply(engine_late_s: float, load_per_processor: float | None) -> Unanswered:
    """Result of a trial whose screen sent no heartbeat. Arguments as in `explain_silent_screen`."""
    reason = explain_silent_screen(engine_late_s, load_per_processor)
    return Unanswered(reason, ends_sitting=False, cause=VoidCause.SCREEN_LATE)
