"""What happens around the trials: forms, demonstration, practice, catch trials, detection, limits of a sitting."""

from dataclasses import replace

import pytest

from protocols.definition.exposure import CatchSettings, DetectionSettings, SittingLimits
from protocols.definition.preparation import (
    ConsentSettings,
    DebriefQuestion,
    DemoSettings,
    PracticeSettings,
    SetupSettings,
)
from protocols.trial import Phase
from study.session.facts.events import (
    DemoFinished,
    DemoPlayed,
    DeviceChecked,
    FormFilled,
    PauseTaken,
    RestTaken,
    SessionResumed,
    TrialSpoiled,
)
from study.session.facts.log_time import Moment
from study.session.state.draw_check import LogContradiction
from study.session.state.fold import apply, begin_session
from study.session.state.machine import (
    CheckDevice,
    Demonstrate,
    FillIn,
    Finish,
    Leave,
    Rest,
    limit_reached,
    next_action,
    next_preparation,
)
from study.session.state.progress import progress
from study.session.state.vibration_dose import a8_mps2
from study.session.views.form_views import FormKind, FormReply, find_missing_fields
from study.session.views.forms import form_of, judge_form

UTC = "2026-01-01T00:00:00.000+00:00"
LATER = "2026-01-01T02:00:00.000+00:00"


@pytest.fixture
def full(small_protocol):
    """The small protocol with everything around the trials that there is."""
    return replace(
        small_protocol,
        consent=ConsentSettings(version="3", ethics_id="EK 7/26", statements=("I agree.",), exclusions=("A wound?",)),
        setup=SetupSettings(ask=True),
        demo=DemoSettings(level_n=1.0),
        practice=PracticeSettings(frequencies_hz=(25.0,), right_needed=2, of_last=3, trial_limit=4),
        debrief=(DebriefQuestion("strategy", "How?"), DebriefQuestion("felt", "Directed?", ("yes", "no"))),
    )


@pytest.fixture
def begun(facts, small_text):
    def begin(protocol, **changes):
        return begin_session(facts.opened(protocol, small_text, **changes), protocol)

    return begin


def filled(form: str, passed: bool = True, **answers: str) -> FormFilled:
    return FormFilled(UTC, form, "3", "EK 7/26", passed, answers)


def prepared(state):
    for event in (filled("consent"), filled("exclusion"), filled("setup"), DeviceChecked(UTC, True, ())):
        state = apply(state, event)
    return state


def test_a_person_is_asked_for_consent_first_and_for_the_device_last(begun, full):
    state, kinds = begun(full), []
    for event in (filled("consent"), filled("exclusion"), filled("setup"), DeviceChecked(UTC, True, ())):
        due = next_preparation(state)
        kinds.append(due.form.kind if isinstance(due, FillIn) else type(due))
        state = apply(state, event)
    assert kinds == [FormKind.CONSENT, FormKind.EXCLUSION, FormKind.SETUP, CheckDevice]
    assert next_preparation(state) is None


def test_a_simulated_participant_signs_nothing(begun, full):
    state = begun(full, observer="ideal")
    assert next_preparation(state) is None
    assert next_action(state).phase is Phase.TRAINING


@pytest.mark.parametrize(("form", "reason"), [("consent", "consent was not given"), ("exclusion", "with yes")])
def test_whoever_does_not_agree_or_may_not_take_part_feels_nothing(begun, full, form, reason):
    state = begun(full)
    if form == "exclusion":
        state = apply(state, filled("consent"))
    state = apply(state, filled(form, passed=False))
    assert isinstance(next_preparation(state), Leave)
    assert reason in next_preparation(state).reason


def test_a_resumed_session_asks_again_how_one_sits_and_nothing_else(begun, full, facts):
    state = prepared(begun(full))
    resumed = apply(state, SessionResumed(UTC, state.opened.device, {}))
    assert next_preparation(resumed).form.kind is FormKind.SETUP


def test_a_refusal_by_a_slip_of_the_finger_can_be_mended_in_another_sitting(begun, full):
    state = apply(begun(full), filled("consent", passed=False))
    again = apply(state, SessionResumed(UTC, state.opened.device, {}))
    assert next_preparation(again).form.kind is FormKind.CONSENT


def test_the_demonstration_comes_once_before_the_first_trial(begun, full):
    state = prepared(begun(full))
    assert isinstance(next_action(state), Demonstrate)
    state = apply(state, DemoPlayed(UTC, 25.0, 1.0, 1, 135.0, 2.0))
    assert isinstance(next_action(state), Demonstrate)
    state = apply(state, DemoFinished(UTC))
    assert next_action(state).phase is Phase.TRAINING


