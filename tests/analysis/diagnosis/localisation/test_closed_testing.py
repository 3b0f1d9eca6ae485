import numpy as np
import pytest
from statsmodels.stats.multitest import multipletests

from analysis.diagnosis.localisation.mismatch_cells import adjust_nested_p_values


def test_one_family_is_plain_benjamini_hochberg():
    p_values = np.random.default_rng(1).random(20) ** 3
    ours = adjust_nested_p_values(p_values, [()] * 20, 0.05)
    assert ours == pytest.approx(multipletests(p_values, method="fdr_bh")[1])


def test_nothing_is_found_in_a_family_that_was_not():
    p_values = np.array([1e-8, 0.5, 0.03, 0.9])
    adjusted = adjust_nested_p_values(p_values, [("a",), ("a",), ("b",), ("b",)], 0.01)
    assert adjusted[0] < 0.01
    assert (adjusted[1:] > 0.01).all()


def test_no_test_is_surer_after_adjusting():
    random = np.random.default_rng(2)
    p_values = random.random(60) ** 4
    families = [(k % 3, k % 5) for k in range(60)]
    assert (adjust_nested_p_values(p_values, families, 0.05) >= p_values - 1e-15).all()


def test_false_discoveries_stay_at_the_level():
    random = np.random.default_rng(3)
    families = [(k // 20, k // 5) for k in range(60)]
    found = [adjust_nested_p_values(random.random(60), families, 0.05).min() <= 0.05 for _ in range(300)]
    assert np.mean(found) < 0.09


def test_the_order_of_tests_does_not_matter():
    random = np.random.default_rng(4)
    p_values, order = random.random(30) ** 4, random.permutation(30)
    families = [(k % 2, k % 7) for k in range(30)]
    there = adjust_nested_p_values(p_values, families, 0.05)
    turned = adjust_nested_p_values(p_values[order], [families[k] for k in order], 0.05)
    assert turned == pytest.approx(there[order])


def test_no_tests_give_no_answers():
    assert len(adjust_nested_p_values(np.empty(0), [], 0.05)) == 0
