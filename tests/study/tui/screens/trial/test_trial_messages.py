"""The screen of a trial: time limit, feedback, troubles, and what a participant must not know."""

from dataclasses import replace

import pytest

from protocols.trial import Phase
from protocols.wording.words import Words
from study.session.views.participant_views import Answered, Progress, Question, Task
from study.tui.screens.trial import TrialScreen
from study.tui.trial_replies import PAUSE, TIME_OVER
from tests.study.tui.screens.trial.questions import PICTURE, QUESTION


def test_the_time_limit_ends_the_question_unless_it_was_answered(on_stage):
    screen = TrialScreen()
    limited = replace(QUESTION, time_limit_s=0.1)

    async def story(stage):
        screen.arm(limited)
        await stage.reads("The time for this answer is over.")
        screen.arm(replace(QUESTION, time_limit_s=3600.0))
        await stage.press("1")
        screen._end_at_time_limit()  # at the same moment as the answer

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


def test_what_became_of_the_answer_is_reported_in_words(on_stage):
    screen = TrialScreen()

    async def story(stage):
        screen.arm(QUESTION)
        await stage.press("2")
        screen.show_saved()
        await stage.pilot.pause()
        assert "2 saved" in stage.words
        for correct, word in ((True, "Right."), (False, "Wrong.")):
            screen.show_feedback(correct)
            await stage.pilot.pause()
            assert word in stage.words
            screen.show_saved()
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


def test_a_message_is_shown_to_its_last_word(asked):
    words = {"no_repeats": "Es geht nicht noch einmal." * 3, "press": "Drücken Sie {keys}."}
    _, shown = asked("r", question=replace(QUESTION, repeats_left=0), screen=TrialScreen(words=Words(words)))
    assert "Drücken Sie 1 or 2." in shown


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
