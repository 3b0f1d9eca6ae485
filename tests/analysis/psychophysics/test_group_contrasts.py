"""Contrasts within participants against statsmodels, scipy and values worked by hand."""

import numpy as np
import pytest
from scipy.stats import ttest_rel
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.weightstats import ttost_paired

from analysis.psychophysics.group_contrasts import apply_holm_correction, compute_contrasts, compute_mean_errors

HZ = (5.0, 15.0, 25.0, 35.0)
VALUES = np.array([0.0, 0.3, 1.0, 5.0]) + np.random.default_rng(3).normal(0, [1, 1, 1, 6], (10, 4))


def test_differences_agree_with_the_paired_t_test():
    for place, found in enumerate(compute_contrasts(HZ, VALUES, 0.95), start=1):
        peer = ttest_rel(VALUES[:, place], VALUES[:, 0])
        interval = peer.confidence_interval(0.95)
        assert found.p == pytest.approx(peer.pvalue, rel=1e-10)
        assert (found.lower_db, found.upper_db) == pytest.approx((interval.low, interval.high), rel=1e-10)
        assert found.effect_size == pytest.approx(peer.statistic / np.sqrt(10))


@pytest.mark.slow
def test_equivalence_and_holm_agree_with_statsmodels():
    found = compute_contrasts(HZ, VALUES, 0.95)
    for place, contrast in enumerate(found[:2], start=1):
        assert contrast.p_equivalence == pytest.approx(ttost_paired(VALUES[:, place], VALUES[:, 0], -2, 2)[0])
    assert found[2].p_equivalence is None  # 35 Hz: not asked
    peer = multipletests([c.p for c in found], method="holm")[1]
    assert [c.p_holm for c in found] == pytest.approx(list(peer))
    assert apply_holm_correction([0.01, 0.04, 0.03]) == pytest.approx((0.03, 0.06, 0.06))
    whole = multipletests([0.01, 0.04, 1.0, 1.0], method="holm")[1][:2]
    assert apply_holm_correction([0.01, 0.04], planned=4) == pytest.approx(list(whole))


@pytest.mark.parametrize("people", [2, 3])
def test_values_that_are_all_equal_have_no_error_and_no_division_by_it(people):
    known = np.arange(3)[:, None] < np.array([people, 3])
    errors = compute_mean_errors(np.ones((3, 2)), known)
    assert errors.error.tolist() == [0.0, 0.0]
    assert errors.df.tolist() == [people - 1.0, 2.0]


def test_unequal_spread_is_found_and_equal_spread_is_not():
    found = compute_contrasts(HZ, VALUES, 0.95)
    assert found[2].p_spread < 0.01
    assert found[0].p_spread > 0.05


def test_a_gap_leaves_out_the_person_for_that_contrast_alone():
    values = VALUES.copy()
    values[0, 1] = np.nan
    assert [c.participants for c in compute_contrasts(HZ, values, 0.95)] == [9, 10, 10]
    assert compute_contrasts(HZ, values[:1], 0.95) == ()


def test_differences_that_are_equal_but_for_rounding_are_left_out():
    """0.1 + 0.2 is not 0.3: a t test would be certain of it."""
    values = np.array([[0.0, 0.3, 0.0], [0.1, 0.1 + (0.1 + 0.2), 0.4]])
    assert np.ptp(values[:, 1] - values[:, 0]) > 0
    assert [c.frequency_hz for c in compute_contrasts((5.0, 15.0, 25.0), values, 0.95)] == [25.0]


def test_sums_that_are_all_equal_do_not_determine_the_test_of_equal_spread():
    """Both thresholds then vary by the same amount in opposite directions: the correlation would be 0 / 0."""
    (found,) = compute_contrasts((5.0, 15.0), np.array([[-1.0, 3.0], [0.0, 2.0], [1.0, 1.0]]), 0.95)
    assert found.difference_db == 2.0 and found.p_spread is None
