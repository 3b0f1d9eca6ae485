from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.catch_trials import compute_wilson_interval, tally_catch_trials
from protocols.trial import TrialStatus


@pytest.fixture
def run_with_catches(simulate_with_catches):
    """One run with one catch trial in four; lapse: how often those are wrong."""

    def run(lapse, **columns):
        return simulate_with_catches(np.random.default_rng(4), lapse=lapse, one_in=4, **columns)

    return run


def test_an_attentive_participant_has_no_lapse(run_with_catches):
    (tally,) = tally_catch_trials(run_with_catches(0.0, subject="a", frequency_hz=5.0))
    assert (tally.subject, tally.frequency_hz, tally.wrong, tally.lapse_rate, tally.lower) == ("a", 5.0, 0, 0.0, 0.0)
    assert tally.given > 5


def test_the_lapse_rate_is_recovered(simulate_with_catches):
    generator = np.random.default_rng(8)
    trials = [trial for run in range(40) for trial in simulate_with_catches(generator, lapse=0.15, one_in=4, run=run)]
    (tally,) = tally_catch_trials(trials)
    assert tally.given > 400
    assert tally.lower < 0.15 < tally.upper
    assert tally.upper - tally.lower < 0.08


def test_intervals_cover_the_true_rate_as_often_as_they_say():
    generator, truth = np.random.default_rng(2), 0.1
    wrong = generator.binomial(30, truth, size=2000)
    interval = {int(count): compute_wilson_interval(int(count), 30) for count in np.unique(wrong)}
    covered = [interval[int(count)][0] <= truth <= interval[int(count)][1] for count in wrong]
    assert np.mean(covered) == pytest.approx(0.95, abs=0.03)


def test_the_interval_is_wilsons():
    """E. B. Wilson's formula by hand, for 3 of 20."""
    n, p, z = 20, 3 / 20, 1.959964
    centre = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * (p * (1 - p) / n + z * z / (4 * n * n)) ** 0.5
    assert compute_wilson_interval(3, 20) == pytest.approx((centre - half, centre + half), rel=1e-6)


def test_void_and_open_presentations_count_for_nothing(run_with_catches):
    trials = run_with_catches(0.0)
    shown = next(trial for trial in trials if trial.phase.value == "catch")
    void = replace(shown, attempt=0, answer=None, correct=None, status=TrialStatus.SPOILED)
    assert tally_catch_trials([*trials, void]) == tally_catch_trials(trials)


def test_participants_and_frequencies_are_distinguished(run_with_catches):
    rows = tally_catch_trials(
        [
            *run_with_catches(0.0, subject="b", frequency_hz=45.0),
            *run_with_catches(0.0, subject="b", frequency_hz=5.0),
            *run_with_catches(1.0, subject="a"),
        ]
    )
    assert [(row.subject, row.frequency_hz) for row in rows] == [("b", 5.0), ("b", 45.0), ("a", 15.0)]
    assert [row.lapse_rate for row in rows] == [0.0, 0.0, 1.0]


def test_a_study_without_catch_trials_has_no_tally(simulate):
    assert tally_catch_trials(simulate(0.6, np.random.default_rng(1))) == ()
