from dataclasses import replace

import pytest

from protocols.trial import Phase
from study.session.facts.void_reasons import SCREEN_DELAYED_BY_LOAD
from study.session.views.participant_views import (
    Answered,
    DirectionPicture,
    Goodbye,
    PracticeResult,
    Progress,
    Question,
    Task,
    Unanswered,
    Welcome,
)
from study.tui.drawing.direction_picture import describe_direction, draw_directions
from study.tui.keys.answer_keys import AnswerKeys
from study.tui.trial_replies import REPEAT, TIME_OVER

PICTURE = DirectionPicture("yz", (135.0, 45.0))
QUESTION = Question(Phase.TEST, 2, 5, trial_number=7, repeated=False, time_limit_s=0.0, picture=PICTURE)


def ask(typed, question: Question = QUESTION, alive: bool = True):
    return typed.display.ask(question, lambda: alive)


def test_one_and_two_answer(typed):
    typed.type("1", "2")
    assert [ask(typed).answer, ask(typed).answer] == [1, 2]


def test_a_wrong_key_is_named_and_asked_again(typed):
    typed.type("3", "yes", "2")
    assert ask(typed).answer == 2
    assert "'3' is no answer. Type 1 or 2 and Enter; ? for help." in typed.out.getvalue()
    assert "'yes' is no answer" in typed.out.getvalue()


def test_help_shows_the_picture_again(typed):
    typed.type("", "?", "1")
    typed.display.welcome(Welcome("Title", PICTURE, 5, 1, "a device", device_moves=True, resumed_after=0))
    before = typed.out.getvalue().count("1: up-left to down-right")
    ask(typed)
    assert typed.out.getvalue().count("1: up-left to down-right") == before + 1


def test_leaving_and_repeating_are_no_answers(typed):
    typed.type("q", "r")
    assert ask(typed) == Unanswered("the participant left", ends_sitting=True)
    assert ask(typed) == Unanswered("asked to repeat", ends_sitting=False, repeat_requested=True)


def test_a_used_up_repeat_says_so_and_waits_for_an_answer(typed):
    typed.type("r", "2")
    assert ask(typed, replace(QUESTION, repeats_left=0)).answer == 2
    assert "No repeats are left in this run." in typed.out.getvalue()
    typed.type("r")
    assert ask(typed, replace(QUESTION, repeats_left=1)) == REPEAT
    assert "The same vibration comes again. No more repeats in this run." in typed.out.getvalue()


def test_the_end_of_the_input_leaves(typed):
    typed.end()
    assert ask(typed) == Unanswered("the input ended", ends_sitting=True)


def test_a_stimulus_that_ended_by_a_fault_ends_the_question(typed):
    typed.type("1")
    assert ask(typed, alive=False) == Unanswered("the stimulus ended early", ends_sitting=False)


def test_the_time_limit_ends_the_question(typed):
    question = Question(Phase.TEST, 1, 1, 1, repeated=False, time_limit_s=0.05, picture=PICTURE)
    assert ask(typed, question) == TIME_OVER


def test_the_device_gets_signs_of_life_while_an_answer_is_awaited(typed):
    signs = []

    def sign_of_life() -> bool:
        signs.append(True)
        if len(signs) == 5:
            typed.type("1")
        return True

    assert isinstance(typed.display.ask(QUESTION, sign_of_life), Answered)
    assert len(signs) >= 5


def test_nothing_on_the_screen_gives_away_level_frequency_or_correctness(typed):
    typed.type("1")
    ask(typed)
    assert typed.out.getvalue().split("\n")[1] == "Run 2 of 5, trial 7"
    assert not any(word in typed.out.getvalue().lower() for word in ("hz", " n ", "newton", "right", "wrong"))


def test_a_repeated_trial_says_so(typed):
    typed.type("1")
    ask(typed, Question(Phase.TRAINING, 1, 1, 3, repeated=True, time_limit_s=0.0, picture=PICTURE))
    assert "Training 1 of 1, trial 3, once more" in typed.out.getvalue()


def test_practice_on_a_simulation_is_called_practice(typed):
    typed.type("")
    typed.display.welcome(Welcome("Title", PICTURE, 5, 0, "simulated omega.3", device_moves=False, resumed_after=12))
    text = " ".join(typed.out.getvalue().split())
    assert "Practice: the device is a simulation (simulated omega.3), so nothing moves here." in text
    assert "never enter an analysis of people" in text
    assert "Welcome back: 12 answers are on the disk" in text
    assert "5 runs are left." in text


def test_after_a_void_trial_nothing_is_played_before_a_key_press(typed):
    typed.type("")
    typed.display.await_return("the stimulus was held too long")
    assert "The last trial does not count. It is void: the stimulus was held too long." in typed.out.getvalue()
    assert "Press Enter when you are ready" in " ".join(typed.out.getvalue().split())


