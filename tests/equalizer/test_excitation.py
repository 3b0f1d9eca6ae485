import numpy as np
import pytest
from scipy.signal import stft

from equalizer.signals.excitation import apply_fades, make_log_sweep, make_sine

RATE_HZ = 1000.0


def test_a_sweep_may_be_repeated_without_a_jump():
    once = make_log_sweep(1.0, 500.0, 1.0, 30_000, RATE_HZ)
    twice = np.tile(once, 2)
    seam = np.abs(np.diff(twice[29_990:30_010]))
    assert seam.max() <= np.abs(np.diff(once)).max() + 1e-9
    assert abs(once[0]) < 1e-9


def test_a_sweep_takes_equal_time_for_every_octave():
    f, t, z = stft(make_log_sweep(4.0, 256.0, 1.0, 60_000, RATE_HZ), fs=RATE_HZ, nperseg=4096)
    heard_hz = f[np.argmax(np.abs(z), axis=0)]
    expected_hz = 4.0 * 2.0 ** (t / 10.0)
    middle = slice(5, -5)
    assert heard_hz[middle] == pytest.approx(expected_hz[middle], rel=0.1, abs=0.5)


def test_a_sweep_keeps_its_amplitude():
    sweep = make_log_sweep(1.0, 100.0, 2.5, 10_000, RATE_HZ)
    assert np.abs(sweep).max() == pytest.approx(2.5, rel=1e-3)


@pytest.mark.parametrize(("from_hz", "to_hz"), [(0.0, 10.0), (20.0, 10.0), (1.0, 501.0)])
def test_a_sweep_that_cannot_be_is_refused(from_hz, to_hz):
    with pytest.raises(ValueError, match="half the rate"):
        make_log_sweep(from_hz, to_hz, 1.0, 1000, RATE_HZ)


def test_a_sweep_shorter_than_a_cycle_is_refused():
    with pytest.raises(ValueError, match="less than a cycle"):
        make_log_sweep(1.0, 2.0, 1.0, 500, RATE_HZ)


def test_a_fade_starts_and_ends_at_zero_and_leaves_the_middle_alone():
    x = apply_fades(np.ones((100, 2)), 20, 30)
    assert x[0] == pytest.approx([0.0, 0.0])
    assert x[-1] == pytest.approx([0.0, 0.0])
    assert np.all(x[20:70] == 1.0)
    assert np.all(np.diff(x[:20, 0]) > 0)


def test_fades_longer_than_the_signal_are_refused():
    with pytest.raises(ValueError, match="do not fit into 10"):
        apply_fades(np.ones(10), 6, 6)


def test_a_sine_starts_at_zero_and_repeats():
    x = make_sine(25.0, 2.0, 80, RATE_HZ)
    assert x[0] == 0.0
    assert x[:40] == pytest.approx(x[40:])
    assert x.max() == pytest.approx(2.0)
