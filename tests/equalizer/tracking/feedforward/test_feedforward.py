"""A table of wanted accelerations through one model, played on the device it was made of."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.feedforward import FeedforwardSettings, compute_feedforward_forces
from equalizer.tracking.lqr.limits import ForceLimitError
from equalizer.tracking.lqr.padding import compute_band_error
from equalizer.tracking.lqr.tracking_problem import TrackingError

RATE_HZ, BAND_HZ = 1000.0, (5.0, 35.0)


@pytest.fixture(scope="module")
def plant(plants):
    return plants.omega_like()


@pytest.fixture(scope="module")
def model(plant):
    channels = ("fx", "fy", "fz"), ("ax", "ay", "az")
    return IdentifiedModel(plant.A, plant.B, plant.C, np.zeros((3, 3)), RATE_HZ, BAND_HZ, "N", "m/s^2", *channels)


@pytest.fixture(scope="module")
def noise(plants):
    """2 s of 5 to 35 Hz on all axes, from rest to rest."""
    samples = plants.multisine(5.0, 35.0, seconds=2.0, rms=1.0)
    return acceleration(samples * np.sin(np.pi * np.arange(2000) / 2000)[:, None] ** 2)


def acceleration(samples) -> Signal:
    return Signal(samples, RATE_HZ, "acceleration", "m/s^2", ("ax", "ay", "az"))


def test_what_is_wanted_in_the_band_is_what_the_device_does(model, plant, noise):
    found = compute_feedforward_forces(model, noise)
    assert found.forces.samples.shape == (2000, 3)
    played = plant.play(found.forces.samples)
    assert compute_band_error(noise.samples, played, RATE_HZ, BAND_HZ) < 0.01
    assert found.error < 0.01
    assert found.out_of_band_share < 0.03


def test_what_lies_outside_the_band_is_left_out_and_said(model, plant, noise):
    """A whistle at 84 Hz, where the device is loudest, changes nothing within the band and is not played."""
    t = np.arange(2000) / RATE_HZ
    whistle = replace(noise, samples=noise.samples + 0.5 * np.sin(2 * np.pi * 84.0 * t)[:, None])
    found, without = compute_feedforward_forces(model, whistle), compute_feedforward_forces(model, noise)
    assert found.out_of_band_share > 0.3
    assert np.abs(found.forces.samples - without.forces.samples).max() < 0.02
    assert compute_band_error(noise.samples, plant.play(found.forces.samples), RATE_HZ, BAND_HZ) < 0.02


def test_forces_above_the_cap_are_refused_with_the_factor_that_fits(model, noise):
    loud = replace(noise, samples=8.0 * noise.samples)
    with pytest.raises(ForceLimitError, match="above the cap of 3 N") as refusal:
        compute_feedforward_forces(model, loud)
    factor = refusal.value.peaks.largest_scale
    assert compute_feedforward_forces(model, replace(loud, samples=0.999 * factor * loud.samples)).peaks.is_under_cap


@pytest.mark.slow
def test_forces_above_the_cap_are_solved_under_it_with_the_loss_stated(model, noise):
    loud = replace(noise, samples=2.0 * noise.samples[600:1400])
    peak_n = compute_feedforward_forces(model, loud, FeedforwardSettings(cap_n=50.0)).peaks.peak_n
    capped = compute_feedforward_forces(model, loud, FeedforwardSettings(cap_n=0.8 * peak_n, constrain=True))
    assert np.linalg.norm(capped.forces.samples, axis=1).max() <= 0.8 * peak_n
    assert 0 < capped.loss.lost < capped.loss.error_clipped


def test_an_unstable_model_is_refused(model, noise):
    """Its predicted response overflowed, and forces were returned all the same."""
    unstable = replace(model, A=1.05 / model.spectral_radius * model.A)
    with pytest.raises(TrackingError, match=r"the model is not stable \(spectral radius 1.05\)"):
        compute_feedforward_forces(unstable, noise)


def test_a_table_with_nothing_in_the_band_is_refused(model):
    with pytest.raises(TrackingError, match="the reference has no content from 5 to 35 Hz"):
        compute_feedforward_forces(model, acceleration(np.zeros((500, 3))))


def test_a_table_with_gaps_is_refused_as_such(model, noise):
    samples = noise.samples.copy()
    samples[700, 1] = np.nan
    with pytest.raises(TrackingError, match="the trajectory holds values that are not finite numbers; fill the gaps"):
        compute_feedforward_forces(model, acceleration(samples))


def test_channels_in_another_order_are_refused(model, noise):
    turned = replace(noise, channels=model.output_channels[::-1])
    with pytest.raises(ValueError, match="put them in the same order"):
        compute_feedforward_forces(model, turned)


def test_units_are_compared_channel_by_channel(model, noise):
    units = ("m/s^2", "m/s^2", "rad/s^2")
    with pytest.raises(ValueError, match=r"answers in m/s\^2, m/s\^2, rad/s\^2, but the reference is in rad/s\^2, m/s"):
        compute_feedforward_forces(replace(model, output_unit=units), replace(noise, unit=units[::-1]))


@pytest.mark.parametrize("unit", ["A", "N m", ("N", "N", "N m")])
def test_commands_that_are_no_forces_in_newtons_are_refused(model, noise, unit):
    """Amperes would else be stated as newtons, and compared with the cap in newtons."""
    with pytest.raises(ValueError, match="but forces and their cap are in N"):
        compute_feedforward_forces(replace(model, input_unit=unit), noise)


def test_a_rate_that_differs_in_the_last_digits_is_refused_by_all_its_digits(model, noise):
    with pytest.raises(ValueError, match=r"runs at 1000 Hz, not at 1000\.000001 Hz"):
        compute_feedforward_forces(model, replace(noise, sample_rate_hz=RATE_HZ + 1e-6))
