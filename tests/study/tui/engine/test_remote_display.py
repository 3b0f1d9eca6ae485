"""The display port over a pipe, in one process: the test is the screen."""

import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from multiprocessing import Pipe

import pytest

from protocols.trial import Phase
from study.devices.clock import RealClock
from study.session.views.participant_views import (
    AfterPause,
    Answered,
    DemoDone,
    DemoMenu,
    DirectionPicture,
    HandleView,
    PauseNotice,
    PlayingNotice,
    Question,
    RestNotice,
    Unanswered,
)
from study.tui.engine.from_engine import CloseRequest, DisplayCall, HandleUpdate, ScreenRequest
from study.tui.engine.remote_display import HEARTBEAT_TIMEOUT_S, RemoteDisplay, make_silent_screen_reply
from study.tui.engine.screen_link import ScreenLink
from study.tui.engine.to_engine import Heartbeat, Reply
from study.tui.trial_replies import TIME_OVER

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]

PICTURE = DirectionPicture("yz", (135.0, 45.0))
QUESTION = Question(Phase.TEST, 1, 5, 3, repeated=False, time_limit_s=0.0, picture=PICTURE)
MENU = DemoMenu(PICTURE, vibrations=1, vibration=1, played_pairs=(), handle_moves=True)


class OtherEnd:
    """Of the pipe: what the engine asks is heard here, and replied to at will."""

    def __init__(self) -> None:
        self.pipe, theirs = Pipe()
        self.link = ScreenLink(theirs, interrupt=lambda: None, on_screen_ended=lambda: None)
        self.link.start()
        self.display = RemoteDisplay(self.link, RealClock())
        self._alive = True
        threading.Thread(target=self._beat, daemon=True).start()

    def hear(self):
        assert self.pipe.poll(20.0)
        return self.pipe.recv()

    def soon(self, *messages, delay_s: float = 0.1) -> None:
        """From another thread: the test itself is busy with being the engine."""

        def send() -> None:
            time.sleep(delay_s)
            for message in messages:
                self.pipe.send(message)

        threading.Thread(target=send, daemon=True).start()

    def fall_silent(self) -> None:
        self._alive = False

    def _beat(self) -> None:
        while self._alive:
            self.pipe.send(Heartbeat())
            time.sleep(0.1)


@pytest.fixture
def screen() -> Iterator[OtherEnd]:
    made = OtherEnd()
    yield made
    made.fall_silent()


def alive() -> bool:
    return True


def test_the_answer_is_the_one_to_the_question_on_the_screen(screen):
    answer = Answered(2, time.monotonic())
    screen.soon(Reply(0, Answered(1, 0.0)), Reply(7, Answered(1, 0.0)), Reply(1, answer))
    assert screen.display.ask(QUESTION, alive) == answer
    assert screen.hear() == ScreenRequest(1, DisplayCall.ASK, QUESTION)


def test_a_reply_wakes_the_engine_at_once(screen):
    answer = Answered(1, 0.0)
    taken = []

    def reply_and_look() -> None:
        time.sleep(0.2)
        taken.append(time.monotonic())
        screen.pipe.send(Reply(1, answer))

    threading.Thread(target=reply_and_look, daemon=True).start()
    screen.display.ask(QUESTION, alive)
    assert time.monotonic() - taken[0] < 0.03


def play(display: RemoteDisplay):
    return display.show_playing(PlayingNotice("Interval 1", 1, 60.0, None), alive)


def wait_for_handle(display: RemoteDisplay):
    return display.await_handle(lambda: HandleView(False, "Back", (9.0, 0.0), 5.0), alive)


def question(display: RemoteDisplay):
    return display.ask(QUESTION, alive)


@pytest.mark.parametrize("wait", [question, play, wait_for_handle])
def test_a_silent_screen_ends_every_force_at_the_hand(screen, wait):
    screen.fall_silent()
    began_s = time.monotonic()
    reply = wait(screen.display)
    assert HEARTBEAT_TIMEOUT_S - 0.15 < time.monotonic() - began_s < HEARTBEAT_TIMEOUT_S + 0.3
    # Which of the two depends on how busy this computer is.
    assert reply in (make_silent_screen_reply(0.0, 0.1), make_silent_screen_reply(0.0, 4.0))


def test_a_silent_screen_of_a_busy_computer_is_distinguished(screen):
    screen.fall_silent()
    busy = RemoteDisplay(screen.link, RealClock(), get_load=lambda: 4.0)
    assert busy.ask(QUESTION, alive) == make_silent_screen_reply(0.0, 4.0)


def test_a_silent_screen_may_take_its_time_while_nothing_plays(screen):
    screen.fall_silent()
    screen.soon(Reply(1, DemoDone()), Reply(2, None), delay_s=HEARTBEAT_TIMEOUT_S + 0.3)
    assert screen.display.choose_demo(MENU, alive) == DemoDone()
    assert screen.display.await_return("a reason") is None


