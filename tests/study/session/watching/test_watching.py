"""What a watcher sees of a session, folded from hand-made facts. Above all: never the direction of an open trial."""

import json
from dataclasses import asdict, replace
from datetime import UTC, datetime, timedelta

import pytest

from protocols.document.hashing import protocol_hash
from protocols.document.loading import load_protocol
from protocols.trial import Phase
from study.session.facts.events import (
    AnswerGiven,
    DeviceFacts,
    FormFilled,
    NoteTaken,
    RestTaken,
    SessionClosed,
    SessionInterrupted,
    SessionOpened,
    SessionResumed,
    TrialMeasured,
    TrialPresented,
    TrialSpoiled,
)
from study.session.facts.void_reasons import SCREEN_LATE
from study.session.state.due_trial import Present
from study.session.state.machine import Finish, Rest, next_action
from study.session.watching.live import Live
from study.session.watching.watched import NO_STEADY_PART, Watched, begin_watching, follow
from study.session.watching.watching import Beside, watch_view

BEGAN = datetime(2026, 11, 22, 10, 0, tzinfo=UTC)
DEVICE = DeviceFacts("a device", simulated=False, sample_rate_hz=1000.0)


def at(seconds: float) -> str:
    return (BEGAN + timedelta(seconds=seconds)).isoformat(timespec="milliseconds")


def opened(protocol, text, seed=7) -> SessionOpened:
    return SessionOpened(
        utc=at(0),
        format="hapteq-session",
        version=1,
        session="P01_001",
        subject="P01",
        participant_number=0,
        observer="scripted",
        protocol_text=text,
        protocol_hash=protocol_hash(protocol),
        protocol_locked=False,
        seed=seed,
        device=DEVICE,
        equalizer="none",
        versions={"hapteq": "0"},
    )


def presented(action: Present, seconds: float) -> TrialPresented:
    return TrialPresented(
        utc=at(seconds),
        run=action.run,
        trial=action.trial,
        attempt=action.attempt,
        phase=action.phase,
        frequency_hz=action.frequency_hz,
        level_db=action.level_db,
        level_n=action.level_n,
        direction=action.label,
        angle_deg=action.angle_deg,
        polarity=action.polarity,
    )


def place(action: Present) -> dict[str, int]:
    return {"run": action.run, "trial": action.trial, "attempt": action.attempt}


class Story:
    """A session under way; ten seconds for each trial."""

    def __init__(self, protocol, text, seed=7) -> None:
        self.watched: Watched = begin_watching(opened(protocol, text, seed), protocol)
        self.seconds = 0.0

    def tell(self, event) -> "Story":
        self.watched = follow(self.watched, event)
        return self

    def open_trial(self) -> Present:
        action = next_action(self.watched.state)
        if isinstance(action, Rest):
            state = self.watched.state
            self.tell(RestTaken(at(self.seconds), state.run, state.trial, rested_s=action.seconds))
            action = next_action(self.watched.state)
        self.seconds += 10.0
        self.tell(presented(action, self.seconds))
        return action

    def answer(self, correct: bool, **measured) -> "Story":
        action = self.open_trial()
        answer = action.label if correct else 3 - action.label
        self.tell(AnswerGiven(at(self.seconds + 2), **place(action), answer=answer, response_time_s=2.0))
        facts = {"status": "ok", "vibrated_s": 2.0, "delivered_mps2": 4.0, "off_axis_mps2": 3.0} | measured
        return self.tell(TrialMeasured(at(self.seconds + 3), **place(action), **facts))

    def spoil(self, reason: str) -> "Story":
        action = self.open_trial()
        return self.tell(TrialSpoiled(at(self.seconds + 3), **place(action), reason=reason))

    def to_phase(self, phase: Phase) -> "Story":
        while self.watched.state.runs[self.watched.state.run].phase is not phase:
            self.answer(True)
        return self

    def finish(self) -> "Story":
        answers = iter([True, True, True, False] * 100)
        while not isinstance(next_action(self.watched.state), Finish):
            self.answer(next(answers))
        return self.tell(SessionClosed(at(self.seconds + 4), "completed"))

    def view(self, live: Live | None = None, later: float = 4.0, before=None, writer: bool | None = None):
        return watch_view(self.watched, Beside(live, writer), at(self.seconds + later), before)

    def live(self, activity="trial", age_s: float = 0.1, since_s: float = 1.0, later: float = 4.0, **changes) -> Live:
        now = self.seconds + later
        quiet = Live(at(now - age_s), activity, at(now - since_s), "", 0.5, True, 1.0, False, 0)
        return replace(quiet, **changes)


