import json
from dataclasses import asdict

import numpy as np
import pandas as pd
import pytest
from statsmodels.stats.anova import AnovaRM

from analysis.psychophysics.repeated_measures import (
    analyse_repeated_measures,
    compute_greenhouse_geisser_epsilon,
    compute_huynh_feldt_epsilon,
    compute_mauchly_test,
)

DRUGS = ((30, 28, 16, 34), (14, 18, 10, 22), (24, 20, 18, 30), (38, 34, 20, 44), (26, 28, 14, 30))
REACTIONS = ((1, 3, 4), (2, 2, 3), (2, 5, 6), (3, 4, 4), (3, 5, 6))


def analyse(values):
    return analyse_repeated_measures([f"s{i}" for i in range(len(values))], values)


def test_four_drugs_give_the_published_table():
    result = analyse(DRUGS)
    assert (result.df_conditions, result.df_error) == (3, 12)
    assert (result.ss_conditions, result.ss_error, result.ss_participants) == pytest.approx((698.2, 112.8, 680.8))
    assert result.f == pytest.approx(24.7589, abs=5e-5)
    assert result.p_uncorrected == pytest.approx(1.99e-5, rel=5e-3)
    assert result.epsilon == pytest.approx(0.604874, abs=5e-7)
    assert result.p == pytest.approx(0.000649, abs=5e-7)
    assert result.p_lower_bound == pytest.approx(0.00762, abs=5e-6)


def test_three_conditions_give_the_published_table():
    result = analyse(REACTIONS)
    assert result.f == pytest.approx(13.5758, abs=5e-5)
    assert result.p_uncorrected == pytest.approx(0.002683, abs=5e-7)
    assert result.epsilon == pytest.approx(0.575277, abs=5e-7)
    assert result.p == pytest.approx(0.015371, abs=5e-7)


def test_effect_sizes_follow_from_the_sums_of_squares():
    result = analyse(DRUGS)
    assert result.partial_eta_squared == pytest.approx(698.2 / (698.2 + 112.8))
    assert result.generalized_eta_squared == pytest.approx(698.2 / (698.2 + 112.8 + 680.8))


def test_any_table_agrees_with_statsmodels_before_correction():
    values = np.random.default_rng(6).normal(size=(9, 5)) + np.arange(9)[:, None]
    long = pd.DataFrame({"y": values.ravel(), "who": np.repeat(np.arange(9), 5), "what": np.tile(np.arange(5), 9)})
    oracle = AnovaRM(long, "y", "who", within=["what"]).fit().anova_table
    result = analyse(values.tolist())
    assert result.f == pytest.approx(oracle["F Value"].iloc[0])
    assert result.p_uncorrected == pytest.approx(oracle["Pr > F"].iloc[0])


def test_differences_between_people_change_nothing():
    shifted = [[value + 100.0 * i for value in row] for i, row in enumerate(DRUGS)]
    assert analyse(shifted).p == pytest.approx(analyse(DRUGS).p)


@pytest.mark.slow
def test_the_correction_keeps_its_promise_where_the_conditions_vary_unequally():
    generator = np.random.default_rng(10)
    tables = generator.normal(size=(1500, 10, 5)) * np.array([1.0, 1.0, 1.0, 3.0, 6.0])
    results = [analyse(table.tolist()) for table in tables]
    assert 0.03 < np.mean([result.p < 0.05 for result in results]) < 0.07
    assert np.mean([result.p_uncorrected < 0.05 for result in results]) > 0.075


def test_two_conditions_need_no_correction():
    assert compute_greenhouse_geisser_epsilon(np.random.default_rng(1).normal(size=(8, 2))) == pytest.approx(1.0)


def test_a_participant_with_a_gap_is_left_out_by_name():
    result = analyse([*DRUGS, (1.0, None, 2.0, 3.0), (1.0, 2.0, float("nan"), 3.0)])
    assert result.p == analyse(DRUGS).p
    assert result.left_out == ("s5", "s6")
    assert result.notes == ("Left out because a value is missing: s5, s6.",)


@pytest.mark.parametrize(
    ("values", "note"),
    [
        ([], "needs two who have every condition; there are 0"),
        ([(1.0, 2.0)], "needs two who have every condition; there are 1"),
        ([(1.0,), (2.0,)], "needs two conditions; there are 1"),
        ([(1.0, 2.0), (3.0, 4.0)], "All participants change alike"),
        ([(0.1, 0.1), (0.1, 0.1)], "All participants change alike"),
    ],
)
def test_too_little_data_is_reported_in_a_sentence(values, note):
    result = analyse(values)
    assert (result.f, result.p, result.epsilon) == (None, None, None)
    assert note in result.notes[-1]


def test_a_result_is_json():
    assert json.loads(json.dumps(asdict(analyse(DRUGS)), allow_nan=False))["participants"] == 5


def test_huynh_feldt_and_mauchly_of_the_ncss_manual():
    assert compute_huynh_feldt_epsilon(
        compute_greenhouse_geisser_epsilon(np.array(DRUGS, float)), 5, 4
    ) == pytest.approx(1.0789, abs=1e-4)
    found = analyse(DRUGS)
    assert found.epsilon_huynh_feldt == 1.0
    assert found.p_huynh_feldt == pytest.approx(found.p_uncorrected)
    assert found.mauchly_w == pytest.approx(0.186495, abs=1e-6)
    assert found.mauchly_p == pytest.approx(0.496, abs=1e-3)


def test_mauchly_needs_more_people_than_contrasts():
    assert compute_mauchly_test(np.array(DRUGS[:3], float)) is None


def test_two_conditions_with_the_same_values_do_not_determine_mauchlys_test():
    """The covariance of the contrasts is singular; by rounding its least eigenvalue is not exactly 0."""
    values = np.array([[0.1, 0.1, 0.7, 1.3], [0.3, 0.3, 0.4, 2.2], [0.2, 0.2, 1.9, 1.1], [0.9, 0.9, 1.2, 3.4]])
    assert compute_mauchly_test(np.vstack([values, values[::-1] * [1.1, 1.1, 0.9, 1.3]])) is None
