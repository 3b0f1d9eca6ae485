"""What is an alarm while a session is watched, and what is none."""

from dataclasses import replace

import pytest

from protocols.trial import Phase
from study.session.facts.events import (
    NoteTaken,
    SessionInterrupted,
    SessionResumed,
)
from study.session.facts.void_reasons import SCREEN_DELAYED_BY_LOAD, TOO_LITTLE_MOTION
from study.session.state.due_trial import PresentTrial
from study.session.state.machine import find_next_action
from study.session.watching.make_watch_view import LiveInfo, make_watch_view
from tests.watched_story import DEVICE, at, kinds


def test_a_finished_session_has_no_alarms(story):
    view = story.finish().view(writer=False)
    assert (view.standing, view.alarms, view.open_trial, view.next_level_n) == ("finished", (), None, None)
    assert {run.status for run in view.runs} == {"done"}


def test_a_quiet_session_rings_nothing(story):
    assert story.answer(True).view(story.live()).alarms == ()


@pytest.mark.parametrize(
    ("changes", "kind", "sentence"),
    [
        ({"fault": "the device was lost"}, "device", "The device reported a fault: the device was lost."),
        ({"sensor_clipped": True}, "sensor", "it reads too little"),
        ({"activity": "waiting for the handle", "handle_ready": False, "since_s": 2.5}, "handle", "no trial starts"),
        ({"activity": "rest", "age_s": 3.5}, "silent", "it hangs, or was killed"),
    ],
)
def test_the_live_state_can_be_an_alarm(story, changes, kind, sentence):
    view = story.answer(True).view(story.live(**changes))
    assert kinds(view) == [kind]
    assert sentence in view.alarms[0].sentence


@pytest.mark.parametrize(
    "changes",
    [
        {"activity": "waiting for the handle", "handle_ready": False, "since_s": 1.5},
        {"activity": "rest", "age_s": 2.5},
        {"activity": "form", "age_s": 300.0},
        {"activity": "pause", "age_s": 300.0},
        {"activity": "trial", "age_s": 300.0},
        {"activity": "trial", "offset_mm": 40.0},
    ],
)
def test_what_is_no_alarm(story, changes):
    assert story.answer(True).view(story.live(**changes)).alarms == ()


def test_silence_in_the_middle_of_a_trial_is_an_alarm(story):
    story.open_trial()
    assert kinds(story.view(story.live(age_s=3.5))) == ["silent"]


def test_what_an_earlier_sitting_left_behind_is_no_alarm(story):
    left_behind = story.answer(True).live("rest")
    story.tell(SessionInterrupted(at(20), "left"))
    story.tell(SessionResumed(at(4000), DEVICE, {}))
    story.seconds = 4000.0
    view = story.view(left_behind)
    assert (view.live, view.alarms) == (None, ())


def test_a_handle_out_of_its_gate_in_a_trial_is_an_alarm(with_parts):
    story = with_parts("[gate]", "radius_mm = 10.0")
    story.open_trial()
    assert story.view(story.live(offset_mm=9.0)).alarms == ()
    assert kinds(story.view(story.live(offset_mm=11.0))) == ["handle"]


def test_two_lapses_of_the_last_five_catch_trials_are_an_alarm(with_parts):
    story = with_parts("[catch]", "one_in = 4").to_phase(Phase.TEST)
    lapses = 0
    while lapses < 2:
        assert kinds(story.view()) == []
        catch = find_next_action(story.watched.state)
        is_catch = isinstance(catch, PresentTrial) and catch.phase is Phase.CATCH
        story.answer(not is_catch)
        lapses += is_catch
    assert kinds(story.view()) == ["lapses"]
    assert "2 of the last 2 catch trials were wrong" in story.view().alarms[0].sentence


def test_three_void_trials_of_ten_are_an_alarm(story):
    story.answer(True).spoil("a fault").spoil("a fault")
    assert kinds(story.view()) == []
    story.spoil("late ticks")
    assert kinds(story.view()) == ["voids"]
    assert "3 of the last 4 presentations were void, the last because late ticks" in story.view().alarms[0].sentence


def test_a_trial_of_which_hardly_anything_arrived_is_an_alarm(story):
    story.answer(True)
    assert kinds(story.view()) == []
    story.answer(True, flags=("slew limited", TOO_LITTLE_MOTION), status="flagged")
    assert kinds(story.view()) == ["still"]
    sentence = story.view().alarms[0].sentence
    assert "In 1 of the last 2 presentations less motion arrived" in sentence and "look at motors" in sentence


@pytest.mark.parametrize(("minutes", "kind", "urgent"), [(97, "time near", False), (121, "time reached", True)])
def test_the_length_of_a_sitting_is_reported(story, minutes, kind, urgent):
    view = story.answer(True).view(later=60.0 * minutes)
    assert kinds(view) == [kind]
    assert view.alarms[0].urgent is urgent


def test_the_vibration_dose_is_reported(with_parts):
    limited = with_parts("[limits]", "dose_a8_mps2 = 0.05")
    seen = []
    while "dose reached" not in seen:
        seen = [*seen, *kinds(limited.answer(True, vibrated_s=1.0).view())]
    assert seen[0] == "dose near"


