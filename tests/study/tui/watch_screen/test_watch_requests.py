"""The experimenter's screen: stop, pause and notes reach the session, or it reports that they do not."""

import pytest

from study.errors import StudyError
from study.session.watching.requests import NoteAsked, PauseAsked, StopAsked
from study.session.watching.watch_view import (
    Alarm,
)
from study.tui.watch.watch_screen import STOP_TIMEOUT_S
from tests.study.tui.watch_screen.watched import UTC, view

STOP, PAUSE = StopAsked("experimenter"), PauseAsked("experimenter")
ENDED = Alarm("ended", "The sitting ended: the experimenter stopped the session.", UTC)


def test_stop_asks_nothing_and_says_when_it_was_heard(seated):
    async def story(seat):
        await seat.press("S")
        assert seat.asked == [STOP]
        assert "Stop sent: the force goes off at once." in seat.lines[1]
        stopped = {"standing": "stopped", "reason": "the experimenter stopped the session", "alarms": (ENDED,)}
        await seat.show(view(open_trial=None, live=None, **stopped))
        assert "■ STOPPED" in seat.lines[0]
        assert "The session has stopped: the experimenter stopped the session." in seat.lines[1]
        assert "ALARM" not in seat.text

    assert seated(story).bells == []


def test_a_small_s_stops_nothing(seated):
    async def story(seat):
        await seat.press("s")

    assert seated(story).asked == []


def test_a_stop_that_is_not_heard_is_an_alarm(seated):
    async def story(seat):
        await seat.press("S")
        await seat.pass_time(STOP_TIMEOUT_S - 0.1)
        assert seat.bells == []
        await seat.pass_time(0.2)
        assert "The session has not answered the stop." in seat.text
        assert "switch the device off" in seat.text

    assert len(seated(story).bells) == 1


def test_a_stop_that_is_not_heard_in_a_pause_is_an_alarm_too(seated):
    """A session hears it there within a moment, and ends."""

    async def story(seat):
        await seat.show(view(standing="paused", activity="pausing", open_trial=None))
        await seat.press("S")
        await seat.pass_time(STOP_TIMEOUT_S + 0.1)
        assert "The session has not answered the stop." in seat.text

    assert len(seated(story).bells) == 1


def test_a_stop_that_cannot_be_sent_says_what_to_do(seated):
    def refuse(_request):
        raise StudyError("t", f"A stop could not be put into {'/data' * 20}.", "Switch the device off.")

    async def story(seat):
        await seat.press("S")
        assert "NOT sent: A stop could not be put into" in seat.lines[1]
        assert "Switch the device off." in seat.text

    assert seated(story, ask=refuse).bells


def test_pause_is_sent_and_says_who_continues(seated):
    async def story(seat):
        await seat.press("p")
        assert "Pause sent. The participant continues" in seat.lines[1]
        await seat.show(view(standing="paused", activity="pausing", open_trial=None))
        await seat.press("p")
        assert "It is paused already" in seat.lines[1]

    assert seated(story).asked == [PAUSE]


@pytest.mark.parametrize(("key", "adverse"), [("n", False), ("e", True)])
def test_a_note_is_typed_and_sent(seated, key, adverse):
    async def story(seat):
        await seat.press(key)
        assert ("What happened to the participant" in seat.text) is adverse
        await seat.press(*"numb S", "enter")
        assert "Sent: the session writes it into the log." in seat.lines[1]

    assert seated(story).asked == [NoteAsked("experimenter", "numb S", adverse)]


def test_a_note_can_be_left_and_an_empty_one_is_none(seated):
    async def story(seat):
        await seat.press("n", *"abc", "escape")
        await seat.press("n", "space", "enter")
        assert "You only watch" in seat.lines[1]

    assert seated(story).asked == []


def test_a_stop_can_be_asked_for_while_a_note_is_typed(seated):
    async def story(seat):
        await seat.press("n", *"abc", "f8")
        assert seat.asked == [STOP]

    seated(story)
