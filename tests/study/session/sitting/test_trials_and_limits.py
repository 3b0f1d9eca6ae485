"""Trials of a sitting beside the staircase: practice, catch trials, detection; and the limits of a sitting."""

from dataclasses import replace

import pytest

from protocols.definition.session_settings import CatchSettings, DetectionSettings, SittingLimits
from protocols.trial import Phase
from study.session.facts.events import (
    DemoFinished,
    DemoPlayed,
    PauseTaken,
    RestTaken,
    SessionResumed,
    TrialSpoiled,
)
from study.session.facts.log_time import Moment
from study.session.state.fold import apply_event
from study.session.state.machine import (
    EndSitting,
    Finish,
    TakeRest,
    find_next_action,
    find_reached_limit,
)
from study.session.state.progress import estimate_progress
from study.session.state.vibration_dose import compute_a8_mps2
from tests.study.session.sitting.preparation import UTC, prepared

LATER = "2026-01-01T02:00:00.000+00:00"


def test_practice_stays_at_its_level_until_it_is_passed(begun, full, facts):
    state = apply_event(prepared(begun(full)), DemoFinished(UTC))
    while find_next_action(state) and not state.runs[state.run].practice:
        action = find_next_action(state)
        state = (
            apply_event(state, RestTaken(UTC, state.run, state.trial, 2.0))
            if isinstance(action, TakeRest)
            else facts.one_trial(state, correct=True)
        )
    if isinstance(find_next_action(state), TakeRest):
        state = apply_event(state, RestTaken(UTC, state.run, state.trial, 2.0))
    practice = state.run
    levels = []
    for correct in (False, True, True):
        action = find_next_action(state)
        assert (action.phase, action.run) == (Phase.TRAINING, practice)
        levels.append(action.level_n)
        state = facts.one_trial(state, correct)
    assert levels == [2.0] * 3
    assert state.run == practice + 1
    assert state.rest_due_s == 0.0
    assert find_next_action(state).level_n == 1.0


def through_to_test(state, facts):
    while state.runs[state.run].phase is not Phase.TEST:
        state = facts.one_trial(state, correct=True)
        if state.rest_due_s:
            state = apply_event(state, RestTaken(UTC, state.run, state.trial, 2.0))
    return state


def test_catch_trials_are_at_full_level_and_steer_nothing(begun, small_protocol, facts):
    protocol = replace(small_protocol, catch=CatchSettings(one_in=4))
    state = through_to_test(begun(protocol), facts)
    caught = 0
    for _ in range(8):
        action, before = find_next_action(state), state
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
        action = find_next_action(state)
        if isinstance(action, Finish):
            break
        assert action.phase is Phase.DETECTION
        seen.add((action.label, action.direction))
        state = facts.one_trial(state, correct=len(seen) % 2 == 0)
    assert state.trials[0].level_n == pytest.approx(0.25)
    assert len(seen) == 4


def test_the_dose_counts_every_vibration_at_the_hand(begun, small_protocol, facts):
    state = begun(small_protocol)
    action = find_next_action(state)
    state = apply_event(apply_event(state, facts.presented(action)), facts.answered(action, correct=True))
    measured = replace(facts.measured(action), delivered_mps2=3.0, off_axis_mps2=4.0, vibrated_s=10.0)
    state = apply_event(state, measured)
    first = state.sitting.dose
    assert first.vibrated_s == 10.0
    action = find_next_action(state)
    state = apply_event(state, facts.presented(action))
    state = apply_event(state, TrialSpoiled(UTC, action.run, action.trial, action.attempt, "a pause", vibrated_s=10.0))
    assert state.sitting.dose.vibrated_s == 20.0
    assert state.sitting.dose.squared_s > first.squared_s  # at the ratio that was measured before
    assert compute_a8_mps2(state.sitting.dose) < 1.0


def test_a_stimulus_without_a_measurement_is_marked_in_the_dose(begun, small_protocol, facts):
    state = begun(small_protocol)
    action = find_next_action(state)
    state = apply_event(state, facts.presented(action))
    state = apply_event(state, TrialSpoiled(UTC, action.run, action.trial, action.attempt, "a fault", vibrated_s=3.0))
    assert state.sitting.dose.unmeasured_s == 3.0


def test_the_dose_starts_again_after_a_night_and_not_at_midnight(begun, small_protocol, facts):
    late = "2026-01-01T23:50:00.000+00:00"
    state = apply_event(begun(small_protocol), DemoPlayed(late, 25.0, 1.0, 1, 135.0, 2.0))
    past_midnight = apply_event(state, DemoPlayed("2026-01-02T00:10:00.000+00:00", 25.0, 1.0, 1, 135.0, 2.0))
    assert past_midnight.sitting.dose.vibrated_s == 4.0
    set_back = apply_event(state, DemoPlayed(UTC, 25.0, 1.0, 1, 135.0, 2.0))
    assert set_back.sitting.dose.vibrated_s == 4.0
    tomorrow = apply_event(state, DemoPlayed("2026-01-02T11:00:00.000+00:00", 25.0, 1.0, 1, 135.0, 2.0))
    assert tomorrow.sitting.dose.vibrated_s == 2.0


def test_a_sitting_that_is_too_long_ends_between_two_trials(begun, small_protocol, facts):
    protocol = replace(small_protocol, limits=SittingLimits(longest_min=119.0))
    state = facts.one_trial(begun(protocol), correct=True)
    assert find_reached_limit(state, UTC) == ""
    due = find_next_action(state, LATER)
    assert isinstance(due, EndSitting)
    assert "119 minutes" in due.reason and "another day" in due.reason
    resumed = apply_event(state, SessionResumed(LATER, state.opened.device, {}))
    assert find_next_action(resumed, LATER).phase is Phase.TRAINING


def test_a_hand_that_had_its_dose_rests_for_the_day(begun, small_protocol):
    protocol = replace(small_protocol, limits=SittingLimits(dose_a8_mps2=0.01))
    state = begun(protocol)
    shaken = replace(
        state.sitting, dose=replace(state.sitting.dose, squared_s=100.0), still_s=0.0, last_moment=Moment(UTC)
    )
    tired = replace(state, sitting=shaken)
    assert "vibration dose for today" in find_next_action(tired, LATER).reason
    assert not isinstance(find_next_action(tired, LATER.replace("01-01", "01-02")), EndSitting)
    simulated = replace(tired, opened=replace(tired.opened, observer="ideal"))
    assert not isinstance(find_next_action(simulated, LATER), EndSitting)


def test_a_pause_changes_nothing(begun, small_protocol):
    state = begun(small_protocol)
    assert apply_event(state, PauseTaken(UTC, "experimenter", 12.0)) == state


def test_progress_grows_with_trials_and_says_nothing_of_levels(begun, small_protocol, facts):
    right, wrong = begun(small_protocol), begun(small_protocol)
    shares = [estimate_progress(right).share_done]
    for _ in range(4):
        right, wrong = facts.one_trial(right, correct=True), facts.one_trial(wrong, correct=False)
        assert estimate_progress(right) == estimate_progress(wrong)
        shares.append(estimate_progress(right).share_done)
    assert shares[0] == 0.0
    assert shares == sorted(shares)
    assert estimate_progress(right).minutes_left is None
    right = apply_event(right, RestTaken(UTC, 1, 0, 2.0))
    for _ in range(4):
        right = facts.one_trial(right, correct=True)
    assert 0 < estimate_progress(right).minutes_left < 30
