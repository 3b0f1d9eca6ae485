"""The flag for a drifting response bias, counted again in small."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from drift_flag import PEOPLE, flags, simulated_session

SESSIONS = range(12 * PEOPLE)


def sessions(drift, sd, seed):
    return [simulated_session(drift, sd, (seed, number)) for number in SESSIONS]


@pytest.mark.slow
def test_criteria_that_vary_from_run_to_run_are_seldom_named_and_a_drift_mostly():
    """Where the dispersion was taken as binomial 14 % of the first were named, and 82 % of the second."""
    quiet = sessions(0.0, 0.0, 1)
    varying, drifting = flags(sessions(0.0, 0.3, 2), quiet), flags(sessions(0.3, 0.0, 3), quiet)
    assert np.mean(varying["all ten"]) < 0.06
    assert np.mean(varying["alone"]) < 0.08
    assert np.mean(drifting["all ten"]) > 0.5
    assert np.mean(drifting["alone"]) > 0.33
    assert np.mean(flags(quiet, quiet)["alone"]) < 0.03
