"""Recordings of the synthetic device, played from `tests/plants.py`."""

import numpy as np

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal

RATE = 1000.0
REST = 1500
FORCES, ACCELERATIONS = ("fx", "fy", "fz"), ("ax", "ay", "az")


def recording_of(command, response, segments=(), excitation=None, meta=None) -> Recording:
    def forces(samples):
        return Signal(samples, RATE, "force", "N", FORCES[: samples.shape[1]])

    accelerations = Signal(response, RATE, "acceleration", "m/s^2", ACCELERATIONS[: response.shape[1]])
    excited = None if excitation is None else forces(excitation)
    return Recording("synthetic", forces(command), accelerations, None, excited, segments=segments, meta=meta or {})


def one_after_another(waves, periods=2, kind="sweep"):
    """waves: one (n, 3) period per experiment. Returns commands (N, 3) and segments."""
    command, segments = np.zeros((REST, 3)), []
    for wave in waves:
        stop = len(command) + periods * len(wave)
        segments.append(Segment(len(command), stop, kind, float(np.abs(wave).max()), len(wave)))
        command = np.vstack([command, np.tile(wave, (periods, 1)), np.zeros((REST, 3))])
    return command, tuple(segments)


def played(plants, waves, seed=0, periods=2, noise=1.0, kind="sweep") -> Recording:
    command, segments = one_after_another(waves, periods, kind)
    sensor = np.random.default_rng(seed).standard_normal(command.shape) * plants.SENSOR_RMS * noise
    return recording_of(command, plants.omega_like().play(command) + sensor, segments)


def axes(wave) -> list:
    """The wave (n,) along each axis in turn."""
    return [wave[:, None] * axis for axis in np.eye(3)]


def sweeps(plants, low_hz, high_hz, seconds, seed=0, periods=2, noise=1.0) -> Recording:
    return played(plants, axes(plants.sweep(low_hz, high_hz, seconds)), seed, periods, noise)


def under_a_spring(plants, waves, stiffness, seed=0, periods=2, noise=1.0) -> Recording:
    """Each axis' double integral of its noisy reading is held by a spring: noise enters the command, too."""
    excitation, segments = one_after_another(waves, periods)
    plant, generator = plants.omega_like(), np.random.default_rng(seed)
    x, speed, place = np.zeros(len(plant.A)), np.zeros(3), np.zeros(3)
    command, response = np.zeros_like(excitation), np.zeros_like(excitation)
    sensor = generator.standard_normal(excitation.shape) * plants.SENSOR_RMS * noise
    for k in range(len(excitation)):
        response[k] = plant.C @ x + sensor[k]
        # Leaky, or a constant would be integrated without end.
        speed = 0.99 * speed + response[k] / RATE
        place = 0.99 * place + speed / RATE
        command[k] = excitation[k] - stiffness * place
        x = plant.A @ x + plant.B @ command[k]
    meta = {"feedback": {"natural_frequency_hz": 3.5}}
    return recording_of(command, response, segments, excitation, meta)


def errors(estimate, truth, low_hz=5.0, high_hz=35.0):
    """Relative error by line, in the norm of matrices."""
    band = estimate.select_band(low_hz, high_hz)
    true = truth.response(band.frequency_hz)
    return np.linalg.norm(band.response - true, axis=(1, 2)) / np.linalg.norm(true, axis=(1, 2))


def rms_error(estimate, truth, low_hz=5.0, high_hz=35.0) -> float:
    """As in the notes: power of all errors over power of all entries."""
    band = estimate.select_band(low_hz, high_hz)
    true = truth.response(band.frequency_hz)
    return float(np.linalg.norm(band.response - true) / np.linalg.norm(true))
