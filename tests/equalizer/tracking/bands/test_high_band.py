import numpy as np
import pytest

from equalizer.plant.model_response import compute_model_response
from equalizer.tracking.bands.high_band import (
    HighBandSettings,
    MeasuredResponse,
    ModelledResponse,
    compute_high_band_forces,
    compute_minimum_phase,
    predict_acceleration,
    project_to_one_dof,
    reduce_to_one_dof,
)

RATE_HZ = 1000.0
LINES_HZ = np.fft.rfftfreq(4096, 1 / RATE_HZ)


@pytest.fixture(scope="module")
def source(device_model):
    return ModelledResponse(device_model)


@pytest.fixture(scope="module")
def burst():
    """(4096,): 60 to 300 Hz, in the middle second."""
    spectrum = np.exp(2j * np.pi * np.random.default_rng(1).random(len(LINES_HZ)))
    wave = np.fft.irfft(spectrum * ((LINES_HZ >= 60) & (LINES_HZ <= 300)), 4096)
    return np.pad(5 * wave[1500:2500] * np.hanning(1000) / wave.std(), (1500, 1596))


def levels(samples):
    return np.linalg.norm(np.fft.rfft(samples.reshape(len(samples), -1), axis=0), axis=1)


def test_one_degree_of_freedom_keeps_the_energy_of_every_line():
    wanted = np.random.default_rng(2).standard_normal((1000, 3))
    assert levels(reduce_to_one_dof(wanted)) == pytest.approx(levels(wanted), rel=1e-9)
    opposed = np.column_stack([wanted[:, 0], -wanted[:, 0], np.zeros(1000)])
    assert levels(reduce_to_one_dof(opposed)) == pytest.approx(levels(opposed), rel=1e-6)


def test_one_degree_of_freedom_at_once_keeps_energy_and_onset():
    wanted = np.random.default_rng(2).standard_normal((1000, 3))
    wanted[:400] = 0
    signal = project_to_one_dof(wanted)
    assert np.linalg.norm(signal) == pytest.approx(np.linalg.norm(wanted))
    assert not signal[:400].any()
    assert not project_to_one_dof(np.zeros((10, 3))).any()


@pytest.mark.parametrize("shared", [True, False])
def test_the_device_vibrates_as_strongly_as_wanted_at_every_line(plants, source, burst, shared):
    forces = compute_high_band_forces(
        burst, RATE_HZ, source, settings=HighBandSettings(oblique_directions=shared)
    ).forces
    played, wanted = levels(plants.omega_like().play(forces)), levels(burst)
    strong = wanted > 0.05 * wanted.max()
    assert np.abs(20 * np.log10(played / wanted)[strong]).max() < 1.0


def test_from_a_contact_on_no_force_comes_early_and_the_level_is_matched(plants, source, burst):
    found = compute_high_band_forces(burst, RATE_HZ, source, settings=HighBandSettings(causal=True))
    assert np.abs(found.forces[:1490]).max() < 1e-6 * np.abs(found.forces).max()
    played, wanted = levels(plants.omega_like().play(found.forces)), levels(burst)
    strong = wanted > 0.05 * wanted.max()
    assert np.abs(20 * np.log10(played / wanted)[strong]).max() < 1.0


def test_the_direction_with_the_least_peak_force_is_taken(source, burst):
    single = compute_high_band_forces(burst, RATE_HZ, source, settings=HighBandSettings(oblique_directions=False))
    shared = compute_high_band_forces(burst, RATE_HZ, source)
    assert single.peak_n == single.peak_by_axis_n.min() < 0.8 * single.peak_by_axis_n.max()
    assert shared.peak_n < single.peak_n
    assert np.linalg.norm(shared.direction) == pytest.approx(1)


def test_an_axis_that_is_near_its_limit_is_spared(source, burst):
    alone = compute_high_band_forces(burst, RATE_HZ, source, settings=HighBandSettings(oblique_directions=False))
    busy = int(np.abs(alone.direction).argmax())
    others = np.zeros((len(burst), 3))
    others[:, busy] = 4 * alone.peak_n
    beside = compute_high_band_forces(burst, RATE_HZ, source, others, HighBandSettings(oblique_directions=False))
    assert int(np.abs(beside.direction).argmax()) != busy
    assert beside.peak_n < np.linalg.norm(alone.forces + others, axis=1).max()
    assert beside.peak_n == pytest.approx(np.linalg.norm(beside.forces + others, axis=1).max())


def test_a_response_measured_at_lines_serves_like_a_model(device_model, source, burst):
    lines = np.arange(1.0, 500.0, 0.25)
    measured = MeasuredResponse(lines, compute_model_response(device_model, lines))
    by_lines = compute_high_band_forces(
        burst, RATE_HZ, measured, settings=HighBandSettings(oblique_directions=False)
    ).forces
    by_model = compute_high_band_forces(
        burst, RATE_HZ, source, settings=HighBandSettings(oblique_directions=False)
    ).forces
    assert np.linalg.norm(by_lines - by_model) < 0.02 * np.linalg.norm(by_model)


def test_what_is_delivered_is_what_the_device_plays(plants, source, burst):
    forces = compute_high_band_forces(burst, RATE_HZ, source).forces
    played = plants.omega_like().play(forces)
    assert np.linalg.norm(predict_acceleration(forces, RATE_HZ, source) - played) < 1e-6 * np.linalg.norm(played)


def test_minimum_phase_keeps_the_gain_and_is_causal():
    gain = 1 / (0.1 + np.abs(1 - 0.9 * np.exp(-2j * np.pi * LINES_HZ / RATE_HZ)))
    response = compute_minimum_phase(gain)
    assert np.abs(response) == pytest.approx(gain, rel=1e-9)
    impulse = np.fft.irfft(response, 4096)
    assert np.abs(impulse[2048:]).max() < 1e-6 * np.abs(impulse).max()


def test_from_a_contact_on_a_device_that_gives_nothing_at_0_hz_is_played(burst):
    lines = np.arange(0.0, 500.5, 0.5)
    turning = 2 * np.pi * lines
    gain = -(turning**2) / (200 + 3j * turning - 0.3 * turning**2)
    measured = MeasuredResponse(lines, gain[:, None, None] * np.eye(3))
    found = compute_high_band_forces(burst, RATE_HZ, measured, settings=HighBandSettings(causal=True))
    played = predict_acceleration(found.forces, RATE_HZ, measured)
    assert np.linalg.norm(played) == pytest.approx(np.linalg.norm(burst), rel=0.01)


@pytest.mark.parametrize("weight", [1e-4, 0.1])
def test_a_weight_that_inverts_noise_or_loses_level_is_refused(weight):
    with pytest.raises(ValueError, match=r"weight is .*; it must be within 0\.001 and 0\.01"):
        HighBandSettings(weight)
