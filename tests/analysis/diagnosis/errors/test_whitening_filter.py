"""Noise of a known spectrum becomes white, and what it hid stands out."""

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.diagnosis.errors.whitened_measure import fit_whitening_filter

LEAST = np.array([1e-3])


def ringing_noise(seed: int, samples: int = 8000) -> np.ndarray:
    """A lightly damped mode that noise shakes."""
    white = np.random.default_rng(seed).normal(size=(samples, 1))
    return np.asarray(lfilter([1.0], [1.0, -1.9, 0.95], white, axis=0))


def test_the_part_predicted_from_the_past_is_subtracted():
    whitened = fit_whitening_filter([ringing_noise(1)], LEAST).apply(ringing_noise(2))
    assert whitened.std() == pytest.approx(1.0, rel=0.05)
    after = np.corrcoef(whitened[100:-1, 0], whitened[101:, 0])[0, 1]
    assert abs(after) < 0.1


def test_white_noise_stays_what_it_is():
    white = np.random.default_rng(3).normal(size=(8000, 1))
    assert np.std(fit_whitening_filter([white], LEAST).apply(white) - white) < 0.15


def test_whitening_raises_a_tone_that_the_noise_lacks():
    whitening = fit_whitening_filter([ringing_noise(1)], LEAST)
    tone = 2.0 * np.sin(2 * np.pi * 0.3 * np.arange(8000))[:, None]
    before = np.var(ringing_noise(2) + tone) / np.var(ringing_noise(2))
    after = np.var(whitening.apply(ringing_noise(2) + tone)) / np.var(whitening.apply(ringing_noise(2)))
    assert before < 1.1
    assert after > 10


def test_a_sample_depends_on_no_later_sample():
    whitening, residual = fit_whitening_filter([ringing_noise(1)], LEAST), ringing_noise(2)
    changed = residual.copy()
    changed[5000:] += 7.0
    assert np.allclose(whitening.apply(changed)[:5000], whitening.apply(residual)[:5000])


def test_only_samples_after_enough_known_ones_count():
    whitening, residual = fit_whitening_filter([ringing_noise(1)], LEAST), ringing_noise(2)
    residual[:300] = np.nan
    full = whitening.mask_full_history(residual)
    assert not full[: 300 + whitening.order].any()
    assert full[300 + whitening.order :].all()
    assert np.isnan(whitening.apply(residual)[:300]).all()
    assert np.isfinite(whitening.apply(residual)[300:]).all()
