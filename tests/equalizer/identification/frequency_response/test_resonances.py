import numpy as np
import pytest

from equalizer.identification.frequency_response import resonances as resonances_module
from equalizer.identification.frequency_response.resonances import COUPLING, GAIN, ResonanceSearch, find_resonances
from equalizer.identification.frequency_response.single_mode import fit_single_mode
from equalizer.identification.frequency_response.transfer_estimate import estimate_transfer


@pytest.fixture(scope="module")
def found(plants, synthetic):
    """From 1 to 500 Hz, five seeds."""
    search = ResonanceSearch(draws=60)
    return [
        find_resonances(estimate_transfer((synthetic.sweeps(plants, 1.0, 500.0, 20.0, seed=seed),)), search)
        for seed in range(5)
    ]


def nearest(resonances, frequency_hz):
    return min(resonances, key=lambda resonance: abs(resonance.frequency_hz - frequency_hz))


def test_a_mode_on_a_slope_is_fitted_exactly_without_noise():
    s = 2j * np.pi * np.linspace(9.0, 13.0, 60)
    w = 2 * np.pi * 11.0
    mode = s**2 / (s**2 + 2 * 0.04 * w * s + w**2)
    entries = np.stack([mode * 3.0 + 1.0 + 0.1 * s, -mode + 2.0], axis=1)
    natural, damping = fit_single_mode(s.imag / 2 / np.pi, (entries * 1e-3)[None])
    assert natural[0] == pytest.approx(11.0, rel=2e-3)
    assert damping[0] == pytest.approx(0.04, rel=0.05)


def test_noise_does_not_bias_the_damping():
    f = np.linspace(9.5, 12.5, 90)
    mode = f**2 / (11.0**2 - f**2 + 2j * 0.05 * 11.0 * f)
    parts = np.random.default_rng(1).standard_normal((2, 300, 90, 1)) * 1.5
    natural, damping = fit_single_mode(f, mode[None, :, None] + parts[0] + 1j * parts[1])
    assert np.nanmedian(natural) == pytest.approx(11.0, abs=0.02)
    assert np.nanmedian(damping) == pytest.approx(0.05, rel=0.06)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("frequency_hz", "damping"), [(11.0, 0.06), (22.5, 0.05), (84.0, 0.022), (110.0, 0.03), (146.0, 0.025)]
)
def test_the_modes_of_the_synthetic_device_are_found(found, frequency_hz, damping):
    for resonances in found:
        found_there = nearest(resonances, frequency_hz)
        assert found_there.frequency_hz == pytest.approx(frequency_hz, rel=3e-3)
        assert found_there.damping_ratio == pytest.approx(damping, rel=0.04)
        assert found_there.width_hz == pytest.approx(2 * found_there.damping_ratio * found_there.frequency_hz)


@pytest.mark.slow
def test_what_couples_is_distinguished_from_what_is_only_loud(found):
    eleven = nearest(found[0], 11.0)
    assert eleven.seen_in == (COUPLING, GAIN)


@pytest.mark.slow
def test_intervals_are_as_wide_as_the_estimates_spread(found):
    for frequency_hz in (11.0, 22.5, 84.0):
        ones = [nearest(resonances, frequency_hz) for resonances in found]
        spread = np.std([each.frequency_hz for each in ones], ddof=1)
        half = np.mean([np.diff(each.frequency_interval_hz)[0] for each in ones]) / 2
        assert 0.8 < half / spread < 6.0
        assert all(each.frequency_interval_hz[0] < each.frequency_hz < each.frequency_interval_hz[1] for each in ones)
        assert all(each.damping_interval[0] < each.damping_ratio < each.damping_interval[1] for each in ones)


def test_intervals_hold_the_true_mode_also_beside_other_modes(plants, measuring):
    """Nominally 95 %; with the noise alone it was about 60 %."""
    held, frequencies_hz = [], np.array([11.0, 13.2, 22.5, 31.0])
    for seed in range(10):
        random = np.random.default_rng([29, seed])
        modes = [(3.5, 1.4, axis / np.sqrt(plants.MASS_KG)) for axis in np.eye(3)]
        dampings = 10 ** random.uniform(np.log10(0.005), np.log10(0.05), 4)
        for frequency_hz, damping in zip(frequencies_hz, dampings, strict=True):
            shape = random.standard_normal(3)
            modes.append((frequency_hz, damping, 0.7 * shape / np.linalg.norm(shape)))
        lines_hz = np.arange(8.0, 42.0, 1 / random.choice([10, 20, 30]))
        estimate = measuring.noisy(plants._sampled(modes), lines_hz, 10 ** random.uniform(-2, -0.5), seed)
        resonances = find_resonances(estimate, ResonanceSearch(draws=40))
        for frequency_hz, damping in zip(frequencies_hz, dampings, strict=True):
            mode = nearest(resonances, frequency_hz)
            if abs(mode.frequency_hz / frequency_hz - 1) < 0.02:
                (low_hz, high_hz), (low, high) = mode.frequency_interval_hz, mode.damping_interval
                held.append((low_hz <= frequency_hz <= high_hz, low <= damping <= high))
    assert len(held) > 35
    assert (np.mean(held, axis=0) >= 0.85).all()


def test_no_interval_extends_below_zero():
    interval = resonances_module._compute_interval(np.array([0.01, 0.02]), 0.1)
    assert interval == pytest.approx((0.0, 0.12), abs=1e-3)


def test_nothing_is_found_where_there_is_only_a_slope(plants, synthetic):
    band = estimate_transfer((synthetic.sweeps(plants, 4.5, 8.5, 10.0),)).select_band(4.6, 8.4)
    assert find_resonances(band) == ()


def test_peaks_lower_than_asked_are_passed_over(plants, synthetic):
    estimate = estimate_transfer((synthetic.sweeps(plants, 4.5, 37.0, 10.0),))
    prominent = find_resonances(estimate, ResonanceSearch(prominence_db=15.0))
    assert len(prominent) < len(find_resonances(estimate))


def test_without_a_reliable_line_there_is_nothing_to_find(plants, synthetic):
    estimate = estimate_transfer((synthetic.sweeps(plants, 4.5, 37.0, 5.0),))
    assert find_resonances(estimate.select_lines(~estimate.reliable).select_band(0.0, 3.0)) == ()
