"""What the view of a running session must not show: the open trial, its direction, the seed."""

import json
from dataclasses import asdict, replace

import pytest

from study.session.facts.events import (
    AnswerGiven,
    TrialMeasured,
    TrialSpoiled,
)
from study.session.watching.make_watch_view import LiveInfo, make_watch_view
from tests.watched_story import Story, at, place


def test_two_sessions_that_differ_only_in_what_the_open_trial_plays_look_the_same(small_protocol, small_text):
    drawn, views = {}, set()
    for seed in range(40):
        story = Story(small_protocol, small_text, seed)
        if [run.frequency_hz for run in story.watched.state.runs] != [5.0, 25.0, 35.0]:
            continue
        action = story.open_trial()
        drawn[seed] = (action.label, action.angle_deg, action.polarity)
        views.add(story.view(story.live()))
    assert len(set(drawn.values())) == 4
    assert len(views) == 1


@pytest.mark.parametrize("answers", [0, 1, 5, 9, 14])
def test_no_field_tells_the_open_trial_wherever_in_the_session_it_is(story, answers):
    for number in range(answers):
        story.answer(number % 3 > 0)
    story.open_trial()
    state = story.watched.state
    other = replace(
        state.presented,
        direction=3 - state.presented.direction,
        angle_deg=state.presented.angle_deg + 90.0,
        polarity=-state.presented.polarity,
    )
    row = replace(state.trials[-1], direction_shown=other.direction, angle_deg=other.angle_deg)
    swapped = replace(story.watched, state=replace(state, presented=other, trials=(*state.trials[:-1], row)))
    now = at(story.seconds + 4)
    assert make_watch_view(swapped, LiveInfo(), now) == story.view()


def test_the_direction_appears_once_the_answer_counts(story):
    """While it is measured it may still turn out void: then the same stimulus comes again."""
    action = story.open_trial()
    assert story.view().last == ()
    story.tell(AnswerGiven(at(12), **place(action), answer=3 - action.label, response_time_s=2.0))
    seen = story.view().last[0]
    assert (seen.shown, seen.answer, seen.correct, seen.status) == (None, 3 - action.label, None, "measuring")
    assert story.view().open_trial is None
    assert story.view().activity == "measuring"
    seen = story.tell(TrialMeasured(at(13), **place(action), status="ok")).view().last[0]
    assert (seen.shown, seen.correct) == (action.label, False)


def test_the_direction_of_an_answered_trial_that_turned_out_void_stays_hidden(story):
    action = story.open_trial()
    story.tell(AnswerGiven(at(12), **place(action), answer=action.label, response_time_s=2.0))
    seen = story.tell(TrialSpoiled(at(13), **place(action), reason="ticks were missed")).view().last[0]
    assert (seen.shown, seen.correct, seen.status) == (None, None, "spoiled")


def test_the_direction_of_a_void_trial_without_an_answer_stays_hidden(story):
    seen = story.spoil("the device let go").view().last[0]
    assert (seen.shown, seen.answer, seen.correct) == (None, None, None)
    assert (seen.status, seen.remark) == ("spoiled", "the device let go")


def test_the_view_has_no_seed_and_fits_into_json(story):
    document = asdict(story.answer(True).view(story.live()))
    assert "seed" not in json.dumps(document)
