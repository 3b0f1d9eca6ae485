"""What every display keeps to, with a person or a simulated participant before it. Seats are in conftest.py."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from protocols.trial import Phase
from study.session.views.form_views import Form, FormField, FormKind, find_missing_fields
from study.session.views.participant_views import (
    AfterPause,
    Answered,
    DemoDone,
    DemoMenu,
    DeviceFinding,
    DeviceReport,
    DirectionPicture,
    Goodbye,
    HandleView,
    PauseNotice,
    PlayDemo,
    PlayingNotice,
    PracticeResult,
    Progress,
    Question,
    RestNotice,
    Task,
    Unanswered,
    Welcome,
)

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]

PICTURE = DirectionPicture("yz", (135.0, 45.0))
QUESTION = Question(Phase.TEST, 1, 5, 3, repeated=False, time_limit_s=0.0, picture=PICTURE, progress=Progress(0.3, 9))
MENU = DemoMenu(PICTURE, vibrations=3, vibration=1, played_pairs=(), handle_moves=True)
PLAYING = PlayingNotice("Interval 1", number=1, seconds=0.4, picture=None)
REST = RestNotice(seconds=0.4, runs_left=2)
PAUSE = PauseNotice("the experimenter asked for a pause", answers=4)
WELCOME = Welcome("A study", PICTURE, runs=5, training_runs=1, device="a device", device_moves=True, resumed_after=0)
REPORT = DeviceReport("a device", True, (DeviceFinding("rate", "1000 Hz", fine=True),))
FORM = Form(
    FormKind.DEBRIEF,
    "Looking back",
    "Two questions.",
    (FormField("felt", "Did it feel directed?", ("yes", "no")), FormField("how", "How did you tell?", needed=False)),
)


class Signs:
    """Counts signs of life; the wait is over after so many."""

    def __init__(self, over_after: int = 10**9) -> None:
        self.count = 0
        self._over_after = over_after

    def __call__(self) -> bool:
        self.count += 1
        return self.count <= self._over_after


def away(sentence: str = "Bring the handle back") -> HandleView:
    return HandleView(False, sentence, (12.0, 0.0), 5.0)


def test_a_form_comes_back_with_every_needed_answer(seat):
    seat.fill(FORM, ("no", "by its rhythm"))
    reply = seat.display.fill_in(FORM)
    assert find_missing_fields(FORM, reply) == ()
    if seat.person:
        assert reply.answers == {"felt": "no", "how": "by its rhythm"}


def test_a_device_in_order_is_gone_on_with(seat):
    seat.press("enter")
    assert seat.display.device_checked(REPORT) is True


def test_a_device_can_be_checked_again(persons_seat):
    persons_seat.press("c")
    assert persons_seat.display.device_checked(REPORT) is False


@pytest.mark.parametrize(
    ("call", "value"),
    [
        ("welcome", WELCOME),
        ("practice_over", PracticeResult(True, correct_count=4, answer_count=5)),
        ("await_return", "the stimulus was held too long"),
    ],
)
def test_what_must_be_read_returns_when_it_was(seat, call, value):
    seat.press("enter")
    assert getattr(seat.display, call)(value) is None


@pytest.mark.parametrize(
    ("call", "value"),
    [("feedback", True), ("trouble", "Something."), ("goodbye", Goodbye(finished=False, answers=3, reason="left"))],
)
def test_a_message_without_a_question_returns_at_once(seat, call, value):
    seat.press("enter")
    assert getattr(seat.display, call)(value) is None


def test_the_demonstration_can_be_ended(seat):
    seat.press("enter")
    assert seat.display.choose_demo(MENU, Signs()) == DemoDone()


def test_the_demonstration_plays_what_was_chosen(persons_seat):
    persons_seat.press("2", "n", "1", "n", "b", "1")
    choices = [persons_seat.display.choose_demo(MENU, Signs()) for _ in range(3)]
    assert choices == [PlayDemo(1, 2), PlayDemo(2, 1), PlayDemo(1, 1)]


def test_an_answer_is_one_or_two_and_stamped_between_question_and_reply(seat):
    seat.press("2")
    before_s = seat.clock.now_s()
    reply = seat.display.ask(QUESTION, Signs())
    assert isinstance(reply, Answered)
    assert before_s <= reply.key_time_s <= seat.clock.now_s()
    assert reply.answer == 2 or not seat.person


@pytest.mark.parametrize("task", Task)
@pytest.mark.parametrize("key", ["1", "2"])
def test_the_pressed_key_is_the_answer_to_every_question(persons_seat, task, key):
    persons_seat.press(key)
    reply = persons_seat.display.ask(replace(QUESTION, task=task), Signs())
    assert isinstance(reply, Answered)
    assert reply.answer == int(key)


@pytest.mark.parametrize(
    ("key", "leave", "asked", "pause"),
    [("q", True, False, False), ("r", False, True, False), ("p", False, True, True)],
)
def test_leaving_repeating_and_pausing_are_distinguished(persons_seat, key, leave, asked, pause):
    persons_seat.press(key)
    reply = persons_seat.display.ask(QUESTION, Signs())
    assert isinstance(reply, Unanswered)
    assert (reply.ends_sitting, reply.repeat_requested, reply.pause) == (leave, asked, pause)


def test_a_wrong_key_answers_nothing(persons_seat):
    persons_seat.press("3", "x", "1")
    reply = persons_seat.display.ask(QUESTION, Signs())
    assert isinstance(reply, Answered)
    assert reply.answer == 1


def test_the_time_limit_ends_a_question(seat):
    reply = seat.display.ask(replace(QUESTION, time_limit_s=0.2), Signs())
    assert isinstance(reply, Unanswered)
    assert not (reply.ends_sitting or reply.repeat_requested or reply.pause)


def playing(display, signs) -> object:
    return display.show_playing(PLAYING, signs)


def resting(display, signs) -> object:
    return display.rest(REST, signs)


def still(display, signs) -> object:
    """Between two intervals: nothing to name, nothing to highlight."""
    return display.show_playing(replace(PLAYING, title="", number=0), signs)


WAITS: dict[str, Callable[..., object]] = {"something plays": playing, "a gap": still, "a rest": resting}


@pytest.mark.parametrize("wait", WAITS)
def test_a_fixed_wait_lasts_as_long_as_it_says_and_gives_signs_of_life(seat, wait):
    seat.press("enter")
    signs, started_s = Signs(), seat.clock.now_s()
    result = WAITS[wait](seat.display, signs)
    assert result is None or result == pytest.approx(0.4, abs=0.3)
    assert seat.clock.now_s() - started_s >= 0.4 - 1e-6
    assert signs.count >= 4


def test_a_whole_rest_is_never_shorter_than_asked_for(seat):
    seat.press("enter")
    assert seat.display.rest(REST, Signs()) >= 0.4 - 1e-6


ENDED = {
    "a question": lambda display, signs: display.ask(QUESTION, signs),
    "something plays": lambda display, signs: display.show_playing(replace(PLAYING, seconds=600.0), signs),
    "the handle is away": lambda display, signs: display.await_handle(away, signs),
    "a rest": lambda display, signs: display.rest(replace(REST, seconds=600.0), signs),
}


@pytest.mark.parametrize("wait", ENDED)
@pytest.mark.parametrize("after", [0, 2])
def test_each_reason_ends_a_wait_at_once(seat, wait, after):
    signs, started_s = Signs(over_after=after), seat.clock.now_s()
    reply = ENDED[wait](seat.display, signs)
    assert signs.count == after + 1
    if wait == "a rest":
        assert reply < 600.0
    else:
        assert isinstance(reply, Unanswered)
        assert not reply.ends_sitting
    assert seat.clock.now_s() - started_s < 5.0


def test_the_demonstration_ends_when_its_wait_is_over(seat):
    assert seat.display.choose_demo(MENU, Signs(over_after=0)) == DemoDone()


def test_a_handle_in_its_place_ends_the_wait_at_once(seat):
    assert seat.display.await_handle(lambda: HandleView(True, "", (0.0, 0.0), 5.0), Signs()) is None


def test_the_handle_is_looked_at_until_it_is_back(seat):
    views = iter([away(), away(), away("Hold it there"), HandleView(True, "", (1.0, 0.0), 5.0)])
    signs = Signs()
    assert seat.display.await_handle(lambda: next(views), signs) is None
    assert signs.count >= 3
    assert next(views, None) is None


def test_a_pause_ends_with_the_choice_to_continue(seat):
    seat.press("enter")
    assert seat.display.pause(PAUSE, lambda: True) is AfterPause.CONTINUE_SITTING


def test_a_pause_can_end_the_sitting(persons_seat):
    persons_seat.press("q")
    assert persons_seat.display.pause(PAUSE, lambda: True) is AfterPause.END_SITTING


def test_consent_can_be_taken_back_during_a_pause(persons_seat):
    persons_seat.withdraw()
    assert persons_seat.display.pause(PAUSE, lambda: True) is AfterPause.WITHDRAW


class StopRequestedError(Exception):
    """Raised by the function that listens for requests."""


NOTICES: dict[str, Callable[..., object]] = {
    "a form": lambda display: display.fill_in(FORM),
    "a device check": lambda display: display.device_checked(REPORT),
    "instructions": lambda display: display.welcome(WELCOME),
    "a practice": lambda display: display.practice_over(PracticeResult(True, correct_count=4, answer_count=5)),
    "a void trial": lambda display: display.await_return("the stimulus was held too long"),
}


@pytest.mark.parametrize("notice", NOTICES)
def test_a_form_and_each_notice_listen_while_they_wait_and_can_be_ended(persons_seat, notice):
    heard_s: list[float] = []

    def listen() -> None:
        heard_s.append(persons_seat.clock.now_s())
        if len(heard_s) == 4:
            raise StopRequestedError

    persons_seat.display.listen_with(listen)
    with pytest.raises(StopRequestedError):
        NOTICES[notice](persons_seat.display)
    assert heard_s[-1] - heard_s[0] < 1.0


def test_the_words_of_a_withdrawal_are_waited_for_also_where_a_stop_comes(persons_seat):
    persons_seat.withdraw()
    signs = Signs(over_after=1)
    assert persons_seat.display.pause(PAUSE, signs) is AfterPause.WITHDRAW
    assert signs.count >= 2
