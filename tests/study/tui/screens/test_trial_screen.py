import asyncio
from dataclasses import replace
from types import SimpleNamespace

import pytest
from textual import events

from protocols.trial import Phase
from study.devices.clock import VirtualClock
from study.session.views.views import Answered, DirectionPicture, Progress, Question, Task
from study.tui.keys import key_presses
from study.tui.keys.answer_keys import parse_keys
from study.tui.screens import trial
from study.tui.screens.trial import TrialScreen
from study.tui.trial_replies import LEAVING, PAUSE, REPEAT, TIME_OVER

PICTURE = DirectionPicture("yz", (135.0, 45.0))
QUESTION = Question(Phase.TEST, 2, 5, 7, False, 0.0, PICTURE, progress=Progress(0.42, 12))


@pytest.fixture
def asked(on_stage):
    """Presses keys while one question is asked; returns the replies, and the words on the screen at the end."""

    def ask(*keys, question=QUESTION, screen=None):
        screen = screen if screen is not None else TrialScreen()
        seen = []

        async def story(stage):
            screen.arm(question)
            await stage.press(*keys)
            seen.append(stage.words)

        return on_stage(screen, story), seen[0]

    return ask


@pytest.mark.parametrize(("key", "answer"), [("1", 1), ("2", 2)])
def test_one_and_two_answer_and_are_marked_at_once(asked, key, answer):
    (reply,), words = asked(key)
    assert isinstance(reply, Answered) and reply.answer == answer
    assert f"{answer} taken" in words


def test_other_keys_can_answer_beside_the_digits(asked):
    (reply,), _ = asked("j", screen=TrialScreen(parse_keys("f,j")))
    assert reply.answer == 2
    (reply,), _ = asked("1", screen=TrialScreen(parse_keys("f,j")))
    assert reply.answer == 1
    assert "Press f for 1, j for 2." in asked(screen=TrialScreen(parse_keys("f,j")))[1]


@pytest.mark.parametrize(("key", "reply"), [("p", PAUSE), ("q", LEAVING), ("r", REPEAT)])
def test_pause_leave_and_repeat_are_replies_that_leave_no_session(asked, key, reply):
    assert asked(key)[0] == [reply]
    assert not reply.leave


def test_a_used_up_repeat_says_so_and_does_nothing_else(asked):
    none_left = replace(QUESTION, repeats_left=0)
    replies, words = asked("r", question=none_left)
    assert not replies
    assert "No repeats are left in this run. Press 1 or 2." in words
    (reply,), _ = asked("r", "2", question=none_left)
    assert reply.answer == 2


@pytest.mark.parametrize(
    ("left", "said"),
    [
        (3, "The same vibration comes again. 2 more repeats in this run."),
        (2, "The same vibration comes again. 1 more repeat in this run."),
        (1, "The same vibration comes again. No more repeats in this run."),
        (None, "A new trial comes."),
    ],
)
def test_what_comes_after_a_repeat_is_said_as_the_sessions_rules_have_it(asked, left, said):
    replies, words = asked("r", question=replace(QUESTION, repeats_left=left))
    assert replies == [REPEAT]
    assert said in words


def test_a_question_has_one_reply_whatever_is_pressed_after_it(asked):
    replies, words = asked("1", "2", "p", "r", "1")
    assert len(replies) == 1
    assert "1 taken" in words and "2 taken" not in words


@pytest.mark.parametrize(
    ("key", "named"),
    [("x", "'x'"), ("3", "'3'"), ("enter", "Enter"), ("space", "The space bar"), ("left_square_bracket", "'['")],
)
def test_any_other_key_is_named_and_answers_nothing(asked, key, named):
    replies, words = asked(key)
    assert not replies
    assert f"{named} is no answer. Press 1 or 2." in words


def test_a_wrong_key_leaves_no_trace_in_the_next_trial(on_stage):
    screen = TrialScreen()

    async def story(stage):
        screen.arm(QUESTION)
        await stage.pilot.pause()
        before = stage.text
        await stage.press("x", "1")
        screen.saved()
        screen.arm(QUESTION)
        await stage.pilot.pause()
        assert stage.text == before

    on_stage(screen, story)


