"""Lines with weights, and bins that do not blunt a resonance."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.state_space.weighted_lines import (
    average_bins,
    compute_bin_centres_hz,
    estimate_scatter_variance,
    group_lines,
    weight_lines,
)


def test_all_reliable_lines_of_the_band_are_taken_and_weighted_by_their_noise(plants, measuring):
    plant = measuring.small_plant(plants)
    one = measuring.response_of(np.arange(1.0, 50), plant.response(np.arange(1.0, 50)), 0.04)
    reliable = one.reliable.copy()
    reliable[9] = False
    other = measuring.response_of(np.array([10.5, 99.0]), plant.response([10.5, 99.0]), 0.01)
    lines = weight_lines([replace(one, reliable=reliable), other], (9.0, 12.0))
    np.testing.assert_allclose(lines.frequency_hz, [9, 10.5, 11, 12])
    np.testing.assert_allclose(lines.weight[:, 0, 0], [5, 10, 5, 5])


def test_noise_that_is_not_told_is_read_from_the_scatter_of_neighbours(plants, measuring):
    plant = measuring.small_plant(plants)
    noisy = measuring.noisy(plant, np.arange(5, 35, 0.02), 0.5, seed=1)
    assert estimate_scatter_variance(noisy.response).mean() == pytest.approx(0.25, rel=0.1)
    untold = replace(noisy, noise_variance=np.full_like(noisy.noise_variance, np.nan))
    assert weight_lines([untold], (5.0, 35.0)).weight.mean() == pytest.approx(2.0, rel=0.1)


def test_bins_about_the_truth_hold_the_truth_at_a_resonance(plants, measuring):
    plant = measuring.small_plant(plants)
    lines = weight_lines([measuring.exact(plant, np.arange(5, 35, 0.1))], (5.0, 35.0))
    bins = group_lines(lines, 5, 0.0)
    middles = compute_bin_centres_hz(lines, bins)
    truth = plant.response(middles)
    about = average_bins(lines, bins, plant.response(lines.frequency_hz), truth)
    np.testing.assert_allclose(about.response, truth, rtol=1e-9)
    plain = average_bins(lines, bins, np.zeros_like(lines.response), np.zeros_like(truth))
    assert np.abs(plain.response - truth).max() > 0.001 * np.abs(truth).max()


def test_a_bin_weighs_as_much_as_its_lines_together(plants, measuring):
    plant = measuring.small_plant(plants)
    lines = weight_lines([measuring.noisy(plant, np.arange(5, 35, 0.1), 0.5, 2)], (5.0, 35.0))
    bins = group_lines(lines, 4, 0.0)
    nothing = np.zeros((len(bins), 3, 3))
    assert average_bins(lines, bins, np.zeros_like(lines.response), nothing).weight[0] == pytest.approx(4.0)


def test_bins_of_a_share_of_an_octave_grow_with_frequency(plants, measuring):
    frequency = np.arange(5, 450, 0.5)
    lines = weight_lines([measuring.exact(measuring.small_plant(plants), frequency)], (5.0, 450.0))
    sizes = [part.stop - part.start for part in group_lines(lines, 1, 1 / 10)]
    assert sum(sizes) == len(lines)
    assert sizes[0] == 1 and sizes[-2] > 40
