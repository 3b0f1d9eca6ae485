import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.diagnosis.noise.rounding import find_rounding_step, undo_rounding


@pytest.mark.parametrize("step", [1e-5, 0.25])
def test_a_rounded_channel_gives_its_step(step):
    moved = np.cumsum(np.random.default_rng(1).standard_normal(5000)) * step
    rounded = (step * np.round(moved / step)).astype(np.float32).astype(np.float64)
    assert find_rounding_step(rounded) == pytest.approx(step, rel=1e-3)


def test_a_channel_that_is_not_rounded_has_no_step():
    random = np.random.default_rng(2)
    assert find_rounding_step(random.standard_normal(5000)) == 0
    assert find_rounding_step(random.standard_normal(5000).astype(np.float32).astype(np.float64)) == 0
    assert find_rounding_step(np.zeros(100)) == 0


def test_missing_samples_do_not_make_a_channel_a_rounded_one():
    fine = np.round(np.cumsum(np.random.default_rng(1).standard_normal(2000)), 3)
    assert find_rounding_step(fine) == 0
    with_gaps = np.full(3 * len(fine), np.nan)
    with_gaps[::3] = fine
    assert find_rounding_step(with_gaps) == 0


@settings(max_examples=20, deadline=None)
@given(before=st.floats(0.02, 1.2), seed=st.integers(0, 1000))
def test_what_rounding_hides_between_repeats_is_put_back(before, seed):
    random = np.random.default_rng(seed)
    movement = random.uniform(-20, 20, 4000)
    looks = np.round(movement + before * random.standard_normal((8, 4000)))
    between = float(np.mean(looks.var(axis=0, ddof=1)))
    assert undo_rounding(between, 1.0).total == pytest.approx(before**2 + 1 / 12, rel=0.08)


def test_without_noise_all_of_the_rounding_repeats():
    noise = undo_rounding(0.0, 2.0)
    assert noise.total == pytest.approx(4 / 12, rel=1e-6)
    assert noise.repeating == pytest.approx(noise.total)


def test_without_rounding_nothing_is_put_back():
    assert undo_rounding(0.3, 0.0).total == 0.3
    assert undo_rounding(0.3, 0.0).repeating == 0
