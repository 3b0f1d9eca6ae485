"""Readings of a clipped sensor, and those of an intact one that repeats its largest reading."""

import numpy as np
import pytest

from analysis.diagnosis.data.readings_at_limit import stays_at_limit


def draw_noise_in_band(samples, band_share=0.1):
    """Noise of unit variance in the lowest `band_share` of the spectrum."""
    spectrum = np.fft.rfft(np.random.default_rng(1).standard_normal(samples))
    spectrum[int(band_share * samples / 2) :] = 0
    noise = np.fft.irfft(spectrum, samples)
    return noise / noise.std()


@pytest.mark.parametrize("offset", [0.0, 0.3, -0.3])
def test_a_converter_whose_lowest_number_is_one_below_its_highest_is_clipped(offset):
    readings = np.round(64 * (draw_noise_in_band(5000) + offset))
    assert stays_at_limit(np.clip(readings, -128, 127))
    assert not stays_at_limit(readings)


def test_the_repeated_peak_of_a_periodic_command_is_no_limit():
    """At the peak 20 readings; by noise, 2 of its readings one step lower; at the next lower reading again 20."""
    period = np.concatenate([[100.0, 90.0, 80.0, 70.0], -np.arange(60.0)])
    readings = np.tile(period, 22)
    readings[[0, 64]] = 99.0
    assert not stays_at_limit(readings)


@pytest.mark.parametrize("readings", [np.full(50, np.nan), np.zeros(50), np.tile([0.0, 1.0, 1.0, 1.0, 1.0], 20)])
def test_readings_of_less_than_two_levels_show_no_limit(readings):
    assert not stays_at_limit(readings)
