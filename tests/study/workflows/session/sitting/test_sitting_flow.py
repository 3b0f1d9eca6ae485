"""A sitting with everything around its trials, in virtual time: what is done, and what the log says of it."""

from dataclasses import replace

import pytest

from protocols.definition.participant_text import Question
from protocols.trial import Phase
from study.devices.clock import VirtualClock
from study.devices.device import Fault
from study.errors import UserInterruptError
from study.participants.observer_catalogue import find_observer
from study.session.facts.events import (
    DemoPlayed,
    DeviceChecked,
    FormFilled,
    NoteTaken,
    TrialMeasured,
    TrialPresented,
)
from study.session.views.form_views import FormKind, FormReply
from study.session.views.participant_views import Task
from study.store.sessions.archive import list_session_folders
from study.workflows.results.fold_session import fold_session
from study.workflows.session.conduct_session import Participant, conduct_new, conduct_resumed
from study.workflows.session.simulated_display import SimulatedDisplay
from tests.study.workflows.session.sitting.person import Person, of


def test_a_whole_sitting_from_consent_to_debrief(plan, full, seat, person):
    end = conduct_new(plan(full), "simulated", seat)
    assert not end.end_reason
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


def test_where_only_closing_questions_are_left_no_instructions_ask_for_the_handle(plan, small_protocol, seat, clock):
    class Leaver(Person):
        def fill_in(self, form):
            raise KeyboardInterrupt

    protocol, leaver = replace(small_protocol, debrief=(Question("strategy", "How?"),)), Leaver(clock)
    with pytest.raises(UserInterruptError):
        conduct_new(plan(protocol), "simulated", replace(seat, display=leaver, hand=leaver))
    returned = Person(clock)
    (folder,) = list_session_folders(plan(protocol).data_folder)
    end = conduct_resumed(folder, "simulated", replace(seat, display=returned, hand=returned))
    assert returned.calls == [FormKind.DEBRIEF] and end.state.closed


@pytest.mark.slow
def test_the_question_does_not_show_which_trial_is_a_catch_trial(plan, full, seat, person):
    conduct_new(plan(full), "simulated", seat)
    assert Phase.CATCH not in {question.phase for question in person.questions}


@pytest.mark.slow
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
    assert end.end_reason
    assert of(end, TrialPresented) == of(end, DemoPlayed) == []
    assert end.fault is Fault.NONE


@pytest.mark.slow
def test_a_set_up_that_differs_is_reported_and_noted(plan, full, seat, person):
    person.fill_in = lambda form: FormReply(
        {f.key: ("nothing" if f.key == "hearing" else f.choices[0] if f.choices else "") for f in form.fields}
        if form.kind is FormKind.SETUP
        else {f.key: "no" if form.kind is FormKind.EXCLUSION else "yes" for f in form.fields}
    )
    end = conduct_new(plan(full), "simulated", seat)
    assert person.told == ["The set-up is not the protocol's: the device can be heard."]
    assert [note.text for note in of(end, NoteTaken)] == person.told


@pytest.mark.slow
def test_practice_says_how_it_went(plan, full, seat, person):
    conduct_new(plan(full), "simulated", seat)
    results = [call for call in person.calls if hasattr(call, "passed")]
    assert len(results) == 1
    assert results[0].passed
    assert (results[0].correct_count, results[0].answer_count) == (2, 2)


@pytest.mark.slow
def test_the_same_seed_and_answers_give_the_same_trials_for_any_participant(plan, small_protocol, seat, tmp_path):
    """A person with forms and checks, and a simulated participant without: equal draws, equal levels."""
    person = conduct_new(plan(small_protocol), "simulated", seat)
    clock = VirtualClock()
    display = SimulatedDisplay(find_observer("ideal", 11), 11, clock)
    simulated = replace(plan(small_protocol), observer="ideal", subject="S1")
    headless = conduct_new(simulated, "simulated", Participant(display=display, hand=display, clock=clock))
    drawn = [(t.run, t.trial, t.phase, t.frequency_hz, t.level_n, t.direction_shown) for t in person.state.trials]
    assert drawn == [
        (t.run, t.trial, t.phase, t.frequency_hz, t.level_n, t.direction_shown) for t in headless.state.trials
    ]


@pytest.mark.slow
def test_before_the_first_trial_the_computer_is_checked_with_the_device_and_both_are_logged(plan, full, seat):
    end = conduct_new(plan(full), "simulated", seat)
    (checked,) = of(end, DeviceChecked)
    assert "Load: this system does not report it, so it was not checked" in checked.findings  # in virtual time
    (lateness,) = [finding for finding in checked.findings if finding.startswith("Lateness: ")]
    assert "99 % within 0.00 ms" in lateness


class NeverOnTime(VirtualClock):
    """Every sleep of the check ends 67 ms late."""

    def sleep(self, seconds: float) -> None:
        super().sleep(max(seconds, 0.0) + (0.067 if seconds < 0.002 else 0.0))


@pytest.mark.slow
def test_a_computer_that_is_too_late_is_a_warning_that_the_experimenter_continues_from_and_that_is_logged(plan, full):
    clock = NeverOnTime()
    person = Person(clock)
    end = conduct_new(plan(full), "simulated", Participant(display=person, hand=person, clock=clock))
    (checked,) = of(end, DeviceChecked)
    assert checked.passed
    (lateness,) = [finding for finding in checked.findings if finding.startswith("Lateness: ")]
    assert lateness.endswith("a simulated one waits (warning)")
