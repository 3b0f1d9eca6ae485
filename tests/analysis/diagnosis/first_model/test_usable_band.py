"""A first model where noise hides the motion outside a band that the recording states."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.input_checks import NothingToDiagnoseError
from analysis.diagnosis.first_model.fit_without_model import fit_first_linear_model
from equalizer.effects.simulation.simulator import simulate_response
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold, Recording, Segment
from equalizer.signals.signal import Signal

RATE_HZ, SAMPLES = 1000.0, 8000


@pytest.fixture(scope="module")
def recording():
    """White force on a body, and an accelerometer with strong slow noise, below 20 Hz."""
    rng = np.random.default_rng(470)
    device = MechanicalModel(
        "device", "acceleration", *(np.array([[value]]) for value in (0.2, 3.0, 8000.0)), np.eye(1), np.eye(1)
    )
    command = rng.choice([-1.0, 1.0], (SAMPLES, 1))
    response = simulate_response(device, command, RATE_HZ, (), Hold.ZERO_ORDER).response
    lines = np.fft.rfftfreq(SAMPLES, 1 / RATE_HZ)
    noise = np.fft.irfft((lines < 20) * np.fft.rfft(rng.standard_normal(SAMPLES)), SAMPLES)
    response = response + 3 * response.std() * (noise / noise.std())[:, None]
    return Recording(
        "a body",
        Signal(command, RATE_HZ, "force", "N", ("x",)), Signal(response, RATE_HZ, "acceleration", "m/s^2", ("x",)),
        segments=(Segment(0, SAMPLES, "binary", 1.0, 0, ""),),
    )  # fmt: skip


def test_the_model_is_fitted_in_the_stated_band(recording):
    model, _ = fit_first_linear_model([replace(recording, meta={"band_hz": [30.0, 400.0]})], lambda share: None)
    assert model.mass[0, 0] == pytest.approx(0.2, rel=0.05)
    assert model.stiffness[0, 0] == pytest.approx(8000.0, rel=0.1)


@pytest.mark.parametrize("band", [[400.0, 30.0], [30.0], "30 to 400", ["30", "400"], [-1.0, 30.0]])
def test_a_band_that_is_none_is_refused(recording, band):
    with pytest.raises(NothingToDiagnoseError, match="two frequencies in Hz, the lower one first"):
        fit_first_linear_model([replace(recording, meta={"band_hz": band})], lambda share: None)


def test_bands_without_a_common_part_are_refused(recording):
    recordings = [replace(recording, meta={"band_hz": band}) for band in ([5.0, 20.0], [30.0, 400.0])]
    with pytest.raises(NothingToDiagnoseError, match="have no common part; diagnose them separately"):
        fit_first_linear_model(recordings, lambda share: None)
