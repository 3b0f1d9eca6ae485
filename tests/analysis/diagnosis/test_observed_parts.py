"""Of what repeats, only the first periods count, and something is always left to choose by."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.observed_parts import MOST_PERIODS, observed_parts

PERIOD = 1000


def of_many_periods(device, periods):
    """One level after another, each to fit by, so that nothing but late periods would be chosen by."""
    recording = device(levels=(1.0,), axes=1, periods=periods, rest=0).recorded()
    (segment,) = recording.segments
    return replace(recording, segments=(replace(segment, role="fit"),))


def test_a_segment_of_few_periods_counts_whole(device):
    (one,) = observed_parts([of_many_periods(device, MOST_PERIODS)], 1)
    assert (one.fit | one.choose | one.test).sum() == MOST_PERIODS * PERIOD


def test_of_many_periods_the_first_ones_are_fitted_to_and_the_last_of_these_chosen_by(device):
    (one,) = observed_parts([of_many_periods(device, 4 * MOST_PERIODS)], 1)
    fitted, chosen = np.flatnonzero(one.fit), np.flatnonzero(one.choose)
    assert len(fitted) > len(chosen) > 0
    assert fitted.max() < chosen.min() <= chosen.max() < MOST_PERIODS * PERIOD
