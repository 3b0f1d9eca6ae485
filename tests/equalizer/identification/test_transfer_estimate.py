"""Recovery of a known truth from sweeps, multisines and noise, in open and closed loop."""


import numpy as np

from equalizer.identification.transfer_estimate import transfer_estimate
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal

RATE = 1000.0
FORCES, ACCELERATIONS = ("fx", "fy", "fz"), ("ax", "ay", "az")


def recording_of(command, response, segments, excitation=None, meta=None) -> Recording:
    def forces(samples):
        return Signal(samples, RATE, "force", "N", FORCES[: samples.shape[1]])

    accelerations = Signal(response, RATE, "acceleration", "m/s^2", ACCELERATIONS[: response.shape[1]])
    excited = None if excitation is None else forces(excitation)
    return Recording("synthetic", forces(command), accelerations, None, excited, segments=segments, meta=meta or {})


def axis_by_axis(plants, waves, seed=0, periods=2, noise=1.0, kind="sweep") -> Recording:
    """waves: one (n,) or three (n, 3) periods, one after the other, a second of rest before each."""
    plant, rest = plants.omega_like(), 1000
    command, segments = np.zeros((0, 3)), []
    for wave in waves:
        start = len(command) + rest
        command = np.vstack([command, np.zeros((rest, 3)), np.tile(wave, (periods, 1))])
        segments.append(Segment(start, len(command), kind, 1.0, len(wave)))
    command = np.vstack([command, np.zeros((rest, 3))])
    sensor = np.random.default_rng(seed).standard_normal(command.shape) * plants.SENSOR_RMS * noise
    return recording_of(command, plant.play(command) + sensor, tuple(segments))


def sweeps(plants, low_hz, high_hz, seconds, **options) -> Recording:
    wave = plants.sweep(low_hz, high_hz, seconds)
    return axis_by_axis(plants, [wave[:, None] * axis for axis in np.eye(3)], **options)


def errors(estimate, truth, low_hz=5.0, high_hz=35.0):
    """Relative error by line, in the norm of matrices."""
    band = estimate.within(low_hz, high_hz)
    true = truth.response(band.frequency_hz)
    return np.linalg.norm(band.response - true, axis=(1, 2)) / np.linalg.norm(true, axis=(1, 2))


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.abs(values) ** 2)))


def test_without_noise_the_truth_comes_out(plants):
    estimate = transfer_estimate((sweeps(plants, 4.5, 37.0, 6.0, noise=0.0),))
    assert errors(estimate, plants.omega_like()).max() < 1e-6
    assert (estimate.input_channels, estimate.output_channels) == (FORCES, ACCELERATIONS)
    assert (estimate.input_unit, estimate.output_unit) == ("N", "m/s^2")


def test_the_sweeps_of_the_notes_reach_one_percent(plants):
    estimate = transfer_estimate((sweeps(plants, 4.5, 37.0, 30.0),))
    found = errors(estimate, plants.omega_like())
    assert 0.005 < rms(found) < 0.012
    assert found.max() < 0.035
