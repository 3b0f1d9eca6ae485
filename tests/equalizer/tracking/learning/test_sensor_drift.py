"""Repeats with a sensor whose zero has moved since it was opened, and moves while it measures."""

import numpy as np
import pytest

from equalizer.tracking.feedforward.band_pass import filter_to_band
from equalizer.tracking.learning.iteration import IterationSettings, Verdict, rms, start_iteration, update_forces

RATE_HZ, BAND_HZ = 1000.0, (5.0, 35.0)


@pytest.mark.parametrize(("offset", "drift_per_s"), [(0.5, 0.0), (0.0, 0.3)])
def test_offset_and_drift_of_the_sensor_are_not_learnt(offset, drift_per_s):
    """The device accelerates by 1 m/s^2 per N, the model says 0.9."""
    rows = np.hanning(1500)[:, None] * np.random.default_rng(1).standard_normal((1500, 3))
    wanted = filter_to_band(np.pad(filter_to_band(rows, RATE_HZ, BAND_HZ), ((300, 300), (0, 0))), RATE_HZ, BAND_HZ)
    zero = offset + drift_per_s * np.arange(len(wanted))[:, None] / RATE_HZ
    settings = IterationSettings(wanted, lambda error: error / 0.9, RATE_HZ, BAND_HZ, noise_floor=1e-6)
    state = start_iteration(settings)
    for _ in range(6):
        if state.verdict is Verdict.CONTINUE:
            state = update_forces(state, state.forces + zero)
    assert rms(filter_to_band(state.best_forces - wanted, RATE_HZ, BAND_HZ)) < 1e-3 * rms(wanted)
