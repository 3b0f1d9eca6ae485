"""The engine's implementation of the display port (`study.workflows.trial.display.Display`), by messages to the screen
process.

While a stimulus may play, `sign_of_life` (the keep-alive call that resets the device's watchdog) is called after waits
of at most `KEEPALIVE_INTERVAL_S`, so that the safety limits of the vibration hold even if the screen hangs. A missing
heartbeat of the screen ends the trial.
"""

import math
from collections.abc import Callable
from typing import Any

from protocols.trial import VoidCause
from study.devices.clock import Clock
from study.session.facts.void_reasons import explain_silent_screen
from study.session.views.form_views import Form, FormReply
from study.session.views.participant_views import (
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
from study.session.views.participant_views import Reply as Answer
from study.tui.engine.from_engine import CloseRequest, DisplayCall, Feedback, HandleUpdate, ScreenRequest, UserNotice
from study.tui.engine.screen_link import ScreenLink
from study.tui.engine.to_engine import Reply
from study.workflows.checks.computer_load import get_load_per_processor
from study.workflows.trial.display import SignOfLife

KEEPALIVE_INTERVAL_S = 0.04
"""Longest wait (s) before a call of `sign_of_life`. Chosen: well below the 0.1 s that the port allows
(`display.SignOfLife`)."""
HANDLE_POLL_INTERVAL_S = 0.1
"""Interval (s) at which the wait for the handle reads its position again. Chosen by hand."""
SHOW_WAIT_AFTER_S = 1.0
"""Time (s) after which a wait for the handle is shown even where the handle is in its place. Chosen by hand."""
HEARTBEAT_TIMEOUT_S = 0.5
"""Time (s) without a heartbeat after which the screen counts as suspended, ended or hung. The participant could then
not stop a stimulus. Chosen by hand."""

ENDED_EARLY = Unanswered("the stimulus ended early", ends_sitting=False)
"""Reply where `sign_of_life` returned False, which ends the wait."""
TIMED_OUT = Unanswered("no answer within the time limit", ends_sitting=False, cause=VoidCause.LATE)
"""Reply after the question's time limit."""


class RemoteDisplay:
    """The display port over a pipe; the docstrings of `Display` describe the methods. A method that sends or waits
    raises KeyboardInterrupt if the screen process has ended. get_load: returns the load average per processor (see
    `get_load_per_processor`), None if unknown."""

    def __init__(
        self, link: ScreenLink, clock: Clock, get_load: Callable[[], float | None] = get_load_per_processor
    ) -> None:
        self._link = link
        self._clock = clock
        self._get_load = get_load
        self._request_number = 0
        self._wake_delay_s = 0.0
        """Longest delay (s) of this process's own wake-ups since the last request was shown, or since the wait for the
        handle began."""
        self._listen: Callable[[], None] = lambda: None

    def listen_with(self, listen: Callable[[], None]) -> None:
        self._listen = listen

    def fill_in(self, form: Form) -> FormReply:
        reply: FormReply = self._ask_screen(DisplayCall.FILL_IN, form)
        return reply

    def device_checked(self, report: DeviceReport) -> bool:
        return bool(self._ask_screen(DisplayCall.DEVICE_CHECKED, report))

    def welcome(self, notice: Welcome) -> None:
        self._ask_screen(DisplayCall.WELCOME, notice)

    def choose_demo(self, menu: DemoMenu, sign_of_life: SignOfLife) -> DemoChoice:
        request_number = self._send_request(DisplayCall.CHOOSE_DEMO, menu)
        while sign_of_life():
            reply = self._await_reply(request_number)
            if reply is not None:
                choice: DemoChoice = reply.value
                return choice
        self._link.send(CloseRequest(request_number))
        return DemoDone()

    def show_playing(self, notice: PlayingNotice, sign_of_life: SignOfLife) -> Unanswered | None:
        request_number = self._send_request(DisplayCall.SHOW_PLAYING, notice)
        end_s = self._clock.now_s() + notice.seconds
        while (remaining_s := end_s - self._clock.now_s()) > 0:
            reply = self._await_reply(request_number, min(KEEPALIVE_INTERVAL_S, remaining_s))
            early_end: Unanswered | None = self._find_end(request_number, reply, sign_of_life)
            if early_end is not None:
                return early_end
        self._link.send(CloseRequest(request_number))
        return None

    def await_handle(self, look: Callable[[], HandleView], sign_of_life: SignOfLife) -> Unanswered | None:
        """Wait until the handle is in its place (see the port). The wait is shown only if the handle is away from its
        place or the wait is long, because in most trials the handle is in its place already."""
        request_number, view, self._wake_delay_s = 0, look(), 0.0
        start_s = read_s = self._clock.now_s()
        while not view.ready:
            should_show_wait = (
                math.hypot(*view.offset_mm) > view.radius_mm or self._clock.now_s() - start_s > SHOW_WAIT_AFTER_S
            )
            if should_show_wait and not request_number:
                request_number = self._send_request(DisplayCall.AWAIT_HANDLE, view)
            reply = self._await_reply(request_number)
            early_end: Unanswered | None = self._find_end(request_number, reply, sign_of_life)
            if early_end is not None:
                return early_end
            if self._clock.now_s() - read_s >= HANDLE_POLL_INTERVAL_S:
                view, read_s = look(), self._clock.now_s()
                if request_number:
                    self._link.send(HandleUpdate(request_number, view))
        if request_number:
            self._link.send(CloseRequest(request_number))
        return None

    def ask(self, question: Question, sign_of_life: SignOfLife) -> Answer:
        request_number = self._send_request(DisplayCall.ASK, question)
        deadline_s = self._clock.now_s() + question.time_limit_s if question.time_limit_s else float("inf")
        while True:
            answer: Answer | None = self._find_end(request_number, self._await_reply(request_number), sign_of_life)
            if answer is not None:
                return answer
            if self._clock.now_s() > deadline_s:
                return self._close_request(request_number, TIMED_OUT)

    def feedback(self, correct: bool) -> None:
        self._link.send(Feedback(correct))

    def practice_over(self, result: PracticeResult) -> None:
        self._ask_screen(DisplayCall.PRACTICE_OVER, result)

    def rest(self, notice: RestNotice, sign_of_life: SignOfLife) -> float:
        """Show a rest and return its duration, s (see the port). The duration is enforced here: if the screen replies
        too early, the remaining time is waited; it ends early only where `sign_of_life` returns False."""
        request_number = self._send_request(DisplayCall.REST, notice)
        start_s = self._clock.now_s()
        has_replied = False
        while not has_replied or self._clock.now_s() - start_s < notice.seconds:
            has_replied = self._await_reply(request_number) is not None or has_replied
            if not sign_of_life():
                self._link.send(CloseRequest(request_number))
                break
        return self._clock.now_s() - start_s

    def pause(self, notice: PauseNotice, sign_of_life: SignOfLife) -> AfterPause:
        request_number = self._send_request(DisplayCall.PAUSE, notice)
        while sign_of_life():
            reply = self._await_reply(request_number)
            if reply is not None:
                decision: AfterPause = reply.value
                return decision
        self._link.send(CloseRequest(request_number))
        # A withdrawal that the screen sent before it received this counts: it must not be lost.
        late_reply = self._await_reply(request_number)
        is_withdrawn = late_reply is not None and late_reply.value is AfterPause.WITHDRAW
        return AfterPause.WITHDRAW if is_withdrawn else AfterPause.END_SITTING

    def await_return(self, reason: str) -> None:
        self._ask_screen(DisplayCall.AWAIT_RETURN, reason)

    def goodbye(self, notice: Goodbye) -> None:
        self._ask_screen(DisplayCall.GOODBYE, notice)

    def trouble(self, sentence: str) -> None:
        self._link.send(UserNotice(sentence))

    def _ask_screen(self, call: DisplayCall, content: Any) -> Any:
        """Show a request and wait without limit for the reply, which is returned. Only while nothing plays, because the
        screen may be suspended for any time and `sign_of_life` is not called. An error of `listen` ends the wait; the
        next request replaces the screen."""
        request_number = self._send_request(call, content)
        while (reply := self._await_reply(request_number)) is None:
            self._listen()
        return reply.value

    def _send_request(self, call: DisplayCall, content: Any) -> int:
        """Send a request to the screen and return its number, by which the reply is recognised."""
        self._request_number += 1
        self._wake_delay_s = 0.0
        self._link.send(ScreenRequest(self._request_number, call, content))
        return self._request_number

    def _await_reply(self, request_number: int, timeout_s: float = KEEPALIVE_INTERVAL_S) -> Reply | None:
        """Wait for the screen's reply to this request; None if no reply came within `timeout_s` (s), or only a reply to
        an earlier request. Updates the longest delay of this process's wake-ups."""
        start_s = self._clock.now_s()
        reply = self._link.wait_for_reply(timeout_s)
        self._wake_delay_s = max(self._wake_delay_s, self._clock.now_s() - start_s - timeout_s)
        return reply if reply is not None and reply.number == request_number else None

    def _find_end(self, request_number: int, reply: Reply | None, sign_of_life: SignOfLife) -> Any:
        """Find how the wait for a request ends: by `sign_of_life`, by the reply, or because the screen's last message,
        usually a heartbeat, is older than `HEARTBEAT_TIMEOUT_S`; None while it goes on. request_number: 0 where nothing
        is shown."""
        if not sign_of_life():
            return self._close_request(request_number, ENDED_EARLY)
        if reply is not None and request_number:
            return reply.value
        if self._link.compute_silence_s() > HEARTBEAT_TIMEOUT_S:
            silent_reply = make_silent_screen_reply(self._wake_delay_s, self._get_load())
            return self._close_request(request_number, silent_reply)
        return None

    def _close_request(self, request_number: int, early_end: Unanswered) -> Unanswered:
        """Close the request on the screen, and return `early_end`. request_number: 0 where nothing is shown."""
        if request_number:
            self._link.send(CloseRequest(request_number))
        return early_end


def make_silent_screen_reply(engine_delay_s: float, load_per_processor: float | None) -> Unanswered:
    """Make the result of a trial whose screen sent no heartbeat. Arguments as in `explain_silent_screen`."""
    reason = explain_silent_screen(engine_delay_s, load_per_processor)
    return Unanswered(reason, ends_sitting=False, cause=VoidCause.SCREEN_LATE)
