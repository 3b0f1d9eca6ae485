import numpy as np
import pytest
from scipy import signal as sg

from equalizer.signals.clock_offset import NoOffsetError, find_clock_offset
from equalizer.signals.resampling import Samples

FINE_HZ = 50_000.0


@pytest.fixture(scope="module")
def motion():
    """Two seconds of motion below 60 Hz, at any time."""
    noise = np.random.default_rng(3).standard_normal(int(2 * FINE_HZ))
    fine = sg.sosfiltfilt(sg.butter(4, 60.0, fs=FINE_HZ, output="sos"), noise)
    fine /= fine.std()
    return lambda times_s: np.interp(times_s, np.arange(len(fine)) / FINE_HZ, fine)


def samples(motion, rate_hz, begin_s, end_s, clock_s=0.0, noise=0.0):
    times_s = np.arange(begin_s, end_s, 1 / rate_hz)
    values = motion(times_s) + noise * np.random.default_rng(4).standard_normal(len(times_s))
    return Samples(times_s - clock_s, values, rate_hz, 1.5 / rate_hz)


@pytest.mark.parametrize("offset_s", [0.0, 0.0123456, -0.0543211])
def test_an_invented_offset_is_found_to_a_fiftieth_of_a_sample(motion, offset_s):
    found = find_clock_offset(samples(motion, 1000.0, 0.2, 1.8), samples(motion, 1500.0, 0.2, 1.7, offset_s), 0.0, 0.1)
    assert found.offset_s == pytest.approx(offset_s, abs=2e-5)
    assert found.correlation > 0.999


def test_noise_and_a_turned_sign_do_not_hide_it(motion):
    other = samples(motion, 1000.0, 0.2, 1.7, 0.02, noise=0.5)
    turned = Samples(other.times_s, -other.values, other.rate_hz, other.gap_s)
    found = find_clock_offset(samples(motion, 1000.0, 0.2, 1.8), turned, 0.0, 0.1)
    assert found.offset_s == pytest.approx(0.02, abs=2e-4)
    assert -0.9 < found.correlation < -0.7


def test_signals_that_have_nothing_in_common_are_refused(motion):
    noise = np.random.default_rng(5).standard_normal(1600)
    other = Samples(np.arange(1600) / 1000 + 0.2, noise, 1000.0, 1.5e-3)
    with pytest.raises(NoOffsetError, match="agree nowhere"):
        find_clock_offset(samples(motion, 1000.0, 0.2, 1.8), other, 0.0, 0.1)


def test_an_offset_beyond_the_range_is_refused(motion):
    with pytest.raises(NoOffsetError, match="end of the range|agree nowhere"):
        find_clock_offset(samples(motion, 1000.0, 0.2, 1.8), samples(motion, 1000.0, 0.2, 1.8, 0.0065), 0.0, 0.004)


def test_clocks_without_a_common_time_are_refused(motion):
    with pytest.raises(NoOffsetError, match="do not overlap"):
        find_clock_offset(samples(motion, 1000.0, 0.2, 1.8), samples(motion, 1000.0, 0.2, 1.8, 50.0), 0.0, 1.0)


def test_a_periodic_signal_does_not_say_which_period():
    times_s = np.arange(2000) / 1000
    wave = Samples(times_s, np.sin(2 * np.pi * 20 * times_s), 1000.0, 1.5e-3)
    with pytest.raises(NoOffsetError, match="agree equally well"):
        find_clock_offset(wave, wave, 0.0, 0.2)