def test_nothing_is_filled_in_or_demonstrated_while_a_trial_is_open(begun, small_protocol, facts):
    state = begun(small_protocol)
    state = apply(state, facts.presented(next_action(state)))
    with pytest.raises(LogContradiction, match="while a trial is open"):
        apply(state, DemoFinished(UTC))


def test_practice_stays_at_its_level_until_it_is_passed(begun, full, facts):
    state = apply(prepared(begun(full)), DemoFinished(UTC))
    while next_action(state) and not state.runs[state.run].practice:
        action = next_action(state)
        state = (
            apply(state, RestTaken(UTC, state.run, state.trial, 2.0))
            if isinstance(action, Rest)
            else facts.one_trial(state, correct=True)
        )
    if isinstance(next_action(state), Rest):
        state = apply(state, RestTaken(UTC, state.run, state.trial, 2.0))
    practice = state.run
    levels = []
    for correct in (False, True, True):
        action = next_action(state)
        assert (action.phase, action.run) == (Phase.TRAINING, practice)
        levels.append(action.level_n)
        state = facts.one_trial(state, correct)
    assert levels == [2.0] * 3
    assert state.run == practice + 1
    assert state.rest_due_s == 0.0
    assert next_action(state).level_n == 1.0


def through_to_test(state, facts):
    while state.runs[state.run].phase is not Phase.TEST:
        state = facts.one_trial(state, correct=True)
        if state.rest_due_s:
            state = apply(state, RestTaken(UTC, state.run, state.trial, 2.0))
    return state


def test_catch_trials_are_at_full_level_and_steer_nothing(begun, small_protocol, facts):
    protocol = replace(small_protocol, catch=CatchSettings(one_in=4))
    state = through_to_test(begun(protocol), facts)
    caught = 0
    for _ in range(8):
        action, before = next_action(state), state
        state = facts.one_trial(state, correct=False)
        if action.phase is Phase.CATCH:
            caught += 1
            assert action.level_n == 3.0
            assert state.staircase == before.staircase
            assert state.trial == before.trial + 1
            assert state.trials[-1].phase is Phase.CATCH
            assert not state.trials[-1].reversal
        else:
            assert state.staircase != before.staircase
    assert caught == 2


def test_in_a_detection_run_the_interval_is_the_answer(begun, small_protocol, facts):
    protocol = replace(
        small_protocol,
        stimulus=replace(small_protocol.stimulus, frequencies_hz=()),
        training=replace(small_protocol.training, frequencies_hz=()),
        detection=DetectionSettings(frequencies_hz=(35.0,), start_n=0.25),
    )
    state = begun(protocol)
    seen = set()
    for _ in range(30):
        action = next_action(state)
        if isinstance(action, Finish):
            break
        assert action.phase is Phase.DETECTION
        seen.add((action.label, action.direction))
        state = facts.one_trial(state, correct=len(seen) % 2 == 0)
    assert state.trials[0].level_n == pytest.approx(0.25)
    assert len(seen) == 4


def test_the_dose_counts_whatever_shook_the_hand(begun, small_protocol, facts):
    state = begun(small_protocol)
    action = next_action(state)
    state = apply(apply(state, facts.presented(action)), facts.answered(action, correct=True))
    measured = replace(facts.measured(action), delivered_mps2=3.0, off_axis_mps2=4.0, vibrated_s=10.0)
    state = apply(state, measured)
    first = state.sitting.dose
    assert first.vibrated_s == 10.0
    action = next_action(state)
    state = apply(state, facts.presented(action))
    state = apply(state, TrialSpoiled(UTC, action.run, action.trial, action.attempt, "a pause", vibrated_s=10.0))
    assert state.sitting.dose.vibrated_s == 20.0
    assert state.sitting.dose.squared_s > first.squared_s  # at the ratio that was measured before
    assert a8_mps2(state.sitting.dose) < 1.0


def test_a_stimulus_that_nobody_measured_is_told_apart(begun, small_protocol, facts):
    state = begun(small_protocol)
    action = next_action(state)
    state = apply(state, facts.presented(action))
    state = apply(state, TrialSpoiled(UTC, action.run, action.trial, action.attempt, "a fault", vibrated_s=3.0))
    assert state.sitting.dose.unmeasured_s == 3.0


def test_the_dose_starts_again_after_a_night_and_not_at_midnight(begun, small_protocol, facts):
    late = "2026-01-01T23:50:00.000+00:00"
    state = apply(begun(small_protocol), DemoPlayed(late, 25.0, 1.0, 1, 135.0, 2.0))
    past_midnight = apply(state, DemoPlayed("2026-01-02T00:10:00.000+00:00", 25.0, 1.0, 1, 135.0, 2.0))
    assert past_midnight.sitting.dose.vibrated_s == 4.0
    set_back = apply(state, DemoPlayed(UTC, 25.0, 1.0, 1, 135.0, 2.0))
    assert set_back.sitting.dose.vibrated_s == 4.0
    tomorrow = apply(state, DemoPlayed("2026-01-02T11:00:00.000+00:00", 25.0, 1.0, 1, 135.0, 2.0))
    assert tomorrow.sitting.dose.vibrated_s == 2.0


