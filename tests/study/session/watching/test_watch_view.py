"""What the view of a running session tells: trials, runs, forms, time, and what goes on."""

from dataclasses import replace

import pytest

from protocols.trial import Phase
from study.session.facts.events import (
    FormFilled,
    NoteTaken,
    SessionInterrupted,
    SessionResumed,
)
from study.session.watching.followed_session import UNMEASURED_FLAG, PlayedProbe
from tests.watched_story import DEVICE, at


def test_an_open_trial_shows_its_level_and_how_long_it_waits(story):
    story.answer(True).open_trial()
    seen = story.view(later=7.5).open_trial
    assert (seen.run, seen.trial, seen.level_n, seen.presented_s) == (0, 1, 1.0, 7.5)


def test_runs_know_their_phase_reversals_and_trials(story):
    for correct in (True, True, True, True, True, True, True, False, False):
        story.answer(correct)
    training, test, other = story.view().runs
    assert (training.phase, training.status, training.trials) == ("training", "done", 4)
    assert (test.phase, test.status, test.trials, test.reversals, test.reversals_needed) == ("test", "present", 5, 1, 5)
    assert (other.status, other.trials, other.reversals) == ("to come", 0, 0)


def test_the_staircase_is_the_present_runs_and_after_a_run_the_last_one(story):
    story.answer(True).answer(False)
    view = story.view()
    assert [(p.trial, p.correct, p.reversal) for p in view.points] == [(0, True, False), (1, False, False)]
    assert view.next_level_n == pytest.approx(10 ** (4 / 20))
    story.answer(True).answer(True)
    resting = story.view()
    assert (resting.shown_run, len(resting.points), resting.next_level_n) == (0, 4, None)
    story.open_trial()
    assert (story.view().shown_run, story.view().points) == (1, ())


def test_delivered_and_off_axis_acceleration_and_flags_are_shown(story):
    seen = story.answer(True, status="flagged", flags=("leaning on the spring", "late")).view().last[0]
    assert (seen.delivered_mps2, seen.off_axis_mps2) == (4.0, 3.0)
    assert (seen.status, seen.remark) == ("flagged", "leaning on the spring, late")


def test_a_flag_that_older_logs_have_on_nearly_every_trial_is_not_shown(story):
    seen = story.answer(True, status="flagged", flags=("late", UNMEASURED_FLAG)).view().last[0]
    assert seen.remark == "late"


def test_catch_trials_are_counted_and_are_no_points(with_parts):
    story = with_parts("[catch]", "one_in = 4").to_phase(Phase.TEST)
    for _ in range(8):
        story.answer(True)
    view = story.view()
    catches = [trial for trial in view.last if trial.phase == "catch"]
    assert view.catch_given == len(catches) >= 1
    assert view.catch_lapses == 0
    assert all(trial.level_n == 3.0 for trial in catches)
    points = len(view.points)
    assert points == sum(trial.phase != "catch" and trial.run == view.shown_run for trial in view.last)


def test_practice_results_are_shown(with_parts):
    story = with_parts("[practice]", "frequencies_hz = [25.0]", "right_needed = 2", "of_last = 3", "trial_limit = 4")
    story.to_phase(Phase.TEST)
    line = story.view().practice[0]
    assert (line.frequency_hz, line.right, line.passed) == (25.0, 2, True)
    assert [run.phase for run in story.view().runs][:2] == ["training", "practice"]
    assert story.view().runs[1].reversals_needed == 0


def test_forms_and_notes_are_shown_the_newest_note_first(story):
    story.tell(FormFilled(at(1), "consent", "1", "", True, {}))
    story.tell(NoteTaken(at(2), "experimenter", "first"))
    story.tell(NoteTaken(at(3), "participant", "numb thumb", adverse=True))
    view = story.view()
    assert [(form.form, form.passed) for form in view.forms] == [("consent", True)]
    assert [note.text for note in view.notes] == ["numb thumb", "first"]


def test_time_and_dose_count_from_the_first_movement(story):
    assert story.view().exposure.elapsed_min == 0
    story.answer(True)
    exposure = story.view(later=120.0).exposure
    assert exposure.elapsed_min == pytest.approx(2.0)
    assert exposure.time_share == pytest.approx(2 / 120)
    assert 0 < exposure.dose_a8_mps2 < 0.1
    assert exposure.dose_share == pytest.approx(exposure.dose_a8_mps2 / 2.5)


def test_a_new_sitting_starts_its_time_again(story):
    story.answer(True).tell(SessionInterrupted(at(100), "the participant left"))
    assert story.view().exposure.elapsed_min == pytest.approx(1.5)
    story.tell(SessionResumed(at(4000), DEVICE, {}))
    story.seconds = 4000.0
    assert story.view().exposure.elapsed_min == 0


@pytest.mark.parametrize(
    ("activity", "standing", "words"),
    [
        ("pause", "paused", "pausing"),
        ("rest", "resting", "resting"),
        ("form", "running", "filling in a form"),
        ("demo", "running", "feeling the demonstration"),
        ("waiting for the handle", "running", "waiting for the handle to come to its place"),
        ("trial", "running", "between two trials"),
    ],
)
def test_the_live_state_says_what_continues(story, activity, standing, words):
    view = story.answer(True).view(story.live(activity, since_s=1.5))
    assert (view.standing, view.activity, view.activity_s) == (standing, words, 1.5)


def test_without_a_live_state_the_log_says_what_continues(story):
    assert story.answer(True).view().activity == "between two trials"
    for _ in range(3):
        story.answer(True)
    assert story.view().standing == "resting"
    story.open_trial()
    assert (story.view().standing, story.view().activity) == ("running", "waiting for the answer")


def test_an_ended_sitting_says_why(story):
    story.answer(True).tell(SessionInterrupted(at(20), "the experimenter stopped the session"))
    view = story.view(story.live())
    assert (view.standing, view.reason, view.live) == ("stopped", "the experimenter stopped the session", None)
    resumed = story.tell(SessionResumed(at(30), DEVICE, {})).view()
    assert (resumed.standing, resumed.reason) == ("running", "")


def test_a_program_that_is_gone_is_not_running(story):
    story.open_trial()
    view = story.view(writer=False)
    assert view.standing == "not running"
    assert "every answer is on disk" in view.reason


def test_a_probe_that_cannot_be_used_is_not_counted_among_those_without_a_drift(story):
    kept, lost = PlayedProbe(0, "hand", 1.0, 5.0, 0, "recordings/probe-000.h5"), PlayedProbe(1, "hand", 1.0, 9.0, 0)
    late = replace(kept, number=2, trouble="3 ticks late")
    story.watched = replace(story.watched, probes=(kept, lost, late))
    assert story.view().probes == 1
