"""What a participant gains who asks for a trial again when unsure: simulated through the fold, without a device.

The observer of signal detection theory: the evidence is normal around +d'/2 or -d'/2; it is unsure where the evidence
is within a band around 0. Evidence of the same stimulus adds up over looks; of a new one it does not.
"""

from dataclasses import replace
from statistics import NormalDist, fmean

import numpy as np
import pytest

from analysis.psychophysics.repeated_trials import format_repeat_warning
from analysis.psychophysics.runs import recompute_runs
from analysis.psychophysics.thresholds import compute_run_threshold
from protocols.trial import Phase, TrialStatus, VoidCause
from study.participants.psychometric_curve import WeibullCurve
from study.session.facts.events import AnswerGiven, TrialMeasured, TrialSpoiled
from study.session.state.fold import apply_event
from study.session.state.machine import find_next_action
from study.session.state.presentation_check import LogContradictionError
from study.session.state.state import begin_session, count_repeats_left
from study.store.formats.protocol_files import read_study_protocol

UTC = "2026-01-01T00:00:00.000+00:00"
CURVE = WeibullCurve(0.85, 2.0)
UNSURE = 1.0
"""Half-width of the band, in standard deviations: some 54 % of the trials at threshold."""


@pytest.fixture(scope="module")
def protocol():
    published = read_study_protocol("direction_threshold").protocol
    none = {"training": "frequencies_hz", "practice": "frequencies_hz"}
    bare = {name: replace(getattr(published, name), **{key: ()}) for name, key in none.items()}
    return replace(published, stimulus=replace(published.stimulus, frequencies_hz=(25.0,)), **bare)


def spoiled(action, cause: VoidCause | None) -> TrialSpoiled:
    return TrialSpoiled(UTC, action.run, action.trial, action.attempt, "asked to repeat", cause=cause)


def run_of(facts, protocol, seed: int, rules: int, cause: VoidCause, unsure: float):
    """A whole run. cause: how the observer makes a trial void."""
    state = begin_session(facts.opened(protocol, "", seed=seed, rules=rules, observer="attack"), protocol)
    luck = np.random.default_rng([seed, 14])
    evidence, looks = 0.0, 0
    while not state.finished:
        action = find_next_action(state)
        state = apply_event(state, facts.presented(action))
        side = 1.0 if action.label == 1 else -1.0
        fresh = side * CURVE.compute_d_prime(action.level_n) / 2 + luck.normal()
        evidence, looks = (evidence + fresh, looks + 1) if rules == 2 else (fresh, 1)
        allowed = cause is not VoidCause.ASKED or count_repeats_left(state) != 0
        if allowed and abs(evidence) / np.sqrt(looks) < unsure:
            state = apply_event(state, spoiled(action, cause if rules == 2 else None))
            continue
        answer = 1 if evidence > 0 else 2
        state = apply_event(state, AnswerGiven(UTC, action.run, action.trial, action.attempt, answer, 1.0))
        state = apply_event(state, TrialMeasured(UTC, action.run, action.trial, action.attempt, "ok"))
        evidence, looks = 0.0, 0
    return state.trials


def thresholds(facts, protocol, rules: int, cause: VoidCause, unsure: float, runs: int):
    each = [run_of(facts, protocol, seed, rules, cause, unsure) for seed in range(runs)]
    return [
        compute_run_threshold(run, protocol.staircase)
        for rows in each
        for run in recompute_runs(rows, protocol.staircase)
    ]


def check_the_attack(facts, protocol, runs: int):
    """Against the same observers asking for nothing, for whom the rules make no difference."""
    honest, old, new = (
        thresholds(facts, protocol, rules, VoidCause.ASKED, unsure, runs)
        for rules, unsure in ((2, 0.0), (1, UNSURE), (2, UNSURE))
    )
    honest_db, old_db, new_db = (fmean(row.threshold_db for row in rows) for rows in (honest, old, new))
    error_db = 1.7 * np.sqrt(2 / runs)  # a run's threshold has a standard deviation of 1.7 dB
    assert old_db - honest_db < -2 + 2 * error_db
    assert abs(new_db - honest_db) < 0.3 + 3 * error_db
    assert not any(row.asked_often for row in honest)
    assert all(row.asked_often for row in new)


@pytest.mark.slow
def test_asking_when_unsure_moved_thresholds_and_no_longer_does(facts, protocol):
    check_the_attack(facts, protocol, runs=20)