def test_an_adverse_event_is_an_alarm_of_its_own_each_time(story):
    first = story.tell(NoteTaken(at(1), "participant", "numb", adverse=True)).view()
    assert [(a.kind, a.since, a.event) for a in first.alarms] == [("adverse", at(1), True)]
    second = story.tell(NoteTaken(at(2), "participant", "pain", adverse=True)).view(before=first)
    assert [(a.sentence, a.since) for a in second.alarms] == [("Adverse event: pain", at(2))]


def test_a_minute_without_an_answer_is_reported(story):
    story.open_trial()
    assert story.view(later=59.0).alarms == ()
    late = story.view(later=61.0).alarms[0]
    assert (late.kind, late.urgent, late.since) == ("unanswered", False, at(10))


def test_an_alarm_that_lasts_keeps_its_time(story):
    first = story.answer(True).view(story.live(sensor_clipped=True), later=4.0)
    still = story.view(story.live(sensor_clipped=True, later=9.0), later=9.0, before=first)
    assert first.alarms[0].since == still.alarms[0].since == at(14)


def test_the_end_of_a_sitting_is_news_for_a_minute_and_stays_in_an_open_view(story):
    story.answer(True).tell(SessionInterrupted(at(20), "the device was lost"))
    saw = story.view(later=12.0)
    assert [a.sentence for a in saw.alarms] == ["The sitting ended: the device was lost."]
    assert kinds(story.view(later=600.0, before=saw)) == ["ended"]
    assert kinds(story.view(later=600.0)) == []


def test_a_killed_program_is_an_alarm(story):
    story.open_trial()
    assert kinds(story.view(later=5.0, writer=False)) == ["gone"]
    assert kinds(story.view(later=500.0, writer=False)) == []


def test_a_log_that_cannot_be_followed_is_an_alarm(story):
    view = make_watch_view(story.watched, LiveInfo(problem="it contradicts the rules."), at(1))
    assert [a.sentence for a in view.alarms] == ["The log cannot be followed: it contradicts the rules."]


def test_elapsed_time_and_dose_follow_the_monotonic_clock_of_the_session_not_a_clock_that_was_set(story):
    story.answer(True)
    story.watched = replace(story.watched, state=replace(story.watched.state, sitting=_stamped_sitting(story, 100.0)))
    before = story.view(live=story.live(monotonic_s=104.0))
    set_forward = replace(story.live(monotonic_s=104.0), utc=at(story.seconds + 36000.0))
    after = make_watch_view(story.watched, LiveInfo(set_forward, None), at(story.seconds + 36000.0))
    assert after.exposure == before.exposure
    assert after.exposure.dose_a8_mps2 > 0


def _stamped_sitting(story, monotonic_s: float):
    sitting = story.watched.state.sitting
    return replace(sitting, last_moment=replace(sitting.last_moment, monotonic_s=monotonic_s))


def test_a_clock_set_back_below_the_sittings_begin_silences_no_alarm(story):
    """The live state and what was noted are of this sitting, at any time that they state."""
    story.open_trial()
    back = story.live(monotonic_s=50.0, fault="the device stopped answering")
    view = make_watch_view(story.watched, LiveInfo(replace(back, utc=at(-3600.0)), None), at(-3599.0))
    assert [alarm.kind for alarm in view.alarms] == ["device"]
    noted = story.tell(NoteTaken(at(-3597.0), "participant", "numb", adverse=True)).view()
    assert "adverse" in [alarm.kind for alarm in noted.alarms]


def test_a_busy_computer_is_an_alarm_from_the_first_void_trial_on(story):
    story.answer(True).spoil("the handle was let go")
    assert story.view().alarms == ()
    (alarm,) = story.spoil(SCREEN_DELAYED_BY_LOAD).view().alarms
    assert (alarm.kind, alarm.urgent) == ("busy", True)
    assert alarm.sentence == (
        "The computer is too busy: 1 of the last 3 presentations was void because of it. Close other programs."
    )
    for _ in range(10):
        story.answer(True)
    assert "busy" not in [alarm.kind for alarm in story.view().alarms]


def test_how_long_a_trial_waits_follows_no_clock_that_was_set(story):
    story.open_trial()
    presented = replace(story.watched.state.presented, monotonic_s=100.0)
    story.watched = replace(story.watched, state=replace(story.watched.state, presented=presented))
    waits = story.live(monotonic_s=104.0)
    for hours in (-5.0, 0.0, 5.0):
        now = at(story.seconds + 3600.0 * hours)
        view = make_watch_view(story.watched, LiveInfo(replace(waits, utc=now), None), now)
        assert (view.open_trial.presented_s, view.activity_s) == (4.0, 4.0)
        assert "unanswered" not in [alarm.kind for alarm in view.alarms]
    late = make_watch_view(story.watched, LiveInfo(replace(waits, monotonic_s=161.0), None), at(story.seconds))
    assert "unanswered" in [alarm.kind for alarm in late.alarms]
