import io
import os

import pytest

from protocols.trial import Phase
from study.devices.clock import RealClock, VirtualClock
from study.session.views import Answered, DirectionPicture, Question, RestNotice, Unanswered, Welcome
from study.tui.direction_picture import drawing, sentence
from study.tui.line_input import LineInput
from study.tui.plain import PlainDisplay

PICTURE = DirectionPicture("yz", (135.0, 45.0))
QUESTION = Question(Phase.TEST, run_number=2, runs_in_phase=5, trial_number=7, repeated=False, time_limit_s=0.0)


class Typed:
    """A pipe with lines in it, read by the display as a terminal would be."""

    def __init__(self) -> None:
        self._read, self._write = os.pipe()
        self.out = io.StringIO()
        self.display = PlainDisplay(LineInput(self._read), self.out, RealClock())

    def type(self, text: str) -> None:
        os.write(self._write, text.encode())

    def end(self) -> None:
        os.close(self._write)

    def ask(self, question: Question = QUESTION, alive: bool = True):
        return self.display.ask(question, lambda: alive)


@pytest.fixture
def typed():
    return Typed()


def test_one_and_two_answer(typed):
    typed.type("1\n2\n")
    assert [typed.ask().answer, typed.ask().answer] == [1, 2]


def test_a_wrong_key_is_named_and_asked_again(typed):
    typed.type("3\nyes\n2\n")
    assert typed.ask().answer == 2
    assert "'3' is no answer. Type 1 or 2 and Enter; ? for help." in typed.out.getvalue()
    assert "'yes' is no answer" in typed.out.getvalue()


def test_help_shows_the_picture_again(typed):
    typed.type("\n?\n1\n")
    typed.display.welcome(Welcome("Title", PICTURE, 5, 1, "a device", felt=True, resumed_after=0))
    before = typed.out.getvalue().count("1: up-left to down-right")
    typed.ask()
    assert typed.out.getvalue().count("1: up-left to down-right") == before + 1


def test_leaving_and_repeating_are_no_answers(typed):
    typed.type("q\nr\n")
    assert typed.ask() == Unanswered("the participant left", leave=True)
    assert typed.ask() == Unanswered("asked to repeat", leave=False, asked=True)


def test_the_end_of_the_input_leaves(typed):
    typed.end()
    assert typed.ask() == Unanswered("the input ended", leave=True)


def test_a_stimulus_that_ended_by_a_fault_ends_the_question(typed):
    typed.type("1\n")
    assert typed.ask(alive=False) == Unanswered("the stimulus ended early", leave=False)


def test_the_time_limit_ends_the_question(typed):
    question = Question(Phase.TEST, 1, 1, 1, repeated=False, time_limit_s=0.05)
    assert typed.ask(question) == Unanswered("no answer within the time limit", leave=False)


def test_the_device_gets_signs_of_life_while_nobody_answers(typed):
    signs = []

    def sign_of_life() -> bool:
        signs.append(True)
        if len(signs) == 5:
            typed.type("1\n")
        return True

    assert isinstance(typed.display.ask(QUESTION, sign_of_life), Answered)
    assert len(signs) >= 5


def test_nothing_on_the_screen_gives_away_level_frequency_or_correctness(typed):
    typed.type("1\n")
    typed.ask()
    assert typed.out.getvalue().split("\n")[1] == "Run 2 of 5, trial 7"
    assert not any(word in typed.out.getvalue().lower() for word in ("hz", " n ", "newton", "right", "wrong"))


def test_a_repeated_trial_says_so(typed):
    typed.type("1\n")
    typed.ask(Question(Phase.TRAINING, 1, 1, 3, repeated=True, time_limit_s=0.0))
    assert "Training 1 of 1, trial 3, once more" in typed.out.getvalue()


def test_practice_on_a_simulation_is_called_practice(typed):
    typed.type("\n")
    typed.display.welcome(Welcome("Title", PICTURE, 5, 0, "simulated omega.3", felt=False, resumed_after=12))
    text = " ".join(typed.out.getvalue().split())
    assert "Practice: the device is a simulation (simulated omega.3), so nothing moves here." in text
    assert "never enter an analysis of people" in text
    assert "Welcome back: 12 answers are on disk" in text


def test_a_rest_is_enforced_and_says_what_is_left():
    read, write = os.pipe()
    os.write(write, b"\n")
    out, clock = io.StringIO(), VirtualClock()
    rested_s = PlainDisplay(LineInput(read), out, clock).rest(RestNotice(seconds=25.0, runs_left=3))
    assert rested_s == pytest.approx(25.0)
    assert "for at least 25 s. 3 runs are left." in out.getvalue()


def test_after_a_void_trial_nothing_is_played_until_somebody_is_there(typed):
    typed.type("\n")
    typed.display.await_return("the stimulus was held too long")
    assert "The last trial is void: the stimulus was held too long." in typed.out.getvalue()
    assert "Press Enter when you are ready" in " ".join(typed.out.getvalue().split())


@pytest.mark.parametrize(
    ("plane", "angle_deg", "expected"),
    [
        ("yz", 135.0, "1: up-left to down-right"),
        ("yz", 45.0, "1: up-right to down-left"),
        ("yz", 90.0, "1: up to down"),
        ("xy", 0.0, "1: toward you to away from you"),
        ("zx", 45.0, "1: toward you-up to away from you-down"),
    ],
)
def test_a_direction_is_told_in_words(plane, angle_deg, expected):
    assert sentence(DirectionPicture(plane, (angle_deg, 0.0)), 1) == expected


def test_the_picture_shows_a_solid_and_a_dashed_segment_that_lean_opposite_ways():
    lines = drawing(PICTURE, columns=16, rows=8)
    first = [line[:16].strip() for line in lines[:-1]]
    second = [line[20:].strip() for line in lines[:-1]]
    dots = [sum(bin(ord(c) - 0x2800).count("1") for c in "".join(half) if c > "\u2800") for half in (first, second)]
    assert dots[0] > 1.15 * dots[1]
    top = next(line for line in lines if line.strip())
    assert top[:16].strip() and top.index(top[:16].strip()[0]) < 8
    assert lines[-1].split() == ["1", "2"]