def test_a_sitting_that_is_too_long_ends_between_two_trials(begun, small_protocol, facts):
    protocol = replace(small_protocol, limits=SittingLimits(longest_min=119.0))
    state = facts.one_trial(begun(protocol), correct=True)
    assert limit_reached(state, UTC) == ""
    due = next_action(state, LATER)
    assert isinstance(due, Leave)
    assert "119 minutes" in due.reason and "another day" in due.reason
    resumed = apply(state, SessionResumed(LATER, state.opened.device, {}))
    assert next_action(resumed, LATER).phase is Phase.TRAINING


def test_a_hand_that_had_its_dose_rests_for_the_day(begun, small_protocol):
    protocol = replace(small_protocol, limits=SittingLimits(dose_a8_mps2=0.01))
    state = begun(protocol)
    shaken = replace(state.sitting, dose=replace(state.sitting.dose, squared_s=100.0), still_s=0.0, last=Moment(UTC))
    tired = replace(state, sitting=shaken)
    assert "vibration dose for today" in next_action(tired, LATER).reason
    assert not isinstance(next_action(tired, LATER.replace("01-01", "01-02")), Leave)
    simulated = replace(tired, opened=replace(tired.opened, observer="ideal"))
    assert not isinstance(next_action(simulated, LATER), Leave)


def test_a_pause_changes_nothing(begun, small_protocol):
    state = begun(small_protocol)
    assert apply(state, PauseTaken(UTC, "experimenter", 12.0)) == state


def test_the_debrief_comes_after_the_last_run(begun, full, facts):
    state = apply(prepared(begun(full)), DemoFinished(UTC))
    answers = iter([True, True, True, False] * 200)
    while not state.finished:
        action = next_action(state)
        state = (
            apply(state, RestTaken(UTC, state.run, state.trial, 2.0))
            if isinstance(action, Rest)
            else facts.one_trial(state, next(answers))
        )
    assert next_action(state).form.kind is FormKind.DEBRIEF
    assert isinstance(next_action(apply(state, filled("debrief"))), Finish)


def test_consent_is_given_by_every_statement_and_kept(full):
    form = form_of(full, FormKind.CONSENT)
    assert (form.version, form.ethics_id) == ("3", "EK 7/26")
    assert judge_form(full, FormKind.CONSENT, FormReply({"statement_1": "yes"})).passed
    assert not judge_form(full, FormKind.CONSENT, FormReply({"statement_1": "no"})).passed


def test_answers_about_health_are_not_kept(full):
    outcome = judge_form(full, FormKind.EXCLUSION, FormReply({"question_1": "yes"}))
    assert not outcome.passed
    assert outcome.kept == {}


def test_a_set_up_that_is_not_the_protocols_is_said(full):
    answers = {"hearing": "nothing", "hand_hidden": "no", "arm_supported": "yes", "grip": "pen grip", "hand": "right"}
    outcome = judge_form(full, FormKind.SETUP, FormReply(answers))
    assert outcome.passed
    assert outcome.kept == answers
    assert outcome.reminder == "The set-up is not the protocol's: the device can be heard, the hand can be seen."


def test_a_form_knows_what_is_missing(full):
    form = form_of(full, FormKind.DEBRIEF)
    assert [field.key for field in find_missing_fields(form, FormReply({}))] == ["felt"]
    assert [field.key for field in find_missing_fields(form, FormReply({"felt": "maybe"}))] == ["felt"]
    assert find_missing_fields(form, FormReply({"felt": "no", "strategy": ""})) == ()


def test_a_protocol_that_asks_nothing_has_no_forms(small_protocol):
    assert [form_of(small_protocol, kind) for kind in FormKind] == [None] * 4


def test_progress_grows_with_trials_and_says_nothing_of_levels(begun, small_protocol, facts):
    right, wrong = begun(small_protocol), begun(small_protocol)
    shares = [progress(right).share_done]
    for _ in range(4):
        right, wrong = facts.one_trial(right, correct=True), facts.one_trial(wrong, correct=False)
        assert progress(right) == progress(wrong)
        shares.append(progress(right).share_done)
    assert shares[0] == 0.0
    assert shares == sorted(shares)
    assert progress(right).minutes_left is None
    right = apply(right, RestTaken(UTC, 1, 0, 2.0))
    for _ in range(4):
        right = facts.one_trial(right, correct=True)
    assert 0 < progress(right).minutes_left < 30
