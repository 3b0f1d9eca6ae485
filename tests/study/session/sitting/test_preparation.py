"""Before and after the trials: consent, exclusion, set-up, demonstration, debrief."""

import pytest

from protocols.trial import Phase
from study.session.facts.events import (
    DemoFinished,
    DemoPlayed,
    DeviceChecked,
    RestTaken,
    SessionResumed,
)
from study.session.state.fold import apply_event
from study.session.state.machine import (
    CheckDevice,
    Demonstrate,
    EndSitting,
    FillIn,
    Finish,
    TakeRest,
    find_next_action,
    find_next_preparation,
)
from study.session.state.presentation_check import LogContradictionError
from study.session.views.form_views import FormKind, FormReply, find_missing_fields
from study.session.views.forms import judge_form, make_form
from tests.study.session.sitting.preparation import UTC, filled, prepared


def test_a_person_is_asked_for_consent_first_and_for_the_device_last(begun, full):
    state, kinds = begun(full), []
    for event in (filled("consent"), filled("exclusion"), filled("setup"), DeviceChecked(UTC, True, ())):
        due = find_next_preparation(state)
        kinds.append(due.form.kind if isinstance(due, FillIn) else type(due))
        state = apply_event(state, event)
    assert kinds == [FormKind.CONSENT, FormKind.EXCLUSION, FormKind.SETUP, CheckDevice]
    assert find_next_preparation(state) is None


def test_a_simulated_participant_signs_nothing(begun, full):
    state = begun(full, observer="ideal")
    assert find_next_preparation(state) is None
    assert find_next_action(state).phase is Phase.TRAINING


@pytest.mark.parametrize(("form", "reason"), [("consent", "consent was not given"), ("exclusion", "with yes")])
def test_without_consent_or_with_an_exclusion_no_stimulus_comes(begun, full, form, reason):
    state = begun(full)
    if form == "exclusion":
        state = apply_event(state, filled("consent"))
    state = apply_event(state, filled(form, passed=False))
    assert isinstance(find_next_preparation(state), EndSitting)
    assert reason in find_next_preparation(state).reason


def test_a_resumed_session_asks_again_how_one_sits_and_nothing_else(begun, full, facts):
    state = prepared(begun(full))
    resumed = apply_event(state, SessionResumed(UTC, state.opened.device, {}))
    assert find_next_preparation(resumed).form.kind is FormKind.SETUP


def test_a_refusal_by_a_slip_of_the_finger_can_be_mended_in_another_sitting(begun, full):
    state = apply_event(begun(full), filled("consent", passed=False))
    again = apply_event(state, SessionResumed(UTC, state.opened.device, {}))
    assert find_next_preparation(again).form.kind is FormKind.CONSENT


def test_the_demonstration_comes_once_before_the_first_trial(begun, full):
    state = prepared(begun(full))
    assert isinstance(find_next_action(state), Demonstrate)
    state = apply_event(state, DemoPlayed(UTC, 25.0, 1.0, 1, 135.0, 2.0))
    assert isinstance(find_next_action(state), Demonstrate)
    state = apply_event(state, DemoFinished(UTC))
    assert find_next_action(state).phase is Phase.TRAINING


def test_nothing_is_filled_in_or_demonstrated_while_a_trial_is_open(begun, small_protocol, facts):
    state = begun(small_protocol)
    state = apply_event(state, facts.presented(find_next_action(state)))
    with pytest.raises(LogContradictionError, match="while a trial is open"):
        apply_event(state, DemoFinished(UTC))


def test_the_debrief_comes_after_the_last_run(begun, full, facts):
    state = apply_event(prepared(begun(full)), DemoFinished(UTC))
    answers = iter([True, True, True, False] * 200)
    while not state.finished:
        action = find_next_action(state)
        state = (
            apply_event(state, RestTaken(UTC, state.run, state.trial, 2.0))
            if isinstance(action, TakeRest)
            else facts.one_trial(state, next(answers))
        )
    assert find_next_action(state).form.kind is FormKind.DEBRIEF
    assert isinstance(find_next_action(apply_event(state, filled("debrief"))), Finish)


def test_consent_is_given_by_every_statement_and_kept(full):
    form = make_form(full, FormKind.CONSENT)
    assert (form.version, form.ethics_id) == ("3", "EK 7/26")
    assert judge_form(full, make_form(full, FormKind.CONSENT), FormReply({"statement_1": "yes"})).passed
    assert not judge_form(full, make_form(full, FormKind.CONSENT), FormReply({"statement_1": "no"})).passed


def test_answers_about_health_are_not_kept(full):
    outcome = judge_form(full, make_form(full, FormKind.EXCLUSION), FormReply({"question_1": "yes"}))
    assert not outcome.passed
    assert outcome.kept == {}


def test_a_set_up_that_is_not_the_protocols_is_reported(full):
    answers = {"hearing": "nothing", "hand_hidden": "no", "arm_supported": "yes", "grip": "pen grip", "hand": "right"}
    outcome = judge_form(full, make_form(full, FormKind.SETUP), FormReply(answers))
    assert outcome.passed
    assert outcome.kept == answers
    assert outcome.reminder == "The set-up is not the protocol's: the device can be heard, the hand can be seen."


def test_a_form_knows_what_is_missing(full):
    form = make_form(full, FormKind.DEBRIEF)
    assert [field.key for field in find_missing_fields(form, FormReply({}))] == []
    assert [field.key for field in find_missing_fields(form, FormReply({"felt": "maybe"}))] == ["felt"]
    assert find_missing_fields(form, FormReply({"felt": "no", "strategy": ""})) == ()


def test_a_protocol_that_asks_nothing_has_no_forms(small_protocol):
    assert [make_form(small_protocol, kind) for kind in FormKind] == [None] * len(FormKind)
