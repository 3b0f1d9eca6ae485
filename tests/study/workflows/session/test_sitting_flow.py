"""A sitting with everything around its trials, in virtual time: what is done, and what the log says of it."""

from dataclasses import replace

import pytest

from protocols.definition.exposure import CatchSettings, DetectionSettings, GateSettings
from protocols.definition.preparation import (
    ConsentSettings,
    DebriefQuestion,
    DemoSettings,
    PracticeSettings,
    SetupSettings,
)
from protocols.document.dumping import dump_protocol
from protocols.document.loading import load_protocol
from protocols.trial import Phase
from study.devices.clock import VirtualClock
from study.devices.device import Fault
from study.participants.observers import observer_named
from study.session.facts.events import (
    AnswerGiven,
    DemoPlayed,
    DeviceChecked,
    FormFilled,
    NoteTaken,
    PauseTaken,
    RestTaken,
    TrialMeasured,
    TrialPresented,
    TrialSpoiled,
)
from study.session.views.form_views import FormKind, FormReply
from study.session.views.views import AfterPause, DemoDone, PlayDemo, Task
from study.session.watching.requests import NoteAsked, PauseAsked, StopAsked
from study.store.sessions.event_log import read_log
from study.store.sessions.request_inbox import RequestInbox
from study.workflows.results.fold_session import fold_session
from study.workflows.session.conduct_session import Participant, conduct_new, conduct_resumed
from study.workflows.session.open_session import SessionPlan
from study.workflows.session.simulated_display import SimulatedDisplay


class Person(SimulatedDisplay):
    """Answers like a simulated participant, and does what a test wants at each other call."""

    def __init__(self, clock, seed=11):
        super().__init__(observer_named("ideal", seed), seed, clock)
        self.calls, self.questions, self.playing, self.told = [], [], [], []
        self.at_question = lambda question: None
        self.at_pause = lambda: None
        self.demo = [PlayDemo(1, 1), PlayDemo(2, 2), DemoDone()]
        self.refuse = None
        self.decisions = []

    def fill_in(self, form):
        self.calls.append(form.kind)
        if form.kind is FormKind.EXCLUSION:
            return FormReply({field.key: "yes" if self.refuse is form.kind else "no" for field in form.fields})
        reply = super().fill_in(form)
        return FormReply(dict.fromkeys(reply.answers, "no")) if self.refuse is form.kind else reply

    def device_checked(self, report):
        self.calls.append("device")
        return True

    def welcome(self, notice):
        self.calls.append("welcome")

    def choose_demo(self, menu, sign_of_life):
        self.calls.append("demo")
        return self.demo.pop(0)

    def show_playing(self, notice, sign_of_life):
        self.playing.append(notice)
        return super().show_playing(notice, sign_of_life)

    def ask(self, question, sign_of_life):
        self.questions.append(question)
        self.at_question(question)
        return super().ask(question, sign_of_life)

    def practice_over(self, result):
        self.calls.append(result)

    def pause(self, notice, sign_of_life):
        self.calls.append(notice.reason)
        self.at_pause()
        if not sign_of_life():
            return AfterPause.LEAVE
        return self.decisions.pop(0) if self.decisions else AfterPause.GO_ON

    def trouble(self, sentence):
        self.told.append(sentence)


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def person(clock):
    return Person(clock)


@pytest.fixture
def seat(clock, person):
    return Participant(display=person, hand=person, clock=clock)


@pytest.fixture
def plan(tmp_path):
    def planned(protocol) -> SessionPlan:
        text = dump_protocol(protocol)
        return SessionPlan(load_protocol(text, "p.toml"), text, False, "P01", None, 11, tmp_path / "data")

    return planned


@pytest.fixture
def full(small_protocol):
    return replace(
        small_protocol,
        consent=ConsentSettings(version="3", ethics_id="EK 7/26", statements=("I agree.",), exclusions=("A wound?",)),
        setup=SetupSettings(ask=True),
        demo=DemoSettings(level_n=1.0, seconds=1.0),
        practice=PracticeSettings(frequencies_hz=(25.0,), right_needed=2, of_last=3, trial_limit=4),
        catch=CatchSettings(one_in=5),
        detection=DetectionSettings(frequencies_hz=(35.0,), trial_limit=6),
        gate=GateSettings(radius_mm=10.0),
        debrief=(DebriefQuestion("strategy", "How?"),),
    )


def of(end, kind):
    return [event for event in read_log(end.folder.log).events if isinstance(event, kind)]


def test_a_whole_sitting_from_consent_to_debrief(plan, full, seat, person):
    end = conduct_new(plan(full), "simulated", seat)
    assert not end.left
    assert person.calls[:7] == [
        *(FormKind.CONSENT, FormKind.EXCLUSION, FormKind.SETUP),
        *("device", "welcome", "demo", "demo"),
    ]
    assert person.calls[-1] is FormKind.DEBRIEF
    assert [(d.frequency_hz, d.direction) for d in of(end, DemoPlayed)] == [(5.0, 1), (25.0, 2)]
    phases = [event.phase for event in of(end, TrialPresented)]
    assert set(phases) == {Phase.TRAINING, Phase.TEST, Phase.CATCH, Phase.DETECTION}
    assert fold_session(end.folder).state == end.state
    assert [event.form for event in of(end, FormFilled)] == ["consent", "exclusion", "setup", "debrief"]
    assert all(event.answers == {} for event in of(end, FormFilled) if event.form == "exclusion")


