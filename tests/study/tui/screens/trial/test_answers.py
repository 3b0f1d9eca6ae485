"""The screen of a trial: which key answers, once, and when it was pressed."""

import asyncio
from dataclasses import replace
from types import SimpleNamespace

import pytest
from textual import events

from study.devices.clock import VirtualClock
from study.session.views.participant_views import Answered
from study.tui.keys import key_presses
from study.tui.keys.answer_keys import parse_keys
from study.tui.screens import trial
from study.tui.screens.trial import TrialScreen
from study.tui.trial_replies import LEAVING, PAUSE, REPEAT
from tests.study.tui.screens.trial.questions import QUESTION


@pytest.mark.parametrize(("key", "answer"), [("1", 1), ("2", 2)])
def test_one_and_two_answer_and_are_marked_at_once(asked, key, answer):
    (reply,), words = asked(key)
    assert isinstance(reply, Answered) and reply.answer == answer
    assert f"{answer} taken" in words


@pytest.mark.slow
def test_other_keys_can_answer_beside_the_digits(asked):
    (reply,), _ = asked("j", screen=TrialScreen(parse_keys("f,j")))
    assert reply.answer == 2
    (reply,), _ = asked("1", screen=TrialScreen(parse_keys("f,j")))
    assert reply.answer == 1
    assert "Press f for 1, j for 2." in asked(screen=TrialScreen(parse_keys("f,j")))[1]


@pytest.mark.parametrize(("key", "reply"), [("p", PAUSE), ("q", LEAVING), ("r", REPEAT)])
def test_pause_leave_and_repeat_are_replies_that_leave_no_session(asked, key, reply):
    assert asked(key)[0] == [reply]
    assert not reply.ends_sitting


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


def test_a_question_has_one_reply_and_ignores_later_keys(asked):
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
        screen.show_saved()
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


@pytest.mark.slow
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
    assert reply.key_time_s == read_s


def test_a_key_that_was_read_before_the_question_answers_nothing(on_stage):
    screen = TrialScreen()

    async def story(stage):
        key = events.Key("1", "1")
        await asyncio.sleep(0.02)
        screen.arm(QUESTION)
        stage.app.post_message(key)
        await stage.pilot.pause()

    assert on_stage(screen, story) == []
