import numpy as np
import pytest

from equalizer.tracking.bands.stylus import StylusActuator, share_with_stylus

RATE_HZ = 1000.0
LINES_HZ = np.arange(80.0, 400.0, 2.0)


def actuator(limit=100.0):
    resonance = 30 / (1 - (LINES_HZ / 150) ** 2 + 0.2j * LINES_HZ / 150)
    return StylusActuator(LINES_HZ, resonance, 120.0, limit)


def tone(frequency_hz):
    return np.sin(2 * np.pi * frequency_hz * np.arange(4000) / RATE_HZ) * np.hanning(4000)


@pytest.mark.parametrize(("frequency_hz", "taken"), [(60.0, 0.0), (120.0, 0.5), (250.0, 1.0), (450.0, 0.0)])
def test_the_stylus_takes_what_lies_above_its_edge_and_within_what_is_known_of_it(frequency_hz, taken):
    wanted = tone(frequency_hz)
    share = share_with_stylus(wanted, RATE_HZ, actuator())
    assert np.abs(share.motors + share.actuator_share - wanted).max() < 1e-12
    assert np.linalg.norm(share.actuator_share) / np.linalg.norm(wanted) == pytest.approx(taken, abs=5e-3)
    assert np.linalg.norm(share.predicted - share.actuator_share) < 0.01 * np.linalg.norm(wanted)


def test_a_stylus_at_its_limit_leaves_the_rest_to_the_motors():
    wanted, limit = tone(250.0), 0.02
    share = share_with_stylus(wanted, RATE_HZ, actuator(limit))
    assert np.abs(share.command).max() <= limit * (1 + 1e-12)
    assert np.linalg.norm(share.motors) > 0.1 * np.linalg.norm(wanted)
    assert np.abs(share.motors + share.actuator_share - wanted).max() < 1e-12


def test_an_actuator_that_cannot_be_is_refused():
    with pytest.raises(ValueError, match=r"response has shape \(2,\), but there are 160 frequencies"):
        StylusActuator(LINES_HZ, np.ones(2, complex), 120.0, 1.0)
    with pytest.raises(ValueError, match=r"limit is 0\.0; it must be a positive number"):
        actuator(0.0)
