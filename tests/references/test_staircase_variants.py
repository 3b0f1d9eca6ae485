"""The figures that protocol files give as reasons, measured again in small."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from staircase_variants import TRUE_DB, VARIANTS, thresholds_db


def measured(name: str):
    found = thresholds_db(VARIANTS[name], slope=2.0, lapse=0.0, runs=400, seed=4) - TRUE_DB
    return found.mean(), found.std()


def test_the_published_reading_is_nearly_unbiased():
    bias, spread = measured("after_reversal")
    assert abs(bias) < 0.35
    assert 1.4 < spread < 2.0


@pytest.mark.slow
def test_the_early_step_lowers_thresholds_by_about_a_decibel():
    assert 0.5 < measured("after_reversal")[0] - measured("at_reversal")[0] < 1.4


@pytest.mark.slow
def test_the_shortcut_at_the_start_costs_precision():
    ratio = measured("after_reversal, initial 1-up-1-down")[1] / measured("after_reversal")[1]
    assert 1.15 < ratio < 1.7