@pytest.mark.slow
def test_asking_when_unsure_moved_thresholds_and_no_longer_does_in_many_runs(facts, protocol):
    check_the_attack(facts, protocol, runs=300)


def test_pausing_when_unsure_cannot_be_refused_and_is_flagged_in_every_run(facts, protocol):
    rows = thresholds(facts, protocol, 2, VoidCause.PAUSED, 0.5, runs=8)
    assert all(row.asked_often and row.repeat_rate > 0.02 for row in rows)


def test_the_warning_names_person_run_and_rate(facts, protocol):
    trials = run_of(facts, protocol, 3, 2, VoidCause.ASKED, UNSURE)
    warning = format_repeat_warning(trials)
    share = f"3 of {len(trials)} presentations ({300 / len(trials):.1f} %)"
    assert f"P01 {share} and P01 at 25 Hz (P01_001) {share}" in warning
    assert "at least 3, and at least 2 % of them" in warning
    assert format_repeat_warning(run_of(facts, protocol, 3, 2, VoidCause.ASKED, 0.0)) == ""


@pytest.mark.parametrize("cause", VoidCause)
@pytest.mark.parametrize("rules", [1, 2])
def test_every_void_trial_comes_again_with_the_same_stimulus_and_under_the_first_rules_with_a_new_one(
    facts, protocol, rules, cause
):
    kept, seeds = 0, range(40)
    for seed in seeds:
        state = begin_session(facts.opened(protocol, "", seed=seed, rules=rules), protocol)
        state = replace(state, sitting=replace(state.sitting, demo_done=True))
        first = find_next_action(state)
        state = apply_event(apply_event(state, facts.presented(first)), spoiled(first, cause))
        again = find_next_action(state)
        assert (again.trial, again.attempt, again.level_n) == (0, 1, first.level_n)
        kept += (again.label, again.angle_deg, again.polarity) == (first.label, first.angle_deg, first.polarity)
        assert (state.trials[0].void_cause, state.trials[0].status) == (cause, TrialStatus.SPOILED)
        assert apply_event(state, facts.presented(again)).trials[-1].repeat_cause is cause
    assert kept == len(seeds) if rules == 2 else 2 <= kept <= 20  # a fourth, of 40


def test_in_a_detection_run_interval_and_direction_stay_too(facts, protocol):
    detecting = replace(protocol, detection=replace(protocol.detection, frequencies_hz=(35.0,)))
    detecting = replace(detecting, stimulus=replace(detecting.stimulus, frequencies_hz=()))
    for seed in range(20):
        state = begin_session(facts.opened(detecting, "", seed=seed, rules=2, observer="attack"), detecting)
        first = find_next_action(state)
        assert first.phase is Phase.DETECTION
        again = find_next_action(
            apply_event(apply_event(state, facts.presented(first)), spoiled(first, VoidCause.EARLY))
        )
        assert replace(again, attempt=0) == first


@pytest.mark.parametrize("limit", [0, 1, 3])
def test_the_number_of_repeats_in_a_run_is_limited_by_the_protocol(facts, protocol, limit):
    limited = replace(protocol, trial=replace(protocol.trial, repeats_per_run=limit))
    state = begin_session(facts.opened(limited, "", rules=2, observer="attack"), limited)
    for asked in range(limit):
        assert count_repeats_left(state) == limit - asked
        action = find_next_action(state)
        state = apply_event(apply_event(state, facts.presented(action)), spoiled(action, VoidCause.ASKED))
    assert count_repeats_left(state) == 0
    action = find_next_action(state)
    state = apply_event(state, facts.presented(action))
    with pytest.raises(LogContradictionError, match="no repeat of this run remained"):
        apply_event(state, spoiled(action, VoidCause.ASKED))
    assert count_repeats_left(apply_event(state, spoiled(action, VoidCause.FAULT))) == 0


def test_sessions_of_the_first_rules_have_no_limit(facts, protocol):
    state = begin_session(facts.opened(protocol, "", observer="attack"), protocol)
    assert count_repeats_left(state) is None


def test_the_band_of_the_attack_is_as_wide_as_stated():
    near = CURVE.compute_d_prime(0.85) / 2
    unsure = NormalDist(near).cdf(UNSURE) - NormalDist(near).cdf(-UNSURE)
    assert unsure == pytest.approx(0.54, abs=0.03)
