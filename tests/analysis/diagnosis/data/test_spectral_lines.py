import numpy as np
import pytest
from scipy.stats import f as f_distribution
from scipy.stats import ncf

from analysis.diagnosis.data.spectral_lines import compute_excess_power, compute_noncentral_f_sf


@pytest.mark.parametrize("lines", [2, 20, 200])
@pytest.mark.parametrize("shift", [1.0, 30.0, 3000.0])
def test_the_noncentral_f_agrees_with_the_exact_one(lines, shift):
    ratio = (1 + shift / (2 * lines)) * np.array([0.9, 1.0, 1.1, 1.3])
    exact = ncf.sf(ratio, 2 * lines, 4000, shift)
    ours = compute_noncentral_f_sf(ratio, lines, 4000, shift)
    assert ours == pytest.approx(exact, rel=0.25, abs=0.01)


def test_without_a_shift_it_is_the_central_f():
    ratio = np.array([0.5, 1.0, 2.0])
    assert compute_noncentral_f_sf(ratio, 10, 50, 0.0) == pytest.approx(f_distribution.sf(ratio, 20, 50))


def test_a_shift_without_measure_is_no_overflow():
    assert compute_noncentral_f_sf(1.0, 10, 5000, 1e200) == pytest.approx(1.0)


def test_it_holds_for_shifts_of_millions():
    ratio = 1 + 1e7 / 20
    assert 0.4 < compute_noncentral_f_sf(ratio, 10, 5000, 1e7) < 0.6
    assert compute_noncentral_f_sf(1.3 * ratio, 10, 5000, 1e7) < 1e-6


def test_power_beyond_noise_is_recovered_and_noise_alone_is_not_found():
    random = np.random.default_rng(1)
    noise = np.full(400, 2.0)
    alone = 2.0 * random.exponential(size=(300, 400))
    p_values = np.array([compute_excess_power(power, noise, 1e6)[2] for power in alone])
    assert 0.01 < np.mean(p_values < 0.05) < 0.1
    power, limit, p_value = compute_excess_power(alone[0] + 1.0, noise, 1e6)
    assert power == pytest.approx(400, abs=2 * limit)
    assert p_value < 1e-6


def test_nothing_is_found_on_no_lines():
    assert compute_excess_power(np.empty(0), np.empty(0), 10.0) == (0.0, 0.0, 1.0)
