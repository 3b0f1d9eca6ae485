import json
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import f_oneway

from analysis.psychophysics.anova import compute_one_way_anova

BEAMS = {
    "steel": (82, 86, 79, 83, 84, 85, 86, 87),
    "alloy 1": (74, 82, 78, 75, 76, 77),
    "alloy 2": (79, 79, 77, 78, 82, 79),
}


def test_beam_strength_gives_the_known_table():
    result = compute_one_way_anova(BEAMS)
    assert (result.df_between, result.df_within) == (2, 17)
    assert result.f == pytest.approx(15.4, abs=0.005)
    assert result.p == pytest.approx(1.5264e-4, rel=1e-4)
    assert result.notes == ()


def test_effect_sizes_follow_their_definitions():
    result = compute_one_way_anova(BEAMS)
    total = np.var(np.concatenate(list(BEAMS.values()))) * 20
    assert result.eta_squared == pytest.approx(result.ss_between / total)
    # Omega squared from F alone: df (F - 1) / (df (F - 1) + N).
    assert result.omega_squared == pytest.approx(2 * (result.f - 1) / (2 * (result.f - 1) + 20))


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.lists(st.integers(-50, 50), min_size=2, max_size=8), min_size=2, max_size=6).filter(
        lambda groups: any(len(set(group)) > 1 for group in groups)
    )
)
def test_any_table_agrees_with_scipy(groups):
    result = compute_one_way_anova({str(i): [float(v) for v in group] for i, group in enumerate(groups)})
    oracle = f_oneway(*groups)
    assert result.f == pytest.approx(oracle.statistic, rel=1e-9, abs=1e-12)
    if result.f > 1e-12:  # scipy rounds an F of zero below zero, and then has no p
        assert result.p == pytest.approx(oracle.pvalue, rel=1e-9)


def test_without_an_effect_five_percent_are_significant():
    generator = np.random.default_rng(4)
    p = [compute_one_way_anova({str(i): generator.normal(size=10).tolist() for i in range(5)}).p for _ in range(600)]
    assert 0.03 < np.mean(np.array(p) < 0.05) < 0.075


def test_gaps_are_left_out_and_counted():
    with_gaps = {name: (*values, None, float("nan")) for name, values in BEAMS.items()}
    result = compute_one_way_anova(with_gaps)
    assert result.f == compute_one_way_anova(BEAMS).f
    assert result.notes == ("6 missing values left out.",)


def test_one_participant_has_means_but_no_test():
    result = compute_one_way_anova({"5 Hz": (0.5,), "15 Hz": (0.7,)})
    assert [group.mean for group in result.groups] == [0.5, 0.7]
    assert [group.sd for group in result.groups] == [None, None]
    assert (result.f, result.p, result.df_within) == (None, None, 0)
    assert result.notes == ("Every group holds a single value, so there is no spread within groups to compare with.",)


def test_one_frequency_is_no_comparison():
    result = compute_one_way_anova({"5 Hz": (0.5, 0.6), "15 Hz": (None, None)})
    assert result.f is None
    assert result.notes[-2:] == (
        "There is no value at 15 Hz.",
        "A comparison needs values in at least two groups; there are 1.",
    )


def test_equal_values_give_no_infinite_f():
    result = compute_one_way_anova({"5 Hz": (0.1 + 0.2, 0.3), "15 Hz": (0.9, 0.9)})
    assert result.f is None
    assert "no spread to compare with: no F, no p" in result.notes[0]


def test_nothing_at_all_says_so():
    assert compute_one_way_anova({}).notes == ("A comparison needs values in at least two groups; there are 0.",)


def test_a_result_is_json():
    assert json.loads(json.dumps(asdict(compute_one_way_anova(BEAMS)), allow_nan=False))["df_within"] == 17