def test_a_screen_that_is_gone_ends_the_session(screen):
    screen.fall_silent()
    time.sleep(0.15)
    threading.Timer(0.1, screen.pipe.close).start()
    with pytest.raises(KeyboardInterrupt):
        screen.display.await_return("a reason")


def test_what_plays_is_closed_when_its_time_is_over(screen):
    began_s = time.monotonic()
    assert screen.display.show_playing(PlayingNotice("Interval 1", 1, 0.3, None), alive) is None
    assert time.monotonic() - began_s == pytest.approx(0.3, abs=0.06)
    assert isinstance(screen.hear(), ScreenRequest)
    assert screen.hear() == CloseRequest(1)


def test_the_time_limit_is_the_engines(screen):
    reply = screen.display.ask(replace(QUESTION, time_limit_s=0.2), alive)
    assert reply == TIME_OVER
    screen.hear()
    assert screen.hear() == CloseRequest(1)


def test_a_rest_lasts_even_if_the_screen_comes_back_too_early(screen):
    screen.soon(Reply(1, 0.0), delay_s=0.05)
    assert screen.display.rest(RestNotice(0.4, 1), alive) >= 0.4


def test_a_handle_that_is_held_still_for_a_moment_is_no_news(screen):
    views = iter([HandleView(False, "Hold it", (1.0, 0.0), 5.0), HandleView(True, "There", (0.0, 0.0), 5.0)])
    assert screen.display.await_handle(lambda: next(views), alive) is None
    assert not screen.pipe.poll(0.1)


def test_an_unmeasured_handle_position_is_shown_after_a_while(screen):
    view = HandleView(False, "The device does not say where its handle is.", (0.0, 0.0), 5.0)
    screen.soon(Reply(1, Unanswered("asked for a pause", ends_sitting=False, pause=True)), delay_s=1.4)
    assert screen.display.await_handle(lambda: view, alive).pause
    assert screen.hear().content == view


def test_the_screen_sees_the_handle_come_back(screen):
    views = [HandleView(False, "Back", (9.0 - n, 0.0), 5.0) for n in range(3)]
    views.append(HandleView(True, "There", (0.0, 0.0), 5.0))
    coming = iter(views)
    assert screen.display.await_handle(lambda: next(coming), alive) is None
    heard = [screen.hear() for _ in range(5)]
    assert heard == [
        ScreenRequest(1, DisplayCall.AWAIT_HANDLE, views[0]),
        *(HandleUpdate(1, view) for view in views[1:]),
        CloseRequest(1),
    ]


def test_a_wait_gives_signs_of_life_twenty_times_a_second(screen):
    signs = []

    def sign() -> bool:
        signs.append(time.monotonic())
        return len(signs) < 15

    screen.display.ask(QUESTION, sign)
    assert max(later - earlier for earlier, later in pairwise(signs)) < 0.1


@pytest.mark.parametrize(
    ("reply", "decision"),
    [(AfterPause.WITHDRAW, AfterPause.WITHDRAW), (AfterPause.CONTINUE_SITTING, AfterPause.END_SITTING)],
)
def test_a_withdrawal_that_was_sent_while_a_stop_came_counts(screen, reply, decision):
    screen.pipe.send(Reply(1, reply))
    assert screen.display.pause(PauseNotice("a reason", 3), lambda: False) is decision


def test_a_reply_that_was_sent_before_the_screen_ended_is_not_lost(screen):
    screen.fall_silent()
    time.sleep(0.15)
    screen.pipe.send(Reply(1, AfterPause.WITHDRAW))
    screen.pipe.close()
    assert screen.link.wait_for_command() is None
    assert screen.link.wait_for_reply(1.0) == Reply(1, AfterPause.WITHDRAW)
    with pytest.raises(KeyboardInterrupt):
        screen.link.wait_for_reply(1.0)


def test_an_engine_that_understands_nothing_any_more_stops_its_device_and_ends(screen, capfd):
    stopped = threading.Event()
    screen.link.stop_device = stopped.set
    screen.fall_silent()
    time.sleep(0.15)
    screen.pipe.send_bytes(b"nothing that was pickled")
    assert stopped.wait(20.0)
    assert screen.link.wait_for_command() is None
    with pytest.raises(KeyboardInterrupt):
        screen.display.await_return("a reason")
    assert "UnpicklingError" in capfd.readouterr().err


class StopRequestedError(Exception):
    """Raised by the function that listens for requests."""


@pytest.mark.parametrize("call", ["fill_in", "device_checked", "welcome", "practice_over", "await_return"])
def test_a_stop_ends_the_wait_of_a_form_and_of_each_notice(screen, call):
    heard = []

    def listen() -> None:
        heard.append(call)
        if len(heard) == 3:
            raise StopRequestedError

    screen.display.listen_with(listen)
    with pytest.raises(StopRequestedError):
        getattr(screen.display, call)("content")
