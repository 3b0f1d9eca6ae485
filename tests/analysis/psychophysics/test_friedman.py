import pytest
from scipy.stats import friedmanchisquare

from analysis.psychophysics.repeated_measures import compute_friedman_test

RANKED = ((1.0, 2.0, 3.0), (1.5, 2.5, 3.5), (0.1, 0.2, 0.3), (5.0, 6.0, 7.0))


def test_participants_who_agree_give_the_largest_statistic():
    # n people who rank k conditions alike: chi squared is n (k - 1), agreement 1.
    result = compute_friedman_test(RANKED)
    assert result.chi_squared == pytest.approx(8.0)
    assert result.kendall_w == pytest.approx(1.0)
    assert result.df == 2
    assert result.p == pytest.approx(friedmanchisquare(*zip(*RANKED, strict=True)).pvalue)


def test_only_ranks_matter():
    stretched = [tuple(value**3 for value in row) for row in RANKED]
    assert compute_friedman_test(stretched) == compute_friedman_test(RANKED)


def test_rows_with_gaps_are_left_out():
    assert compute_friedman_test([*RANKED, (1.0, None, 2.0), (1.0, float("nan"), 2.0)]) == compute_friedman_test(RANKED)


@pytest.mark.parametrize(
    ("values", "note"),
    [
        ([], "needs three conditions; there are 0"),
        ([(1.0, 2.0), (1.0, 2.0)], "needs three conditions; there are 2"),
        ([(1.0, 2.0, 3.0)], "needs two participants who have every condition; there are 1"),
        ([(3.0, 3.0, 3.0), (2.0, 2.0, 2.0)], "no ranks to compare"),
    ],
)
def test_too_little_data_is_reported_in_a_sentence(values, note):
    result = compute_friedman_test(values)
    assert result.p is None
    assert note in result.notes[0]