def test_a_number_pad_without_num_lock_is_recognised(asked):
    replies, words = asked("end")
    assert not replies
    assert "switch Num Lock on" in words


def test_pasted_text_is_no_answer(on_stage):
    screen = TrialScreen()

    async def story(stage):
        screen.arm(QUESTION)
        stage.app.post_message(events.Paste("1\n2\n"))
        await stage.pilot.pause()
        assert "Pasted text is no answer. Press 1 or 2." in stage.words

    assert on_stage(screen, story) == []


def test_help_is_left_to_the_application(asked):
    assert asked("question_mark")[0] == ["help"]
    assert asked("f1")[0] == ["help"]


def test_nothing_is_heard_before_it_is_armed_and_after_it_is_disarmed(on_stage):
    screen = TrialScreen()

    async def story(stage):
        await stage.press("1", "x")
        screen.arm(QUESTION)
        screen.disarm()
        await stage.press("2", "r")
        assert "Wait for the next vibration." in stage.words

    assert on_stage(screen, story) == []


@pytest.fixture
def clock(monkeypatch) -> VirtualClock:
    """Of the questions and of the keys."""
    clock = VirtualClock()
    for module in (trial, key_presses):
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=clock.now_s))
    return clock


async def press_at(stage, clock: VirtualClock, key: str) -> None:
    event = events.Key(key, key)
    event.time = clock.now_s()
    stage.app.post_message(event)
    await stage.pilot.pause()


def test_a_key_held_over_from_the_last_trial_does_not_answer_the_next(on_stage, clock):
    screen = TrialScreen()

    async def story(stage):
        screen.arm(QUESTION)
        clock.sleep(1.0)
        await press_at(stage, clock, "1")
        clock.sleep(0.1)
        screen.arm(QUESTION)
        await press_at(stage, clock, "1")
        assert "Let go of the key first." in stage.words
        assert len(stage.heard) == 1
        clock.sleep(0.25)
        await press_at(stage, clock, "2")

    assert [reply.answer for reply in on_stage(screen, story)] == [1, 2]


def test_a_burst_of_answer_keys_answers_one_question_and_never_the_next(on_stage, clock):
    screen = TrialScreen()

    async def story(stage):
        screen.arm(QUESTION)
        clock.sleep(1.0)
        typed = [events.Key(key, key) for key in "1212"]
        for event in typed:
            event.time = clock.now_s()
        stage.app.post_message(typed[0])
        await stage.pilot.pause()
        clock.sleep(0.5)
        screen.arm(QUESTION)
        for event in typed[1:]:  # read long ago, handled only now
            stage.app.post_message(event)
        await stage.pilot.pause()

    assert [reply.answer for reply in on_stage(screen, story)] == [1]


def test_an_answer_is_stamped_when_its_key_was_read_not_when_it_was_handled(on_stage):
    screen = TrialScreen()

    async def story(stage):
        screen.arm(QUESTION)
        await asyncio.sleep(0.1)
        key = events.Key("1", "1")
        key.time -= 0.05
        stage.heard.append(key.time)
        stage.app.post_message(key)
        await stage.pilot.pause()

    read_s, reply = on_stage(screen, story)
    assert reply.at_s == read_s


def test_a_key_that_was_read_before_the_question_answers_nothing(on_stage):
    screen = TrialScreen()

    async def story(stage):
        key = events.Key("1", "1")
        await asyncio.sleep(0.02)
        screen.arm(QUESTION)
        stage.app.post_message(key)
        await stage.pilot.pause()

    assert on_stage(screen, story) == []


def test_the_time_limit_ends_the_question_unless_it_was_answered(on_stage):
    screen = TrialScreen()
    limited = replace(QUESTION, time_limit_s=0.1)

    async def story(stage):
        screen.arm(limited)
        await stage.reads("The time for this answer is over.")
        screen.arm(replace(QUESTION, time_limit_s=3600.0))
        await stage.press("1")
        screen._time_over()  # at the same moment as the answer

    replies = on_stage(screen, story)
    assert replies[0] == TIME_OVER
    assert [type(reply) for reply in replies[1:]] == [Answered]


