"""Whether more than noise is left over a whole recording, where no place stands out."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.localisation import mismatch_maps
from analysis.diagnosis.localisation.mismatch_maps import STRETCH_COUNT, _test_against_noise, compute_cells

LENGTH = 50 * STRETCH_COUNT


def noise_p_value(sizes: np.ndarray, seed: int = 1) -> float:
    """sizes: (stretches,), rms of what is left in each, over the noise."""
    left = np.random.default_rng(seed).standard_normal((LENGTH, 1)) * np.repeat(sizes, 50)[:, None]
    every, nothing = np.ones(LENGTH, dtype=bool), np.zeros(LENGTH, dtype=bool)
    measure = SimpleNamespace(
        records=(SimpleNamespace(fit=every, choose=nothing, test=nothing),), unit=np.ones(1), noise=np.ones(1)
    )
    return _test_against_noise(measure, SimpleNamespace(residuals=(left,)), 0)


def test_a_few_stretches_that_err_by_far_are_p_value_of_noise():
    sizes = np.full(STRETCH_COUNT, 0.1)
    sizes[-2:] = 30.0, 100.0
    assert noise_p_value(sizes) < 1e-6


def test_a_little_more_in_all_stretches_is_p_value_of_noise():
    assert noise_p_value(np.full(STRETCH_COUNT, 1.3)) < 1e-3


@pytest.mark.parametrize("seed", range(5))
def test_noise_is_no_p_value_of_noise(seed):
    assert noise_p_value(np.ones(STRETCH_COUNT), seed) > 0.02


def test_a_single_stretch_of_twice_the_noise_is_none():
    sizes = np.ones(STRETCH_COUNT)
    sizes[3] = 2.0
    assert noise_p_value(sizes) > 0.02


@pytest.mark.parametrize(("band_hz", "listed_hz"), [(100.0, [16.0, 32.0, 64.0]), (80.0, [16.0, 32.0])])
def test_no_mismatch_is_listed_above_the_band_in_which_forces_are_compared(monkeypatch, band_hz, listed_hz):
    """Only the filter's remainder is there, which is not explained and means nothing."""
    octaves = [SimpleCell((low_hz, 2 * low_hz)) for low_hz in (16.0, 32.0, 64.0, 128.0)]
    monkeypatch.setattr(mismatch_maps, "compute_mismatch_cells", lambda *_: octaves)
    recording = SimpleNamespace(sample_rate_hz=1000.0, response=SimpleNamespace(samples=np.zeros((9, 1))))
    record = SimpleNamespace(recording=recording, measured=np.zeros((9, 1)))
    measure = PredictedForce((record,), (), np.ones(1), np.ones(1), band_hz)
    cells = compute_cells(measure, SimpleNamespace(residuals=(np.zeros((9, 1)),)), (None,))
    assert [cell.band_hz[0] for cell in cells] == listed_hz
    assert mismatch_maps._find_compared_band_end_hz(measure) == band_hz
    # Motions are compared up to half the sample rate, here 150 Hz.
    recording.sample_rate_hz = 300.0
    motion_measure = SimpleNamespace(records=(record,), unit=np.ones(1))
    cells = compute_cells(motion_measure, SimpleNamespace(residuals=(np.zeros((9, 1)),)), (None,))
    assert [cell.band_hz[0] for cell in cells] == [16.0, 32.0, 64.0, 128.0]
    assert mismatch_maps._find_compared_band_end_hz(motion_measure) == 150.0


@dataclass(frozen=True)
class SimpleCell:
    band_hz: tuple[float, float]
    part: int = 0
