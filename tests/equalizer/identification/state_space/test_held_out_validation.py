"""Prediction of what was kept for a test."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.state_space.held_out_validation import validate_on_test
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal

CHANNELS = ("fx", "fy", "fz"), ("ax", "ay", "az")


@pytest.fixture(scope="module")
def truth(plants):
    plant = plants.omega_like()
    return IdentifiedModel(plant.A, plant.B, plant.C, np.zeros((3, 3)), 1000.0, (5.0, 35.0), "N", "m/s^2", *CHANNELS)


def recorded(plants, periods: int, period: int, seed: int = 3, role: str = "test") -> Recording:
    wave = np.tile(plants.multisine(5.0, 35.0, seconds=4.0), (periods, 1))
    measured = plants.omega_like().measured(wave, seed)
    segment = Segment(0, len(wave), "multisine", 1.0, period, role)
    command = Signal(wave, 1000.0, "force", "N", CHANNELS[0])
    return Recording(
        "bench", command, Signal(measured, 1000.0, "acceleration", "m/s^2", CHANNELS[1]), segments=(segment,)
    )


def test_the_truth_errs_by_the_noise_and_no_more(plants, truth):
    found = validate_on_test(truth, [recorded(plants, periods=3, period=4000)])
    assert found.seconds == 4.0
    assert found.error == pytest.approx(found.noise, rel=0.15)
    assert found.error < 0.02


def test_a_wrong_gain_is_seen_as_what_it_is(plants, truth):
    wrong = replace(truth, C=1.1 * truth.C)
    assert validate_on_test(wrong, [recorded(plants, periods=3, period=4000)]).error == pytest.approx(0.1, abs=0.005)


def test_what_is_not_periodic_is_compared_whole_and_tells_no_noise(plants, truth):
    found = validate_on_test(truth, [recorded(plants, periods=1, period=0)])
    assert found.noise is None
    assert found.error < 0.03


def test_without_a_test_segment_there_is_nothing_to_say(plants, truth):
    assert validate_on_test(truth, [recorded(plants, periods=2, period=4000, role="fit")]) is None


def test_missing_samples_and_other_devices_are_refused(plants, truth):
    good = recorded(plants, periods=2, period=4000)
    holes = good.response.samples.copy()
    holes[5000] = np.nan
    with pytest.raises(ValueError, match="missing values"):
        validate_on_test(truth, [replace(good, response=replace(good.response, samples=holes))])
    with pytest.raises(ValueError, match="cannot test a model at 500"):
        validate_on_test(replace(truth, sample_rate_hz=500.0), [good])


def test_a_response_of_zero_is_refused(plants, truth):
    good = recorded(plants, periods=3, period=4000)
    still = replace(good, response=replace(good.response, samples=np.zeros_like(good.response.samples)))
    with pytest.raises(ValueError, match="no response between 5 and 35 Hz"):
        validate_on_test(truth, [still])