def test_a_pause_asked_for_between_two_trials_begins_with_the_next(on_stage):
    screen = TrialScreen()

    async def story(stage):
        await stage.press("p")
        assert "A moment: the pause comes next." in stage.words
        screen.arm(QUESTION)
        await stage.pilot.pause()
        assert "Pause. Let go of the handle." in stage.words

    assert on_stage(screen, story) == [PAUSE]


def test_what_became_of_the_answer_is_said_in_words(on_stage):
    screen = TrialScreen()

    async def story(stage):
        screen.arm(QUESTION)
        await stage.press("2")
        screen.saved()
        await stage.pilot.pause()
        assert "2 saved" in stage.words
        for correct, word in ((True, "Right."), (False, "Wrong.")):
            screen.show_feedback(correct)
            await stage.pilot.pause()
            assert word in stage.words
            screen.saved()
            await stage.pilot.pause()
            assert word in stage.words

    on_stage(screen, story)


def test_feedback_can_be_read_during_the_next_trial_and_no_longer(on_stage):
    screen = TrialScreen()

    async def story(stage):
        screen.arm(QUESTION)
        await stage.press("2")
        screen.show_feedback(False)
        screen.arm(QUESTION)
        await stage.pilot.pause()
        assert "Last answer: wrong. Press 1 or 2." in stage.words
        screen.arm(QUESTION)
        await stage.pilot.pause()
        assert "Last answer" not in stage.words

    on_stage(screen, story)


def test_a_trouble_can_be_read_until_the_next_trial_is_over(on_stage):
    screen = TrialScreen()

    async def story(stage):
        screen.show_trouble("Hold the handle [lightly].")
        screen.arm(QUESTION)
        await stage.pilot.pause()
        assert "Hold the handle [lightly]." in stage.words
        screen.arm(QUESTION)
        await stage.pilot.pause()
        assert "Hold the handle" not in stage.words

    on_stage(screen, story)


def test_heading_progress_and_both_directions_are_told_in_words(asked):
    _, words = asked(question=replace(QUESTION, repeated=True))
    assert "Run 2 of 5, trial 7, once more" in words
    assert "42% about 12 min left" in words
    assert "1: up-left to down-right" in words and "2: up-right to down-left" in words


def test_it_may_be_armed_before_its_first_frame(on_stage):
    screen = TrialScreen()
    screen.arm(QUESTION)

    async def story(stage):
        assert "Run 2 of 5, trial 7" in stage.words
        await stage.press("1")

    assert on_stage(screen, story)[0].answer == 1


@pytest.mark.parametrize(
    "hidden", [{"phase": Phase.CATCH}, {"time_limit_s": 30.0}], ids=["a catch trial", "a time limit"]
)
@pytest.mark.parametrize("task", list(Task))
def test_what_a_participant_must_not_know_changes_no_cell(on_stage, hidden, task):
    open_question = replace(QUESTION, task=task)
    screen = TrialScreen()
    seen = []

    async def story(stage):
        for question in (open_question, replace(open_question, **hidden)):
            screen.arm(question)
            await stage.pilot.pause()
            seen.append(stage.svg)

    on_stage(screen, story)
    assert seen[0] == seen[1]


def test_feedback_of_practice_is_not_read_in_a_run_that_counts(on_stage):
    screen = TrialScreen()

    async def story(stage):
        screen.arm(replace(QUESTION, practice=True))
        await stage.press("2")
        screen.show_feedback(False)
        screen.arm(QUESTION)
        await stage.pilot.pause()
        assert "Last answer" not in stage.words

    on_stage(screen, story)


def test_at_80_columns_the_bar_gives_way_to_the_longest_heading(on_stage):
    screen = TrialScreen()
    far_on = Question(Phase.DETECTION, 2, 5, 112, True, 0.0, PICTURE, task=Task.INTERVAL, progress=Progress(0.42, 123))

    async def story(stage):
        screen.arm(far_on)
        await stage.pilot.pause()
        assert "Interval run 2 of 5, trial 112, once more" in stage.words
        assert "about 123 min left" in stage.words

    on_stage(screen, story)
