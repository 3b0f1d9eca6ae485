"""The primary analysis keeps its level and its intervals are right at every level, over whole simulated studies.

Long runs of the same: `tests/references/primary_analysis_calibration.py`; docs/statistics.md has its numbers.
"""

import numpy as np
import pytest
from scipy.stats import binom, kstest

from tests.references.primary_analysis_calibration import NULLS, drawn_crowd, judge

pytestmark = [pytest.mark.slow, pytest.mark.timeout(3600)]
STUDIES = 200


@pytest.fixture(scope="module")
def null_p_values():
    """By null: p of the contrasts against 5 Hz, (studies, 4)."""
    return {
        name: np.array([judge(crowd, (91, place, number))["contrast"] for number in range(STUDIES)])
        for place, (name, crowd) in enumerate(NULLS.items())
    }


@pytest.fixture(scope="module")
def ranks():
    """By kind, of the truth in its confidence distributions, each study with a population of its own."""
    found = [judge(drawn_crowd(number), (92, number)) for number in range(2 * STUDIES)]
    return {kind: np.array([study[f"rank of {kind}"] for study in found]) for kind in ("contrast", "median")}


@pytest.mark.parametrize("name", NULLS)
def test_a_null_is_rejected_as_seldom_as_stated(null_p_values, name):
    """The highest frequency, as a protocol would declare it: binomial quantiles of 1e-4 and its complement."""
    found = int(np.sum(null_p_values[name][:, -1] < 0.05))
    least, most = binom.ppf([1e-4, 1 - 1e-4], STUDIES, 0.05)
    assert max(least, 1) <= found <= most


def test_over_all_nulls_the_level_is_5_percent(null_p_values):
    found = np.mean([p[:, -1] < 0.05 for p in null_p_values.values()])
    assert found == pytest.approx(0.05, abs=3 * np.sqrt(0.05 * 0.95 / STUDIES / len(NULLS)))


@pytest.mark.parametrize(("kind", "count"), [("contrast", 4), ("median", 5)])
def test_ranks_of_the_truth_are_uniform(ranks, kind, count):
    assert ranks[kind].shape == (2 * STUDIES, count)
    for place in range(count):
        assert kstest(ranks[kind][:, place], "uniform").pvalue > 0.001


def test_ranks_of_medians_are_not_shifted(ranks):
    """Their mean over all frequencies; by Laplace's method alone it was 0.54. The ranks of a study go together:
    their average has a standard error of 0.011 over 400 studies."""
    assert ranks["median"].mean() == pytest.approx(0.5, abs=0.035)


def test_a_standard_error_that_is_a_third_too_small_would_be_seen(ranks):
    """The control: as if thresholds of one person were those of two."""
    narrowed = 0.5 + np.clip(1.5 * (ranks["contrast"] - 0.5), -0.5, 0.5)
    assert all(kstest(narrowed[:, place], "uniform").pvalue < 0.001 for place in range(4))