def test_a_pause_is_asked_for_in_any_trial(typed):
    typed.type("p")
    assert ask(typed) == Unanswered("asked for a pause", ends_sitting=False, repeat_requested=True, pause=True)


def test_keys_of_ones_own_answer_and_the_digits_still_do(typed_in):
    typed = typed_in(keys=AnswerKeys("f", "j"))
    typed.type("j", "1", "x", "F")
    assert [ask(typed).answer for _ in range(3)] == [2, 1, 1]
    assert "f for 1, j for 2? " in typed.out.getvalue()
    assert "'x' is no answer. Type f for 1, j for 2 and Enter; ? for help." in typed.said


def test_a_detection_trial_asks_for_the_interval_and_explains_it(typed):
    typed.type("?", "2")
    assert ask(typed, replace(QUESTION, phase=Phase.DETECTION, task=Task.INTERVAL)).answer == 2
    assert "Interval run 2 of 5, trial 7 Which interval, 1 or 2? " in typed.said
    assert "In one of the two intervals it shook" in typed.said
    assert "up-left" not in typed.said


def test_a_practice_trial_is_called_practice(typed):
    typed.type("1")
    ask(typed, replace(QUESTION, practice=True, phase=Phase.TRAINING))
    assert "Practice 2 of 5, trial 7" in typed.said


def test_progress_is_reported_once_in_a_run(typed):
    typed.type("1", "1", "2", "1")
    for trial in (1, 2):
        ask(typed, replace(QUESTION, trial_number=trial, progress=Progress(0.25, 12)))
    assert typed.said.count("25% of the session is done, about 12 minutes left.") == 1
    ask(typed, replace(QUESTION, run_number=3, progress=Progress(0.5, 1)))
    assert "50% of the session is done, about 1 minute left." in typed.said
    ask(typed, replace(QUESTION, run_number=4, progress=Progress(0.5, None)))
    assert "50% of the session is done." in typed.said


@pytest.mark.parametrize(
    ("passed", "words"), [(True, "That is enough to go on."), (False, "hard to tell for everyone")]
)
def test_the_end_of_a_practice_is_reported_and_read(typed, passed, words):
    typed.type("")
    typed.display.practice_over(PracticeResult(passed, correct_count=3, answer_count=5))
    assert "Right answers: 3 of the last 5." in typed.said
    assert words in typed.said


@pytest.mark.parametrize("call", ["welcome", "practice_over", "await_return"])
def test_a_wait_for_enter_can_be_left(typed, call):
    values = {
        "welcome": Welcome("Title", PICTURE, 5, 0, "a device", device_moves=True, resumed_after=0),
        "practice_over": PracticeResult(True, 4, 5),
        "await_return": "held too long",
    }
    typed.type("q")
    with pytest.raises(KeyboardInterrupt):
        getattr(typed.display, call)(values[call])
    typed.end()
    with pytest.raises(KeyboardInterrupt):
        getattr(typed.display, call)(values[call])


def test_the_end_is_told_finished_or_not(typed):
    typed.display.goodbye(Goodbye(finished=True, answers=7))
    typed.display.goodbye(Goodbye(finished=False, answers=3, reason="the participant left"))
    assert "Finished: 7 answers. Thank you." in typed.said
    assert "This sitting is over: the participant left. 3 answers are on the disk." in typed.said


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
def test_a_direction_is_reported_in_words(plane, angle_deg, expected):
    assert describe_direction(DirectionPicture(plane, (angle_deg, 0.0)), 1) == expected


def test_the_picture_shows_a_solid_and_a_dashed_segment_that_lean_opposite_ways():
    lines = draw_directions(PICTURE, columns=16, rows=8)
    first = [line[:16].strip() for line in lines[:-1]]
    second = [line[20:].strip() for line in lines[:-1]]
    dots = [sum(bin(ord(c) - 0x2800).count("1") for c in "".join(half) if c > "\u2800") for half in (first, second)]
    assert dots[0] > 1.15 * dots[1]
    top = next(line for line in lines if line.strip())
    assert top[:16].strip() and top.index(top[:16].strip()[0]) < 8
    assert lines[-1].split() == ["1", "2"]


def test_a_trial_that_a_busy_computer_spoiled_is_not_the_participants_fault(typed):
    typed.type("")
    typed.display.await_return(SCREEN_DELAYED_BY_LOAD)
    said = typed.out.getvalue()
    assert "The last trial does not count. The computer was too busy for a moment" in " ".join(said.split())
    assert "This was not your fault, and the trial is repeated." in " ".join(said.split())
