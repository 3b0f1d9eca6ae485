import numpy as np
import pytest

from equalizer.signals.lockin import estimate_phasors

RATE_HZ = 1000.0


def sinusoid(n: int, frequency_hz: float, phasor: complex) -> np.ndarray:
    t = np.arange(n) / RATE_HZ
    return np.real(phasor * np.exp(2j * np.pi * frequency_hz * t))


@pytest.mark.parametrize("n", [1000, 1137])
def test_amplitude_and_phase_come_back_also_without_whole_periods(n):
    x = np.column_stack([sinusoid(n, 15.0, 2.0 - 1.0j), sinusoid(n, 15.0, 0.5j)]) + [9.81, -3.0]
    assert estimate_phasors(x, RATE_HZ, 15.0)[0] == pytest.approx([2.0 - 1.0j, 0.5j], abs=1e-9)


def test_harmonics_are_distinguished():
    x = (sinusoid(1000, 5.0, 1.0) + sinusoid(1000, 15.0, 0.2j))[:, None]
    assert estimate_phasors(x, RATE_HZ, 5.0, harmonics=3)[:, 0] == pytest.approx([1.0, 0.0, 0.2j], abs=1e-9)


def test_noise_moves_the_estimate_by_no_more_than_theory_says():
    noise = np.random.default_rng(7).normal(0, 0.5, (1000, 400))
    spread = np.std(estimate_phasors(noise, RATE_HZ, 25.0)[0].real)
    assert spread == pytest.approx(0.5 * np.sqrt(2 / 1000), rel=0.1)


def test_less_than_a_period_is_refused():
    with pytest.raises(ValueError, match="less than one period of 5.0 Hz"):
        estimate_phasors(np.zeros((150, 1)), RATE_HZ, 5.0)


def test_a_harmonic_beyond_half_the_rate_is_refused():
    with pytest.raises(ValueError, match="not below half"):
        estimate_phasors(np.zeros((1000, 1)), RATE_HZ, 300.0, harmonics=2)
