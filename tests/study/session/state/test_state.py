"""The fold of a session, driven by hand-made facts."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.procedure.staircase import begin_staircase, compute_level_n, step
from protocols.trial import Phase, TrialStatus
from study.session.facts.events import (
    DeviceFacts,
    RestTaken,
    SessionClosed,
    SessionInterrupted,
    TrialSpoiled,
    encode_event,
    parse_event,
)
from study.session.state.fold import apply_event
from study.session.state.machine import Finish, TakeRest, find_next_action
from study.session.state.presentation_check import LogContradictionError
from study.session.state.state import begin_session
from tests.session_facts import UTC, answered, measured, one_trial, opened, presented


@pytest.fixture
def fresh(small_protocol, small_text):
    return begin_session(opened(small_protocol, small_text), small_protocol)


def test_training_comes_first_and_ends_at_its_trial_limit(fresh):
    state = fresh
    for _ in range(4):
        assert find_next_action(state).phase is Phase.TRAINING
        state = one_trial(state, correct=True)
    assert find_next_action(state) == TakeRest(2.0)


def test_a_session_of_right_and_wrong_answers_comes_to_its_end(fresh):
    state = fresh
    answers = iter([True, True, True, False] * 100)
    while not isinstance(find_next_action(state), Finish):
        state = one_trial(state, next(answers))
    assert {t.phase for t in state.trials} == {Phase.TRAINING, Phase.TEST}
    assert {t.frequency_hz for t in state.trials if t.phase is Phase.TEST} == {25.0, 35.0}
    assert apply_event(state, SessionClosed(UTC, "completed")).closed


def test_a_spoiled_trial_is_drawn_again_at_the_same_level_and_moves_nothing(fresh):
    action = find_next_action(fresh)
    state = apply_event(fresh, presented(action))
    state = apply_event(state, TrialSpoiled(UTC, action.run, action.trial, action.attempt, "a fault"))
    again = find_next_action(state)
    assert (again.trial, again.attempt, again.level_n) == (action.trial, action.attempt + 1, action.level_n)
    assert state.trials[0].status is TrialStatus.SPOILED
    assert state.staircase == fresh.staircase


def test_an_answer_moves_the_staircase_only_when_the_trial_is_closed(fresh):
    action = find_next_action(fresh)
    state = apply_event(apply_event(fresh, presented(action)), answered(action, correct=False))
    assert state.staircase == fresh.staircase
    assert state.answers == 1
    closed = apply_event(state, measured(action))
    assert closed.staircase.level_db == pytest.approx(4.0)


def test_a_trial_answered_and_then_spoiled_by_the_device_counts_for_nothing(fresh):
    action = find_next_action(fresh)
    state = apply_event(apply_event(fresh, presented(action)), answered(action, correct=False))
    state = apply_event(state, TrialSpoiled(UTC, action.run, action.trial, action.attempt, "the device let go"))
    assert state.answers == 0
    assert state.staircase == fresh.staircase
    assert state.trials[0].answer is not None


def test_a_level_that_the_rules_do_not_give_is_a_contradiction(fresh):
    wrong = replace(presented(find_next_action(fresh)), level_n=1.1)
    with pytest.raises(LogContradictionError, match=r"level_n 1\.1 where 1\.0 is due: .*different rules"):
        apply_event(fresh, wrong)


@pytest.mark.parametrize("field", ["direction", "angle_deg", "polarity", "level_db", "frequency_hz", "phase"])
def test_no_part_of_a_draw_can_be_changed_in_the_log(fresh, field):
    right = presented(find_next_action(fresh))
    other = {
        "direction": 3 - right.direction,
        "angle_deg": right.angle_deg + 90.0,
        "polarity": -right.polarity,
        "level_db": right.level_db + 1.0,
        "frequency_hz": 25.0,
        "phase": Phase.TEST,
    }
    with pytest.raises(LogContradictionError, match=f"presented with {field} "):
        apply_event(fresh, replace(right, **{field: other[field]}))


def test_the_last_bit_of_a_level_may_differ_between_machines(fresh):
    right = presented(find_next_action(fresh))
    assert apply_event(fresh, replace(right, level_n=right.level_n * (1 + 1e-15))).presented is not None


def test_a_session_cannot_be_closed_before_its_last_run(fresh):
    with pytest.raises(LogContradictionError, match="before its last run was finished"):
        apply_event(fresh, SessionClosed(UTC, "completed"))


def test_a_rest_that_was_not_due_is_a_contradiction(fresh):
    with pytest.raises(LogContradictionError, match="none was due"):
        apply_event(fresh, RestTaken(UTC, 0, 0, rested_s=5.0))


@pytest.mark.parametrize("change", [{"run": 1}, {"trial": 1}, {"attempt": 1}])
def test_a_trial_out_of_turn_is_a_contradiction(fresh, change):
    with pytest.raises(LogContradictionError, match="was due"):
        apply_event(fresh, replace(presented(find_next_action(fresh)), **change))


def test_an_answer_without_a_trial_is_a_contradiction(fresh):
    with pytest.raises(LogContradictionError, match="which is not open"):
        apply_event(fresh, answered(find_next_action(fresh), correct=True))


def test_a_second_answer_to_a_trial_is_a_contradiction(fresh):
    action = find_next_action(fresh)
    state = apply_event(apply_event(fresh, presented(action)), answered(action, correct=True))
    with pytest.raises(LogContradictionError, match="answered twice"):
        apply_event(state, answered(action, correct=False))


def test_a_measurement_before_the_answer_is_a_contradiction(fresh):
    action = find_next_action(fresh)
    with pytest.raises(LogContradictionError, match="measured before it was answered"):
        apply_event(apply_event(fresh, presented(action)), measured(action))


def finished_session(fresh):
    state = fresh
    answers = iter([True, True, True, False] * 100)
    while not isinstance(find_next_action(state), Finish):
        state = one_trial(state, next(answers))
    return apply_event(state, SessionClosed(UTC, "completed"))


def test_an_interruption_at_the_very_end_does_not_spoil_a_finished_session(fresh):
    """As a Ctrl-C right after the last line left it."""
    closed = finished_session(fresh)
    assert apply_event(closed, SessionInterrupted(UTC, "interrupted at the keyboard")).closed


def test_nothing_else_follows_the_closing(fresh):
    closed = finished_session(fresh)
    with pytest.raises(LogContradictionError, match="after the session was closed"):
        apply_event(closed, SessionClosed(UTC, "completed"))


def test_a_session_is_opened_once(fresh):
    with pytest.raises(LogContradictionError, match="opened twice"):
        apply_event(fresh, fresh.opened)


def test_an_open_trial_must_be_closed_before_the_next_action(fresh):
    with pytest.raises(ValueError, match="a trial is open"):
        find_next_action(apply_event(fresh, presented(find_next_action(fresh))))


def test_swapped_labels_change_the_number_and_not_the_device(small_protocol, small_text):
    swapping = replace(small_protocol, schedule=replace(small_protocol.schedule, labels="swapped_for_half"))
    first = find_next_action(begin_session(opened(swapping, small_text, participant_number=0), swapping))
    second = find_next_action(begin_session(opened(swapping, small_text, participant_number=1), swapping))
    assert first.direction == second.direction
    assert {first.label, second.label} == {1, 2}


def test_who_felt_what(small_protocol, small_text):
    simulated = DeviceFacts("sim", simulated=True, sample_rate_hz=1000.0)
    cases = {
        True: opened(small_protocol, small_text),
        False: opened(small_protocol, small_text, device=simulated),
        None: opened(small_protocol, small_text, device=simulated, observer="ideal"),
    }
    for expected, line in cases.items():
        state = begin_session(line, small_protocol)
        assert apply_event(state, presented(find_next_action(state))).trials[0].felt is expected


def test_every_event_survives_its_line(fresh):
    action = find_next_action(fresh)
    events = [
        fresh.opened,
        presented(action),
        answered(action, correct=True),
        measured(action),
        TrialSpoiled(UTC, 0, 0, 0, "a fault", missed_ticks=3),
        RestTaken(UTC, 1, 0, rested_s=61.5),
        SessionClosed(UTC, "completed"),
    ]
    for event in events:
        line = encode_event(event)
        assert line.endswith(b"\n")
        assert line.count(b"\n") == 1
        assert parse_event(line) == event


@given(st.lists(st.booleans(), max_size=60))
@settings(max_examples=30, deadline=None)
def test_folding_gives_the_levels_of_the_staircase_alone(answers):
    protocol, text = _small()
    state = begin_session(opened(protocol, text), protocol)
    while state.run == 0:
        state = one_trial(state, correct=True)
    expected = begin_staircase(protocol.staircase)
    for correct in answers:
        if state.run != 1:
            break
        before = find_next_action(state) if not isinstance(find_next_action(state), TakeRest) else None
        if before is not None:
            assert before.level_n == compute_level_n(protocol.staircase, expected)
        state = one_trial(state, correct)
        expected = step(protocol.staircase, expected, correct)


def _small():
    from protocols.document.loading import load_protocol

    text = (
        'name = "small"\nkind = "study"\ntitle = "t"\n[stimulus]\nfrequencies_hz = [25.0]\n'
        "[staircase]\nstart_n = 1.0\ncap_n = 3.0\nup_after_wrong = 1\ndown_after_right = 3\n"
        "steps = [{ step_db = 4.0, reversals = 3 }, { step_db = 1.0, reversals = 10 }]\n"
        "reversals = 13\naveraged_reversals = 10\n[directions]\n"
        "[safety]\nstimulus_cap_n = 3.0\ntotal_cap_n = 4.5\n[training]\nfrequencies_hz = [5.0]\ntrial_limit = 1\n"
    )
    return load_protocol(text, "small"), text
