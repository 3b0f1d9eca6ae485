"""The microcontroller's clock is recovered from arrivals that come late by chance, in bursts, and with stalls."""

import numpy as np
import pytest

from study.devices.accelerometer.clock_fit import fit_clock
from tests.slow_instances import slow_after

RATE_HZ = 2000.0


def arrivals(drift_ppm: float, seed: int, seconds: float = 60.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Device times, arrivals, and the true host times; packets wait for USB frames of 1 ms, and the host for a turn."""
    random = np.random.default_rng(seed)
    true_s = 1e5 + np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    device_s = 37.0 + (true_s - true_s[0]) / (1 + 1e-6 * drift_ppm)
    sent_s = np.ceil(1000 * true_s + 1e-6) / 1000
    arrived_s = sent_s + random.exponential(0.0005, len(true_s))
    for start in random.integers(0, len(true_s) - 200, 20):  # the host stood still: a burst
        arrived_s[start : start + 100] = np.maximum(arrived_s[start : start + 100], arrived_s[start + 100])
    return device_s, np.maximum.accumulate(arrived_s), true_s


@pytest.mark.parametrize("seed", slow_after(1, [1, 2, 3]))
@pytest.mark.parametrize("drift_ppm", [-200.0, 0.0, 30.0, 200.0])
def test_offset_and_drift_are_found(drift_ppm, seed):
    device_s, arrived_s, true_s = arrivals(drift_ppm, seed)
    fit = fit_clock(device_s, arrived_s)
    assert fit.drift_ppm == pytest.approx(drift_ppm, abs=3.0)
    error_s = fit.to_host_s(device_s) - true_s
    assert np.abs(error_s).max() < 0.0006  # of which the least delay cannot be seen
    assert np.ptp(error_s) < 0.0002
    assert (fit.to_host_s(device_s) <= arrived_s + 1e-9).all()
    assert 0.001 < fit.longest_delay_s < 0.2


def test_a_plain_regression_would_be_led_astray_by_stalls():
    """Why it is no regression: delays are never negative, and a host that is busy at the end looks like drift."""
    device_s, arrived_s, _ = arrivals(0.0, 4)
    late = np.linspace(0, 1, len(device_s)) > 0.7
    arrived_s = np.maximum.accumulate(arrived_s + late * np.random.default_rng(4).exponential(0.02, len(device_s)))
    slope = np.polyfit(device_s - device_s[0], arrived_s - arrived_s[0], 1)[0]
    assert abs(1e6 * (slope - 1)) > 300
    assert abs(fit_clock(device_s, arrived_s).drift_ppm) < 20


@pytest.mark.parametrize("device_s", [[], [1.0], [1.0, 1.0], [2.0, 1.0]])
def test_device_times_that_do_not_rise_are_refused(device_s):
    with pytest.raises(ValueError, match="times that rise"):
        fit_clock(np.array(device_s), np.arange(len(device_s), dtype=float))
