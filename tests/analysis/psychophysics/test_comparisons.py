import math

import numpy as np
import pytest
from scipy.stats import tukey_hsd
from statsmodels.stats.multicomp import pairwise_tukeyhsd

from analysis.psychophysics.anova import GroupSummary, compute_one_way_anova
from analysis.psychophysics.comparisons import compare_group_means, compute_comparison_half_widths, compute_tukey_kramer

BEAMS = {
    "st": (82, 86, 79, 83, 84, 85, 86, 87),
    "al1": (74, 82, 78, 75, 76, 77),
    "al2": (79, 79, 77, 78, 82, 79),
}


def half_width(interval):
    return (interval.upper - interval.lower) / 2


def test_beam_strength_gives_the_known_pairs():
    known = {
        ("st", "al1"): (-7.0, -10.3936, -3.6064, 1.68e-4),
        ("st", "al2"): (-5.0, -8.3936, -1.6064, 0.00405),
        ("al1", "al2"): (2.0, -1.628, 5.628, 0.356),
    }
    pairs = compare_group_means(compute_one_way_anova(BEAMS)).pairs
    assert [(pair.first, pair.second) for pair in pairs] == list(known)
    for pair in pairs:
        difference, lower, upper, p = known[pair.first, pair.second]
        assert pair.difference == pytest.approx(difference)
        assert (pair.lower, pair.upper) == pytest.approx((lower, upper), abs=5e-4)
        assert pair.p == pytest.approx(p, rel=5e-3)


def test_beam_strength_gives_the_known_comparison_intervals():
    result = compare_group_means(compute_one_way_anova(BEAMS))
    assert result.critical_range == pytest.approx(3.62796, abs=5e-6)
    assert [half_width(interval) for interval in result.intervals] == pytest.approx(
        [1.57967, 1.81398, 1.81398], abs=5e-6
    )


def test_five_equal_groups_give_the_published_honest_difference():
    means = (-4.8, -2.6, 1.0, 3.6, 4.8)
    groups = [GroupSummary(name, 5, mean, None) for name, mean in zip("ABCDE", means, strict=True)]
    result = compute_tukey_kramer(groups, mean_square_within=17.3, df_within=20)
    pair = result.pairs[0]
    assert (pair.upper - pair.lower) / 2 == pytest.approx(7.8717, abs=1e-4)
    assert half_width(result.intervals[0]) == pytest.approx(3.9359, abs=1e-4)
    significant = {pair.first + pair.second for pair in result.pairs if pair.p < 0.05}
    assert significant == {"AD", "AE"}


@pytest.mark.slow
def test_disjoint_intervals_are_the_significant_pairs_of_equal_groups():
    generator = np.random.default_rng(2)
    result = compare_group_means(
        compute_one_way_anova({str(i): generator.normal(0.4 * i, 1, 10).tolist() for i in range(5)})
    )
    at = {interval.name: interval for interval in result.intervals}
    for pair in result.pairs:
        first, second = at[pair.first], at[pair.second]
        disjoint = first.upper < second.lower or second.upper < first.lower
        assert disjoint == (pair.p < 0.05)


def test_the_published_standard_errors_of_six_very_unequal_groups_follow_from_their_sizes():
    sizes, s = (64, 15, 9, 3, 2, 1), 7.0513
    published = (0.88141, 1.8206, 2.3504, 4.0711, 4.986, 7.0513)
    assert [s / math.sqrt(n) for n in sizes] == pytest.approx(published, rel=5e-5)
    groups = [GroupSummary(str(n), n, 20.0 + n, None) for n in sizes]
    result = compute_tukey_kramer(groups, s**2, df_within=88)
    # By hand from equation 3.32: w of the largest group, then of the single car.
    d = [[math.hypot(a, b) for b in published] for a in published]
    total = sum(d[i][j] for i in range(6) for j in range(i))
    for index in (0, 5):
        w = (5 * sum(d[index][j] for j in range(6) if j != index) - total) / 20
        assert half_width(result.intervals[index]) == pytest.approx(result.critical_range / math.sqrt(2) * w, rel=1e-4)


@pytest.mark.slow
def test_pairs_agree_with_scipy_and_intervals_with_statsmodels():
    generator = np.random.default_rng(8)
    groups = {name: generator.normal(shift, 1, n) for name, shift, n in (("a", 0, 10), ("b", 1, 7), ("c", 3, 4))}
    ours = compare_group_means(compute_one_way_anova({name: values.tolist() for name, values in groups.items()}))
    scipy_result = tukey_hsd(*groups.values())
    assert [pair.p for pair in ours.pairs] == pytest.approx(
        [scipy_result.pvalue[0, 1], scipy_result.pvalue[0, 2], scipy_result.pvalue[1, 2]], abs=1e-9
    )
    labels = np.repeat(list(groups), [len(values) for values in groups.values()])
    theirs = pairwise_tukeyhsd(np.concatenate(list(groups.values())), labels)
    theirs._simultaneous_ci()
    # statsmodels keeps the quantile of its own approximation: agree to its precision.
    assert [half_width(interval) for interval in ours.intervals] == pytest.approx(theirs.halfwidths, rel=1e-3)


def test_equal_groups_have_half_of_tukeys_honest_difference():
    half = compute_comparison_half_widths([10] * 5, mean_square_within=4.0, critical_range=4.0184)
    assert half == pytest.approx([0.6354 * 2.0] * 5, rel=1e-4)


def test_two_groups_share_the_width_of_their_difference():
    half = compute_comparison_half_widths([4, 9], mean_square_within=1.0, critical_range=math.sqrt(2))
    assert half == pytest.approx([math.sqrt(1 / 4 + 1 / 9) / 2] * 2)


def test_a_frequency_without_a_value_has_no_interval():
    result = compare_group_means(compute_one_way_anova({**BEAMS, "none": (None,)}))
    assert [interval.name for interval in result.intervals] == ["st", "al1", "al2"]


def test_without_spread_it_says_what_is_missing():
    result = compare_group_means(compute_one_way_anova({"5 Hz": (0.5,), "15 Hz": (0.7,)}))
    assert (result.pairs, result.intervals, result.critical_range) == ((), (), None)
    assert result.notes == ("Pairs need values in two groups and a spread within groups.",)


def test_a_group_without_a_mean_is_refused():
    with pytest.raises(ValueError, match="two or more groups that all have a mean; got 1"):
        compute_tukey_kramer([GroupSummary("a", 3, 1.0, 1.0), GroupSummary("b", 0, None, None)], 1.0, 2)