def test_nobody_can_see_which_trial_is_a_catch_trial(plan, full, seat, person):
    conduct_new(plan(full), "simulated", seat)
    assert Phase.CATCH not in {question.phase for question in person.questions}


def test_a_detection_trial_shakes_in_one_of_its_two_intervals(plan, full, seat, person):
    end = conduct_new(plan(full), "simulated", seat)
    intervals = [notice.title for notice in person.playing if notice.title.startswith("Interval")]
    detections = [event for event in of(end, TrialPresented) if event.phase is Phase.DETECTION]
    assert len(intervals) == 2 * len(detections) > 0
    asked = [question for question in person.questions if question.task is Task.INTERVAL]
    assert len(asked) == len(detections)
    rows = [row for row in end.state.trials if row.phase is Phase.DETECTION]
    assert all(row.delivered_mps2 > 0 for row in rows)


def test_every_stimulus_tells_how_long_it_shook_and_how_far_the_handle_was(plan, full, seat):
    end = conduct_new(plan(full), "simulated", seat)
    measured = of(end, TrialMeasured)
    assert all(event.vibrated_s > 0.2 and event.offset_mm is not None for event in measured)
    shaken_s = sum(event.vibrated_s for event in measured) + sum(d.seconds for d in of(end, DemoPlayed))
    assert end.state.sitting.dose.vibrated_s == pytest.approx(shaken_s)


@pytest.mark.parametrize("form", [FormKind.CONSENT, FormKind.EXCLUSION])
def test_without_consent_or_with_an_exclusion_nothing_is_played(plan, full, seat, person, form):
    person.refuse = form
    end = conduct_new(plan(full), "simulated", seat)
    assert end.left
    assert of(end, TrialPresented) == of(end, DemoPlayed) == []
    assert end.fault is Fault.NONE


def test_a_pause_from_the_other_terminal_frees_the_hand_and_the_trial_comes_again(plan, full, seat, person, tmp_path):
    inbox = lambda: RequestInbox(tmp_path / "data" / "P01_001")  # noqa: E731
    person.at_question = lambda q: inbox().send(PauseAsked("experimenter")) if len(person.questions) == 3 else None
    end = conduct_new(plan(full), "simulated", seat)
    assert "the experimenter asked for a pause" in person.calls
    assert [event.who for event in of(end, PauseTaken)] == ["experimenter"]
    spoiled = of(end, TrialSpoiled)
    assert [event.reason for event in spoiled] == ["the experimenter asked for a pause"]
    assert not end.left


def test_a_stop_from_the_other_terminal_ends_the_sitting_and_can_be_resumed(plan, full, seat, person, tmp_path, clock):
    inbox = lambda: RequestInbox(tmp_path / "data" / "P01_001")  # noqa: E731
    person.at_question = lambda q: inbox().send(StopAsked("experimenter")) if len(person.questions) == 3 else None
    end = conduct_new(plan(full), "simulated", seat)
    assert end.left == "the experimenter stopped the session"
    assert len(of(end, AnswerGiven)) == 2
    again = Person(clock)
    resumed = conduct_resumed(end.folder, "simulated", Participant(display=again, hand=again, clock=clock))
    assert not resumed.left
    assert again.calls[:2] == [FormKind.SETUP, "device"]


def test_a_stop_during_a_rest_cuts_it_short(plan, small_protocol, seat, person, tmp_path):
    long_rest = replace(small_protocol, rests=replace(small_protocol.rests, after_run_s=600.0))
    resting = person.rest

    def rest(notice, sign_of_life):
        RequestInbox(tmp_path / "data" / "P01_001").send(StopAsked("experimenter"))
        return resting(notice, sign_of_life)

    person.rest = rest
    end = conduct_new(plan(long_rest), "simulated", seat)
    assert end.left == "the experimenter stopped the session"
    assert of(end, RestTaken) == []


def test_a_stop_during_a_pause_ends_it(plan, small_protocol, seat, person):
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant"))
    person.at_pause = lambda: seat.requests.send(StopAsked("experimenter"))
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert end.left == "the experimenter stopped the session"
    assert len(of(end, PauseTaken)) == 1


def test_a_note_is_on_the_disk_before_the_pause_is_over(plan, small_protocol, seat, person, tmp_path):
    seen = []

    def pause(notice, sign_of_life):
        seat.requests.send(NoteAsked("participant", "my thumb is numb", adverse=True))
        sign_of_life()
        seen.append((tmp_path / "data" / "P01_001" / "events.jsonl").read_text())
        return AfterPause.GO_ON

    person.pause = pause
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant")) if len(person.questions) == 2 else None
    conduct_new(plan(small_protocol), "simulated", seat)
    assert "my thumb is numb" in seen[0]