def kinds(view) -> list[str]:
    return [alarm.kind for alarm in view.alarms]


@pytest.fixture
def story(small_protocol, small_text) -> Story:
    return Story(small_protocol, small_text)


@pytest.fixture
def with_parts(small_text):
    """The small protocol and some parts more."""

    def story(*parts: str) -> Story:
        text = "\n".join((small_text, *parts))
        return Story(load_protocol(text, "small.toml"), text)

    return story


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
    assert watch_view(swapped, Beside(), now) == story.view()


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
    seen = story.answer(True, status="flagged", flags=("late", NO_STEADY_PART)).view().last[0]
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


def test_a_new_sitting_starts_its_time_anew(story):
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
def test_the_live_state_says_what_goes_on(story, activity, standing, words):
    view = story.answer(True).view(story.live(activity, since_s=1.5))
    assert (view.standing, view.activity, view.activity_s) == (standing, words, 1.5)


def test_without_a_live_state_the_log_says_what_goes_on(story):
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
        catch = next_action(story.watched.state)
        is_catch = isinstance(catch, Present) and catch.phase is Phase.CATCH
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


@pytest.mark.parametrize(("minutes", "kind", "urgent"), [(97, "time near", False), (121, "time reached", True)])
def test_the_length_of_a_sitting_is_told(story, minutes, kind, urgent):
    view = story.answer(True).view(later=60.0 * minutes)
    assert kinds(view) == [kind]
    assert view.alarms[0].urgent is urgent


def test_the_vibration_dose_is_told(with_parts):
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


def test_a_minute_without_an_answer_is_told(story):
    story.open_trial()
    assert story.view(later=59.0).alarms == ()
    late = story.view(later=61.0).alarms[0]
    assert (late.kind, late.urgent, late.since) == ("unanswered", False, at(10))


def test_an_alarm_that_lasts_keeps_its_time(story):
    first = story.answer(True).view(story.live(sensor_clipped=True), later=4.0)
    still = story.view(story.live(sensor_clipped=True, later=9.0), later=9.0, before=first)
    assert first.alarms[0].since == still.alarms[0].since == at(14)


def test_the_end_of_a_sitting_is_news_for_a_minute_and_stays_for_whoever_saw_it(story):
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
    view = watch_view(story.watched, Beside(problem="it contradicts the rules."), at(1))
    assert [a.sentence for a in view.alarms] == ["The log cannot be followed: it contradicts the rules."]


def test_elapsed_time_and_dose_follow_the_monotonic_clock_of_the_session_not_a_clock_that_was_set(story):
    story.answer(True)
    story.watched = replace(story.watched, state=replace(story.watched.state, sitting=_stamped_sitting(story, 100.0)))
    before = story.view(live=story.live(monotonic_s=104.0))
    set_forward = replace(story.live(monotonic_s=104.0), utc=at(story.seconds + 36000.0))
    after = watch_view(story.watched, Beside(set_forward, None), at(story.seconds + 36000.0))
    assert after.exposure == before.exposure
    assert after.exposure.dose_a8_mps2 > 0


def _stamped_sitting(story, monotonic_s: float):
    sitting = story.watched.state.sitting
    return replace(sitting, last=replace(sitting.last, monotonic_s=monotonic_s))


def test_a_clock_set_back_below_the_sittings_begin_silences_no_alarm(story):
    """The live state and what was noted are of this sitting, whatever their times say."""
    story.open_trial()
    back = story.live(monotonic_s=50.0, fault="the device stopped answering")
    view = watch_view(story.watched, Beside(replace(back, utc=at(-3600.0)), None), at(-3599.0))
    assert [alarm.kind for alarm in view.alarms] == ["device"]
    noted = story.tell(NoteTaken(at(-3597.0), "participant", "numb", adverse=True)).view()
    assert "adverse" in [alarm.kind for alarm in noted.alarms]


def test_a_busy_computer_is_an_alarm_from_the_first_void_trial_on(story):
    story.answer(True).spoil("the handle was let go")
    assert story.view().alarms == ()
    (alarm,) = story.spoil(SCREEN_LATE).view().alarms
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
        view = watch_view(story.watched, Beside(replace(waits, utc=now), None), now)
        assert (view.open_trial.presented_s, view.activity_s) == (4.0, 4.0)
        assert "unanswered" not in [alarm.kind for alarm in view.alarms]
    late = watch_view(story.watched, Beside(replace(waits, monotonic_s=161.0), None), at(story.seconds))
    assert "unanswered" in [alarm.kind for alarm in late.alarms]
