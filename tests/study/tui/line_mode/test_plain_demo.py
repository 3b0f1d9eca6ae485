from dataclasses import replace
from itertools import pairwise

import pytest

from study.session.views.participant_views import (
    DemoDone,
    DemoMenu,
    DirectionPicture,
    HandleView,
    PlayDemo,
    PlayingNotice,
    Unanswered,
)
from study.tui.line_mode.line_input import LineInput

PICTURE = DirectionPicture("yz", (135.0, 45.0))
MENU = DemoMenu(PICTURE, vibrations=3, vibration=2, played_pairs=((2, 1),), handle_moves=True)
PLAYING = PlayingNotice("Direction 1", number=1, seconds=2.0, picture=PICTURE)


class Person(LineInput):
    """Types a line at a moment of a wait, as on a terminal."""

    def __init__(self, clock, text: str, at_s: float) -> None:
        self._clock, self._text, self._at_s = clock, text, at_s
        self.is_interactive = True

    def discard_early_lines(self) -> None:
        return None

    def has_ended(self) -> bool:
        return False

    def read(self, timeout_s: float) -> str | None:
        if self._clock.now_s() < self._at_s:
            return None
        text, self._text = self._text, None
        return text


def choose(typed, menu: DemoMenu = MENU):
    return typed.display.choose_demo(menu, lambda: True)


@pytest.mark.parametrize(
    ("lines", "choice"),
    [
        (("1",), PlayDemo(2, 1)),
        (("2",), PlayDemo(2, 2)),
        (("n", "1"), PlayDemo(3, 1)),
        (("b", "2"), PlayDemo(1, 2)),
        (("n", "n", "1"), PlayDemo(3, 1)),
        (("b", "b", "1"), PlayDemo(1, 1)),
        (("",), DemoDone()),
        (("done",), DemoDone()),
        (("x", "1"), PlayDemo(2, 1)),
    ],
)
def test_the_demonstration_plays_what_is_chosen(typed, lines, choice):
    typed.type(*lines)
    assert choose(typed) == choice


def test_the_menu_says_what_was_felt_and_shows_the_picture_once(typed):
    typed.type("n", "1", "1")
    choose(typed)
    choose(typed, replace(MENU, played_pairs=((2, 1), (2, 2)), handle_moves=False))
    assert "Demonstration, vibration 2 of 3. Felt so far: 1." in typed.said
    assert "Demonstration, vibration 3 of 3. Nothing of it was felt yet." in typed.said
    assert "Felt so far: 1 and 2. The device is a simulation: nothing moves." in typed.said
    assert typed.said.count("1: up-left to down-right") == 1


def test_the_ends_of_the_list_are_reported(typed):
    typed.type("n", "n", "b", "b", "b", "")
    choose(typed)
    assert typed.said.count("This is the last vibration.") == 1
    assert typed.said.count("This is the first vibration.") == 1


def test_the_demonstration_can_be_left_and_ends_with_the_input(typed):
    typed.type("q")
    with pytest.raises(KeyboardInterrupt):
        choose(typed)
    typed.end()
    with pytest.raises(KeyboardInterrupt):
        choose(typed)


def test_each_end_of_the_wait_ends_the_menu(typed):
    assert typed.display.choose_demo(MENU, lambda: False) == DemoDone()


def test_what_plays_is_named_and_takes_its_time(unhurried):
    signs = []
    assert unhurried.display.show_playing(PLAYING, lambda: signs.append(unhurried.clock.now_s()) is None) is None
    assert unhurried.clock.now_s() == pytest.approx(2.0)
    assert max(b - a for a, b in pairwise([0.0, *signs])) <= 0.1
    assert "Direction 1 (up-left to down-right)" in unhurried.said


def test_lines_in_a_pipe_wait_for_the_question_after_what_plays(unhurried):
    unhurried.type("q")
    interval = PlayingNotice("Interval 1", 1, 0.5, None)
    assert unhurried.display.show_playing(interval, lambda: True) is None
    assert unhurried.said == "Interval 1"


def test_a_gap_between_two_intervals_is_silent(unhurried):
    assert unhurried.display.show_playing(PlayingNotice("", 0, 0.5, None), lambda: True) is None
    assert unhurried.out.getvalue() == ""
    assert unhurried.clock.now_s() == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("text", "reply", "after_s"),
    [
        ("q", Unanswered("the participant left", ends_sitting=True), 1.0),
        ("p", Unanswered("asked for a pause", ends_sitting=False, repeat_requested=True, pause=True), 1.0),
        ("1", None, 2.0),
    ],
)
def test_only_leaving_and_pausing_are_heard_while_something_plays(unhurried, text, reply, after_s):
    unhurried.display._conversation._lines = Person(unhurried.clock, text, at_s=1.0)
    assert unhurried.display.show_playing(PLAYING, lambda: True) == reply
    assert unhurried.clock.now_s() == pytest.approx(after_s, abs=0.11)


def test_a_fault_ends_what_plays_at_once(unhurried):
    assert unhurried.display.show_playing(PLAYING, lambda: False) == Unanswered(
        "the stimulus ended early", ends_sitting=False
    )
    assert unhurried.clock.now_s() <= 0.1


class Handle:
    """Comes back by a millimetre every tenth of a second."""

    def __init__(self, clock, away_mm: float) -> None:
        self._clock, self._away_mm = clock, away_mm

    def look(self) -> HandleView:
        left_mm = self._away_mm - 10 * self._clock.now_s()
        return HandleView(left_mm <= 0, f"Bring the handle {left_mm:.0f} mm back", (left_mm, 0.0), 5.0)


def test_the_way_back_to_the_centre_is_reported_at_most_every_second(unhurried):
    assert unhurried.display.await_handle(Handle(unhurried.clock, 25.0).look, lambda: True) is None
    assert unhurried.out.getvalue().splitlines() == [f"Bring the handle {mm} mm back" for mm in (25, 15, 5)]


def test_the_same_sentence_is_said_once(unhurried):
    views = iter([HandleView(False, "Hold still", (0.0, 0.0), 5.0)] * 100 + [HandleView(True, "", (0.0, 0.0), 5.0)])
    assert unhurried.display.await_handle(lambda: next(views), lambda: True) is None
    assert unhurried.said == "Hold still"


def test_a_handle_that_is_there_needs_no_words(unhurried):
    assert unhurried.display.await_handle(Handle(unhurried.clock, 0.0).look, lambda: True) is None
    assert unhurried.said == ""
    assert unhurried.clock.now_s() == 0.0


def test_waiting_for_the_handle_ends_by_a_fault_by_leaving_or_with_the_input(unhurried):
    away = Handle(unhurried.clock, 1e6).look
    fault = unhurried.display.await_handle(away, lambda: False)
    assert fault == Unanswered("the stimulus ended early", ends_sitting=False)
    unhurried.end()
    assert unhurried.display.await_handle(away, lambda: True) == Unanswered("the input ended", ends_sitting=True)
    unhurried.display._conversation._lines = Person(unhurried.clock, "p", at_s=3.0)
    paused = unhurried.display.await_handle(away, lambda: True)
    assert paused == Unanswered("asked for a pause", ends_sitting=False, repeat_requested=True, pause=True)