def test_notes_reach_the_log_whoever_writes_them(plan, small_protocol, seat, person):
    def noted(question):
        if len(person.questions) == 2:
            seat.requests.send(NoteAsked("participant", "my thumb is numb", adverse=True))

    person.at_question = noted
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert [(note.who, note.text, note.adverse) for note in of(end, NoteTaken)] == [
        ("participant", "my thumb is numb", True)
    ]


def test_a_set_up_that_differs_is_told_and_noted(plan, full, seat, person):
    person.fill_in = lambda form: FormReply(
        {f.key: ("nothing" if f.key == "hearing" else f.choices[0] if f.choices else "") for f in form.fields}
        if form.kind is FormKind.SETUP
        else {f.key: "no" if form.kind is FormKind.EXCLUSION else "yes" for f in form.fields}
    )
    end = conduct_new(plan(full), "simulated", seat)
    assert person.told == ["The set-up is not the protocol's: the device can be heard."]
    assert [note.text for note in of(end, NoteTaken)] == person.told


def test_whoever_withdraws_in_a_pause_ends_the_sitting(plan, small_protocol, seat, person):
    person.decisions = [AfterPause.WITHDRAW]
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant"))
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert end.withdrawn
    assert end.left == "the participant withdrew"


def test_a_pause_asked_for_during_a_pause_makes_no_second_one(plan, small_protocol, seat, person):
    person.at_pause = lambda: seat.requests.send(PauseAsked("participant"))
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant")) if len(person.questions) == 3 else None
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert len(of(end, PauseTaken)) == 1


def test_what_is_noted_during_the_goodbye_is_in_the_log(plan, small_protocol, seat, person):
    person.goodbye = lambda notice: seat.requests.send(NoteAsked("experimenter", "a rash", adverse=True))
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert not end.left
    assert [note.text for note in of(end, NoteTaken)] == ["a rash"]


def test_ctrl_c_at_the_goodbye_of_a_finished_session_leaves_it_finished(plan, small_protocol, seat, person):
    def goodbye(notice):
        raise KeyboardInterrupt

    person.goodbye = goodbye
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert not end.left
    assert end.state.closed


def test_leaving_from_a_pause_can_be_resumed(plan, small_protocol, seat, person):
    person.decisions = [AfterPause.LEAVE]
    person.at_question = lambda q: seat.requests.send(PauseAsked("participant"))
    end = conduct_new(plan(small_protocol), "simulated", seat)
    assert (end.left, end.withdrawn) == ("the participant left", False)


def test_practice_says_how_it_went(plan, full, seat, person):
    conduct_new(plan(full), "simulated", seat)
    results = [call for call in person.calls if hasattr(call, "passed")]
    assert len(results) == 1
    assert results[0].passed
    assert (results[0].right, results[0].of) == (2, 2)


def test_the_same_seed_and_answers_give_the_same_trials_whoever_sits_there(plan, small_protocol, seat, tmp_path):
    """A person with forms and checks, and a simulated participant without: equal draws, equal levels."""
    person = conduct_new(plan(small_protocol), "simulated", seat)
    clock = VirtualClock()
    display = SimulatedDisplay(observer_named("ideal", 11), 11, clock)
    simulated = replace(plan(small_protocol), observer="ideal", subject="S1")
    headless = conduct_new(simulated, "simulated", Participant(display=display, hand=display, clock=clock))
    drawn = [(t.run, t.trial, t.phase, t.frequency_hz, t.level_n, t.direction_shown) for t in person.state.trials]
    assert drawn == [
        (t.run, t.trial, t.phase, t.frequency_hz, t.level_n, t.direction_shown) for t in headless.state.trials
    ]


def test_before_the_first_trial_the_computer_is_checked_with_the_device_and_both_are_logged(plan, full, seat):
    end = conduct_new(plan(full), "simulated", seat)
    (checked,) = of(end, DeviceChecked)
    assert "Load: this system does not tell it, so it was not checked" in checked.findings  # in virtual time
    (lateness,) = [finding for finding in checked.findings if finding.startswith("Lateness: ")]
    assert "99 % within 0.00 ms" in lateness


class NeverOnTime(VirtualClock):
    """Every sleep of the check ends 67 ms late."""

    def sleep(self, seconds: float) -> None:
        super().sleep(max(seconds, 0.0) + (0.067 if seconds < 0.002 else 0.0))


def test_a_computer_that_is_too_late_is_a_warning_that_the_experimenter_goes_on_from_and_that_is_logged(plan, full):
    clock = NeverOnTime()
    person = Person(clock)
    end = conduct_new(plan(full), "simulated", Participant(display=person, hand=person, clock=clock))
    (checked,) = of(end, DeviceChecked)
    assert checked.passed
    (lateness,) = [finding for finding in checked.findings if finding.startswith("Lateness: ")]
    assert lateness.endswith("a simulated one waits (warning)")
