"""Samples that repeat the one before, by chance."""

import numpy as np
import pytest

from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.simulation.logger_kernel import repeat_lost_samples
from equalizer.effects.simulation.simulator import Measurement, simulate_mechanism

EFFECT = EFFECTS["lost_samples"]
ALL = (0, 1, 2)


@pytest.fixture(scope="module")
def command(bench) -> np.ndarray:
    return bench.commands(3)


def lossy(bench, command, fraction: float, seed: int):
    """Noise comes after the loss."""
    model = bench.three_axes()
    seen = bench.measured(model, (), command, seed)
    generator = np.random.default_rng(100 + seed)
    read = np.empty_like(seen.played.response)
    repeat_lost_samples(seen.played.response.copy(), generator.random(len(read)) < fraction, read)
    seen.response[:] = read + bench.NOISE_MPS2 * generator.standard_normal(read.shape)
    return model, seen


def test_a_lost_sample_shows_what_was_read_before_it():
    samples, read = np.arange(6.0)[:, None], np.empty((6, 1))
    repeat_lost_samples(samples, np.array([False, True, False, True, True, False]), read)
    assert read[:, 0].tolist() == [0, 0, 2, 2, 2, 5]


@pytest.mark.parametrize(("fraction", "seed"), [(0.002, 1), (0.02, 2), (0.1, 3)])
def test_the_fraction_is_found(bench, command, fraction, seed):
    model, seen = lossy(bench, command, fraction, seed)
    evidence = bench.evidence(model, seen)
    assert EFFECT.starts(evidence, 0)[0]["fraction"] == pytest.approx(fraction, rel=0.25)


def test_given_what_was_measured_the_losses_stand_where_they_were(bench, command):
    model, seen = lossy(bench, command, 0.02, 4)
    noise = np.full(3, bench.NOISE_MPS2)
    placed = bench.placed("lost_samples", {"fraction": 0.02}, *ALL)
    without = simulate_mechanism(model, command, 1000.0).response
    given = simulate_mechanism(model, command, 1000.0, placed, measurement=Measurement(seen.response, noise)).response
    assert ((seen.response - without) / noise).std() > 1.5
    assert ((seen.response - given) / noise).std() == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("same_logger", [True, False])
def test_a_position_of_the_same_logger_is_lost_with_the_response(bench, command, same_logger):
    model, seen = lossy(bench, command, 0.02, 4)
    noise, rng = np.full(3, bench.NOISE_MPS2), np.random.default_rng(9)
    lost, position = np.random.default_rng(104).random(len(command)) < 0.02, seen.played.position.copy()
    if same_logger:
        repeat_lost_samples(seen.played.position.copy(), lost, position)
    measured = position + bench.NOISE_M * rng.standard_normal(position.shape)
    placed = bench.placed("lost_samples", {"fraction": 0.02}, *ALL)
    given = simulate_mechanism(model, command, 1000.0, placed, measurement=Measurement(seen.response, noise, measured))
    # Also where the response hardly changed, so that it does not show the loss.
    assert ((measured - given.position) / bench.NOISE_M).std() == pytest.approx(1.0, abs=0.02)
    assert np.any(given.position != seen.played.position) == same_logger


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_lost_in_a_clean_recording(bench, command, seed):
    model = bench.three_axes()
    evidence = bench.evidence(model, bench.measured(model, (), command, seed))
    assert EFFECT.starts(evidence, 0) == ()


def test_what_is_wrong_at_all_times_is_no_loss(bench, command):
    """A wrong gain makes samples look like their neighbours before and after alike."""
    model = bench.three_axes()
    seen = bench.measured(model, bench.placed("sensor_gain", {"gain": 0.85}, *ALL), command)
    assert EFFECT.starts(bench.evidence(model, seen), 0) == ()


def test_without_a_measurement_chance_is_the_same_each_time(bench, command):
    model, placed = bench.three_axes(), bench.placed("lost_samples", {"fraction": 0.05}, *ALL)
    first, again = (simulate_mechanism(model, command, 1000.0, placed).response for _ in range(2))
    np.testing.assert_array_equal(first, again)
    repeated = np.mean(np.all(np.diff(first[1000:], axis=0) == 0, axis=1))
    assert repeated == pytest.approx(0.05, abs=0.01)
