"""A resonance that rings longer than the ordinary bound keeps its height where local averages are fitted."""

from dataclasses import replace

import numpy as np

from equalizer.identification.state_space.identify_recordings import identify_recordings
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.plant.model_response import compute_model_response

BOUND_BY_HAND = IdentificationSettings(
    order=12, longest_decay_s=10.0, draws=0, longer_horizons=(0,), record_horizons=()
)
LINES = np.linspace(5, 35, 3001)


def test_local_averages_under_a_long_bound_do_not_blunt_what_rings(plants, synthetic):
    rigid = [(3.5, 1.4, axis / np.sqrt(plants.MASS_KG)) for axis in np.eye(3)]
    device = plants._sampled([*rigid, (12.0, 0.005, np.array([0.5, 0.4, 0.3]))])
    commands, segments = synthetic.one_after_another(synthetic.axes(plants.sweep(4.5, 37.0, 8.0)), 3)
    recording = synthetic.recording_of(commands, device.measured(commands, 1), segments)
    found = identify_recordings(recording, BOUND_BY_HAND, smooth=True)
    assert found.fitted is not found.estimate
    truth = device.response(LINES)
    error = compute_model_response(found.identified.model, LINES) - truth
    assert np.linalg.norm(error) < 0.01 * np.linalg.norm(truth)


def test_a_single_short_period_states_no_error(plants, synthetic):
    """The model fits the transient as closely as the device: the true error is several times the misfit."""
    settings = IdentificationSettings(order=8, draws=3, longer_horizons=(0,), record_horizons=())
    found = identify_recordings(synthetic.sweeps(plants, 4.5, 37.0, 2.0, periods=1), settings, smooth=False)
    assert found.identified.misfit.upper_bound is None
    assert found.identified.expected_error is None
    assert ("expected error", "not known") in found.identified.summary().rows


def test_the_expected_error_of_local_averages_is_that_on_the_lines_themselves(plants, synthetic):
    """An order that is too low: the averages, too, are smooth, and the model may fit them closely."""
    settings = IdentificationSettings(order=8, draws=3, longer_horizons=(0,), record_horizons=())
    found = identify_recordings(synthetic.sweeps(plants, 4.5, 37.0, 5.0, periods=3), settings)
    assert found.fitted is not found.estimate
    truth = plants.omega_like().response(LINES)
    error = np.linalg.norm(compute_model_response(found.identified.model, LINES) - truth) / np.linalg.norm(truth)
    identified = found.identified
    assert error < 1.02 * identified.expected_error
    assert identified.expected_error == np.hypot(identified.scatter, identified.misfit.upper_bound)


def test_a_device_may_have_units_of_their_own_along_each_axis(plants, synthetic):
    """A force and a torque; the results are printed as a few lines."""
    recording = synthetic.sweeps(plants, 4.5, 37.0, 2.0, periods=3)
    mixed = replace(
        recording,
        command=replace(recording.command, unit=("N", "N", "N m")),
        response=replace(recording.response, unit=("m/s^2", "m/s^2", "rad/s^2")),
    )
    settings = IdentificationSettings(order=6, draws=0, longer_horizons=(0,), record_horizons=())
    found = identify_recordings(mixed, settings, smooth=False)
    assert found.identified.model.input_unit == ("N", "N", "N m")
    assert found.identified.model.output_unit == ("m/s^2", "m/s^2", "rad/s^2")
    assert len(repr(found).splitlines()) < 20


def test_spikes_of_a_velocity_are_replaced_and_reported(plants, synthetic):
    settings = IdentificationSettings(order=6, draws=0, longer_horizons=(0,), record_horizons=())
    recording = synthetic.sweeps(plants, 4.5, 37.0, 3.0, periods=2)
    velocity = replace(recording.response, quantity="velocity", unit="m/s", channels=("vx", "vy", "vz"))
    spiked = velocity.samples.copy()
    spiked[2000::1500, 0] += 20 * velocity.samples[:, 0].std()
    clean, found = (
        identify_recordings(replace(recording, response=replace(velocity, samples=samples)), settings, smooth=False)
        for samples in (velocity.samples, spiked)
    )
    (remark,) = set(found.identified.remarks) - set(clean.identified.remarks)
    assert f"replaced by interpolated values: {len(spiked[2000::1500])} of vx" in remark
    responses = [compute_model_response(each.identified.model, LINES) for each in (clean, found)]
    assert np.linalg.norm(responses[1] - responses[0]) < 1e-3 * np.linalg.norm(responses[0])
