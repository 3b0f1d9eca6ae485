from itertools import pairwise

import pytest

from study.session.views.participant_views import AfterPause, PauseNotice, Progress, RestNotice
from study.session.watching.requests import NoteAsked

PAUSE = PauseNotice("the experimenter asked for it", answers=12)
REST = RestNotice(seconds=25.0, runs_left=3)


def test_a_rest_is_enforced_and_says_what_is_left(unhurried):
    unhurried.type("")
    assert unhurried.display.rest(REST, lambda: True) == pytest.approx(25.0)
    assert "for at least 25 s. 3 runs are left. 25 s 15 s Press Enter to go on." in unhurried.said


def test_a_rest_tells_how_far_the_session_is(unhurried):
    unhurried.type("")
    unhurried.display.rest(RestNotice(1.0, 1, Progress(0.6, 9)), lambda: True)
    assert "1 run is left. 60% of the session is done, about 9 minutes left." in unhurried.said


def test_the_device_gets_signs_of_life_through_the_whole_rest(unhurried):
    unhurried.type("")
    times = [0.0]
    unhurried.display.rest(REST, lambda: times.append(unhurried.clock.now_s()) is None)
    assert max(b - a for a, b in pairwise(times)) <= 0.1
    assert times[-1] == pytest.approx(25.0)


def test_a_rest_ends_at_once_where_the_sign_of_life_says_so(unhurried):
    rested_s = unhurried.display.rest(REST, lambda: unhurried.clock.now_s() < 7.0)
    assert rested_s == pytest.approx(7.0, abs=0.1)
    assert "Press Enter" not in unhurried.said


def test_a_rest_without_a_confirmed_end_can_still_be_ended(typed):
    signs = []
    typed.display.rest(RestNotice(0.0, 1), lambda: signs.append(1) is None and len(signs) < 4)
    assert len(signs) == 4


@pytest.mark.parametrize("line", ["q", None])
def test_after_a_rest_one_can_leave(unhurried, line):
    unhurried.end() if line is None else unhurried.type(line)
    with pytest.raises(KeyboardInterrupt):
        unhurried.display.rest(RestNotice(1.0, 1), lambda: True)


@pytest.mark.parametrize(
    ("lines", "decision"),
    [
        (("",), AfterPause.CONTINUE_SITTING),
        (("q",), AfterPause.END_SITTING),
        (("w", "withdraw"), AfterPause.WITHDRAW),
        (("w", "Withdraw"), AfterPause.WITHDRAW),
        (("w", "", ""), AfterPause.CONTINUE_SITTING),
        (("w", "yes", "q"), AfterPause.END_SITTING),
        (("x", "?", ""), AfterPause.CONTINUE_SITTING),
    ],
)
def test_a_pause_ends_by_decision_and_withdrawing_needs_the_whole_word(typed, lines, decision):
    typed.type(*lines)
    assert typed.display.pause(PAUSE, lambda: True) is decision
    assert "Pause (the experimenter asked for it). Nothing is played. 12 answers are on the disk." in typed.said


def test_a_wrong_key_in_a_pause_is_named(typed):
    typed.type("1", "")
    typed.display.pause(PAUSE, lambda: True)
    assert "'1' is none of the keys; ? tells them." in typed.said


def test_what_is_not_confirmed_is_not_erased(typed):
    typed.type("w", "y", "")
    typed.display.pause(PAUSE, lambda: True)
    assert "Nothing is erased." in typed.said


def test_notes_and_adverse_events_reach_the_session(typed_in):
    notes = []
    typed = typed_in(notes=notes)
    typed.type("n", "the phone rang", "e", "the thumb is numb", "n", "", "")
    assert typed.display.pause(PAUSE, lambda: True) is AfterPause.CONTINUE_SITTING
    assert notes == [
        NoteAsked("participant", "the phone rang", adverse=False),
        NoteAsked("participant", "the thumb is numb", adverse=True),
    ]
    assert typed.said.count("Written into the log.") == 2
    assert "Nothing was written." in typed.said


def test_without_a_reader_no_notes_are_offered(typed):
    typed.type("n", "")
    typed.display.pause(PAUSE, lambda: True)
    assert "note" not in typed.said
    assert "'n' is none of the keys" in typed.said


def test_a_pause_ends_with_the_input(typed):
    typed.end()
    with pytest.raises(KeyboardInterrupt):
        typed.display.pause(PAUSE, lambda: True)
