import csv
import io
from dataclasses import asdict, fields, replace

import numpy as np
import pytest

from analysis.psychophysics.thresholds import Threshold, compute_thresholds

S1 = "111111011101110011111101110011101110"
S2 = "11111101110011111101110111011101110"


@pytest.mark.parametrize(("answers", "newton", "db"), [(S1, 0.6335, -4.0), (S2, 0.6043, -4.4)])
def test_the_check_sequences_give_their_known_thresholds(make_run_from_answers, rule, answers, newton, db):
    (row,) = compute_thresholds(make_run_from_answers(answers), rule)
    assert row.complete
    assert row.threshold_db == pytest.approx(db, abs=1e-12)
    assert row.threshold_n == pytest.approx(newton, abs=5e-5)
    assert (row.reversals, row.trials, row.cap_reversals) == (13, len(answers), 0)


def test_a_run_short_of_its_reversals_is_a_row_without_a_threshold(make_run_from_answers, rule):
    (row,) = compute_thresholds(make_run_from_answers(S1[:-1]), rule)
    assert not row.complete
    assert row.reversals == 12
    assert (row.threshold_n, row.threshold_db, row.threshold_mps2, row.threshold_mm) == (None, None, None, None)


def test_a_run_that_ran_out_of_trials_is_incomplete(make_run_from_answers, rule):
    (row,) = compute_thresholds(make_run_from_answers(S1[:20]), replace(rule, trial_limit=20))
    assert not row.complete


def test_the_delivered_threshold_is_the_mean_over_the_same_trials(make_run_from_answers, rule):
    (row,) = compute_thresholds(make_run_from_answers(S1), rule)
    assert row.threshold_mps2 == pytest.approx(4.0 * row.threshold_n)
    assert row.measured_reversals == 10


def test_a_reversal_without_measurement_is_left_out_and_counted(make_run_from_answers, rule):
    rows = make_run_from_answers(S1)
    rows[-1] = replace(rows[-1], delivered_mps2=None, displacement_mm=None)
    (row,) = compute_thresholds(rows, rule)
    assert row.measured_reversals == 9
    assert row.threshold_mps2 == pytest.approx(4.0 * row.threshold_n, rel=0.01)


def test_nothing_measured_leaves_the_delivered_threshold_empty(make_run_from_answers, rule):
    rows = [replace(row, delivered_mps2=None, displacement_mm=None) for row in make_run_from_answers(S1)]
    (row,) = compute_thresholds(rows, rule)
    assert (row.threshold_mps2, row.threshold_mm, row.measured_reversals) == (None, None, 0)


def test_one_peak_at_the_cap_among_the_averaged_marks_it_as_cut(make_run_from_answers, rule):
    # Climb to the cap, three turns by 4 dB, climb again; then peaks at the cap and valleys one step below.
    (row,) = compute_thresholds(make_run_from_answers("0" * 4 + "111" + "0" + "111" + "0" * 6 + "1110" * 6), rule)
    assert row.complete
    assert row.cap_reversals == 5
    assert row.threshold_n == pytest.approx((5 * 3.0 + 4 * 3.0 / 10**0.05 + 3.0 / 10**0.2) / 10)
    assert row.censored
    assert row.threshold_n < 3.0
    assert row.pushes_against_cap > 0


def test_cap_contact_before_the_averaged_reversals_does_not_mark(make_run_from_answers, rule):
    # The first peak is at the cap, but by 4 dB steps: the averaged reversals lie below.
    (row,) = compute_thresholds(make_run_from_answers("000" + "111" * 2 + "0" + "111" * 3 + "0" + "1110" * 6), rule)
    assert row.complete
    assert row.trials_at_cap > 0
    assert row.cap_reversals == 0
    assert not row.censored


@pytest.mark.slow
def test_guessers_are_flagged_and_able_observers_are_not(simulate, rule):
    flagged = {}
    for name, true_n, runs in (("guesser", np.inf, 200), ("able", 1.0, 300)):
        generator = np.random.default_rng(11)
        rows = [trial for run in range(runs) for trial in simulate(true_n, generator, run=run)]
        flagged[name] = np.mean([row.censored for row in compute_thresholds(rows, rule)])
    assert flagged["guesser"] >= 0.95
    assert flagged["able"] <= 0.02


def test_a_guesser_never_ends_at_the_cap_itself(simulate, rule):
    generator = np.random.default_rng(12)
    rows = compute_thresholds([t for run in range(100) for t in simulate(np.inf, generator, run=run)], rule)
    newtons = [row.threshold_n for row in rows]
    assert max(newtons) < 3.0
    assert 2.6 < np.mean(newtons) < 2.75
    assert 100 < np.mean([row.trials for row in rows]) < 120


@pytest.mark.slow
def test_the_threshold_recovers_the_level_of_79_percent(simulate, rule):
    generator = np.random.default_rng(13)
    trials = [t for run in range(250) for t in simulate(0.8, generator, run=run, lapse=0.0)]
    error_db = np.array([row.threshold_db for row in compute_thresholds(trials, rule)]) - 20 * np.log10(0.8)
    assert abs(error_db.mean()) < 0.5
    assert 1.3 < error_db.std() < 2.1


def test_the_columns_begin_as_the_file_format_says():
    names = [field.name for field in fields(Threshold)]
    assert names[:8] == [
        "subject", "frequency_hz", "threshold_n", "threshold_db", "censored", "reversals", "trials", "cap_reversals",
    ]  # fmt: skip


def test_a_row_is_plain_data(make_run_from_answers, rule):
    (row,) = compute_thresholds(make_run_from_answers(S1), rule)
    writer = csv.DictWriter(io.StringIO(), fieldnames=[field.name for field in fields(Threshold)])
    assert writer.writerow(asdict(row)) > 0
