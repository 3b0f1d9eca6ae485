"""Steps of a converter, before and after the noise."""

import numpy as np
import pytest

from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.starts.lattice import find_lattice_offset, find_lattice_step, find_step_under_noise

EFFECT = EFFECTS["quantization"]
NOISE = 0.042


def signal(seed: int, n: int = 20_000) -> tuple[np.ndarray, np.random.Generator]:
    generator = np.random.default_rng(seed)
    return 5 * np.sin(np.arange(n) / 7.3) + 3 * np.sin(np.arange(n) / 19.7), generator


@pytest.mark.parametrize("step", [0.01, 0.25, 1.0])
def test_the_step_of_a_lattice_is_read_off_exactly(step):
    truth, generator = signal(1)
    rounded = (step * np.round((truth + NOISE * generator.standard_normal(len(truth))) / step)).astype(np.float32)
    assert find_lattice_step(rounded.astype(np.float64)) == pytest.approx(step, rel=1e-5)


def test_a_lattice_that_misses_zero_is_one():
    values = 0.5 * np.round(signal(1)[0] / 0.5) + 0.13
    assert find_lattice_step(values) == pytest.approx(0.5)
    assert find_lattice_offset(values, 0.5) == pytest.approx(0.13)


def test_values_that_lie_anywhere_make_no_lattice():
    truth, generator = signal(2)
    values = truth + NOISE * generator.standard_normal(len(truth))
    assert find_lattice_step(values) is None
    assert find_lattice_step(values.astype(np.float32).astype(np.float64)) is None
    assert find_lattice_offset(values, 0.25) is None
    assert find_lattice_step(np.zeros(100)) is None


@pytest.mark.parametrize("step", [0.25, 0.6])
def test_steps_under_noise_leave_a_staircase(step):
    truth, generator = signal(3)
    values = step * np.round(truth / step) + NOISE * generator.standard_normal(len(truth))
    assert find_step_under_noise(values, NOISE) == pytest.approx(step, rel=0.02)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_without_steps_there_is_no_staircase(seed):
    truth, generator = signal(seed)
    assert find_step_under_noise(truth + NOISE * generator.standard_normal(len(truth)), NOISE) is None


@pytest.mark.parametrize("share", [0.5, 3.0, 20.0])
def test_given_the_reading_the_right_model_leaves_the_noise(share):
    """Whether noise dithers the steps or drowns in them."""
    truth, generator = signal(4)
    step = share * NOISE
    measured = step * np.round((truth + NOISE * generator.standard_normal(len(truth))) / step)
    predicted = EFFECT.action.conditioned(truth[:, None], measured[:, None], np.array([NOISE]), (0,), {"step": step})
    residual = (measured - predicted[:, 0]) / NOISE
    assert residual.std() == pytest.approx(1.0, abs=0.02)
    assert abs(np.corrcoef(residual, truth)[0, 1]) < 0.03


def test_given_the_reading_a_wrong_model_still_leaves_its_error():
    truth, generator = signal(5)
    measured = 0.25 * np.round((truth + NOISE * generator.standard_normal(len(truth))) / 0.25)
    predicted = EFFECT.action.conditioned(
        0.9 * truth[:, None], measured[:, None], np.array([NOISE]), (0,), {"step": 0.25}
    )
    assert (measured - predicted[:, 0]).std() > 0.6 * (0.1 * truth).std()


def test_a_recording_off_the_lattice_is_compared_with_the_rounded_prediction():
    truth, generator = signal(6)
    measured = 0.3 * np.round(truth / 0.3) + NOISE * generator.standard_normal(len(truth))
    predicted = EFFECT.action.conditioned(truth[:, None], measured[:, None], np.array([NOISE]), (0,), {"step": 0.3})
    np.testing.assert_allclose(predicted[:, 0], 0.3 * np.round(truth / 0.3))


@pytest.mark.parametrize("seed", [1, 2])
def test_a_clean_device_suggests_no_step_and_a_coarse_one_its_own(bench, seed):
    model, command = bench.three_axes(), bench.commands(3)
    clean = bench.measured(model, (), command, seed)
    assert EFFECT.starts(bench.evidence(model, clean), 0) == ()
    clean.response[:, 0] = 0.2 * np.round(clean.response[:, 0] / 0.2)
    assert EFFECT.starts(bench.evidence(model, clean), 0)[0]["step"] == pytest.approx(0.2)
    assert EFFECT.starts(bench.evidence(model, clean), 1) == ()
