"""Spectra up to the Nyquist frequency, in stretches of any length."""

import numpy as np
import pytest

from analysis.look.channels import list_channels
from analysis.look.cross_spectra import estimate_cross_spectra
from analysis.look.gain_and_lag import estimate_gain_and_lag

RATE_HZ = 1000.0


def test_the_nyquist_line_counts_once(make_recording):
    alternating = (-1.0) ** np.arange(4000)
    spectra = estimate_cross_spectra(list_channels(make_recording(alternating, alternating)), [(0, 4000)], RATE_HZ)
    step_hz = spectra.frequency_hz[1] - spectra.frequency_hz[0]
    assert spectra.get_power_density(0).sum() * step_hz == pytest.approx(1.0, rel=1e-3)


def test_a_lag_in_stretches_of_odd_length_is_that_in_even_ones(make_recording, make_noise):
    first = make_noise(high_hz=200.0)
    channels = list_channels(make_recording(first, np.roll(first, 5)))
    lags = {}
    for length in (64, 65):
        stretches = [(start, start + length) for start in range(100, 19_000, 65)]
        spectra = estimate_cross_spectra(channels, stretches, RATE_HZ)
        assert spectra.frequency_hz[-1] == RATE_HZ / 2
        lags[length] = estimate_gain_and_lag(spectra, 0, 1).lag_samples
    assert lags[65] == pytest.approx(lags[64], abs=1e-9)
