from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.detection import (
    ThresholdBelowDetection,
    compute_detection_thresholds,
    find_thresholds_below_detection,
)
from analysis.psychophysics.runs import InconsistentTrialsError
from analysis.psychophysics.threshold_table import tabulate_thresholds
from analysis.psychophysics.thresholds import compute_thresholds
from protocols.definition.session_settings import DetectionSettings
from protocols.procedure.run_rules import make_staircase_rule
from protocols.trial import Phase


@pytest.fixture
def detection_protocol(protocol):
    """The protocol with two detection runs."""
    return replace(protocol, detection=DetectionSettings(frequencies_hz=(35.0, 45.0), start_n=0.5))


@pytest.fixture
def simulate_detection(simulate, detection_protocol):
    """One detection run of a participant who feels true_n in 79.4 % of the trials."""

    def run(true_n, generator, **columns):
        rule = make_staircase_rule(detection_protocol, Phase.DETECTION)
        return simulate(true_n, generator, rule=rule, **({"phase": Phase.DETECTION, "frequency_hz": 35.0} | columns))

    return run


def test_the_detection_threshold_of_a_simulated_participant_is_recovered(simulate_detection, detection_protocol):
    generator = np.random.default_rng(5)
    trials = [trial for run in range(60) for trial in simulate_detection(0.2, generator, run=run)]
    rows = compute_detection_thresholds(trials, detection_protocol)
    assert len(rows) == 60
    assert all(row.complete for row in rows)
    mean_db = np.mean([row.threshold_db for row in rows])
    # One run spreads by 1.7 dB, so the mean of 60 by 0.22 dB.
    assert mean_db == pytest.approx(20 * np.log10(0.2), abs=0.8)


def test_a_study_without_detection_may_have_a_cap_below_the_level_at_which_detection_would_begin(simulate, protocol):
    """Its sessions ended with a traceback, and could not be analysed."""
    rule = replace(protocol.staircase, cap_n=0.3, start_n=0.1)
    weak = replace(protocol, staircase=rule)
    assert weak.detection.start_n > rule.cap_n and not weak.detection.frequencies_hz
    trials = simulate(0.1, np.random.default_rng(1), rule=rule)
    assert compute_detection_thresholds(trials, weak) == ()


def test_a_participant_who_feels_nothing_is_cut_by_the_cap(simulate_detection, detection_protocol):
    generator = np.random.default_rng(5)
    rows = compute_detection_thresholds(
        [t for run in range(20) for t in simulate_detection(float("inf"), generator, run=run)], detection_protocol
    )
    assert sum(row.censored for row in rows) >= 19
    assert np.mean([row.percent_correct for row in rows]) < 65


def test_a_run_begins_at_its_own_level_and_not_at_that_of_the_study(simulate_detection, detection_protocol, simulate):
    trials = simulate_detection(0.2, np.random.default_rng(1))
    assert trials[0].level_n == pytest.approx(0.5)
    of_directions = [replace(t, phase=Phase.DETECTION) for t in simulate(0.2, np.random.default_rng(1))]
    with pytest.raises(InconsistentTrialsError, match="lead to 0.5 N"):
        compute_detection_thresholds(of_directions, detection_protocol)


def test_detection_runs_enter_no_threshold_of_direction(simulate_detection, detection_protocol):
    assert compute_thresholds(simulate_detection(0.2, np.random.default_rng(1)), detection_protocol.staircase) == ()


def test_a_limit_of_trials_ends_a_run_without_a_threshold(simulate_detection, detection_protocol):
    short = replace(detection_protocol, detection=replace(detection_protocol.detection, trial_limit=12))
    (row,) = compute_detection_thresholds(simulate_detection(0.2, np.random.default_rng(1))[:12], short)
    assert (row.complete, row.threshold_n, row.trials) == (False, None, 12)


def test_two_looks_give_a_smaller_sensitivity_for_the_same_answers(simulate_detection, detection_protocol):
    trials = simulate_detection(0.2, np.random.default_rng(1))
    (row,) = compute_detection_thresholds(trials, detection_protocol)
    one_interval = replace(detection_protocol.staircase, start_n=0.5)
    (same,) = compute_thresholds([replace(trial, phase=Phase.TEST) for trial in trials], one_interval)
    assert row.d_prime == pytest.approx(same.d_prime / np.sqrt(2))
    assert row.criterion == same.criterion


def threshold_tables(detection_protocol, direction_n, detection_n, simulate_detection, simulate):
    generator = np.random.default_rng(3)
    direction = compute_thresholds(simulate(direction_n, generator, frequency_hz=35.0), detection_protocol.staircase)
    detection = compute_detection_thresholds(simulate_detection(detection_n, generator), detection_protocol)
    return tabulate_thresholds(direction, (35.0,)), tabulate_thresholds(detection, (35.0, 45.0))


def test_a_direction_told_before_it_is_felt_is_found(detection_protocol, simulate_detection, simulate):
    direction, detection = threshold_tables(detection_protocol, 0.2, 1.0, simulate_detection, simulate)
    (below,) = find_thresholds_below_detection(direction, detection)
    assert below == ThresholdBelowDetection("s01", 35.0, direction.values[0][0], detection.values[0][0])


@pytest.mark.parametrize(("direction_n", "detection_n"), [(1.0, 0.1), (float("inf"), float("inf"))])
def test_a_direction_felt_later_or_never_is_no_contradiction(
    detection_protocol, simulate_detection, simulate, direction_n, detection_n
):
    assert (
        find_thresholds_below_detection(
            *threshold_tables(detection_protocol, direction_n, detection_n, simulate_detection, simulate)
        )
        == ()
    )
