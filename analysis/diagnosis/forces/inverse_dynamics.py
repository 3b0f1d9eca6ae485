"""Inverse dynamics: the force u that a linear model needs for a measured motion y, computed in the frequency domain.

    M q'' + D q' + K q = B u,    y = C q        below the end of the band, by a zero-phase low pass

Where every coordinate is measured, q follows from y and the derivatives suffice; else the frequency response from y to
u is used (`inverse_response`). The straight line between the first and the last sample, which a Fourier transform
cannot represent, is treated by itself in steady state.
"""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.forces.inverse_response import fast_inverse_response, inverse_response
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.band_limited import end_to_end_line, filter_by_gain, low_pass_gain
from equalizer.signals.signal import ComplexArray, FloatArray

_NEARLY_STILL_HZ = 1e-6
"""Frequency (Hz) at which the derivative of the inverse response at 0 Hz is computed."""


@dataclass(frozen=True, slots=True, eq=False)
class RequiredForce:
    """Required force, N (N m), and motion of the driven axes within a band, SI; each (n, m)."""

    force: FloatArray
    axis_position: FloatArray
    axis_velocity: FloatArray
    axis_acceleration: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class BandMotion:
    """A measured motion and its derivatives within a band, from which every model's force is computed."""

    position: FloatArray
    """(n, m): positions of the model's first m outputs, as measured, finite."""
    sample_rate_hz: float
    band_hz: float
    """Frequency at which the low pass has a gain of 1/2."""
    at_samples: tuple[FloatArray, FloatArray, FloatArray]
    """(n, m) each: position, velocity and acceleration at each sample."""
    around_samples: tuple[FloatArray, FloatArray, FloatArray]
    """(n, m) each: their means over one sample period around each sample."""


def band_motion(position: FloatArray, sample_rate_hz: float, band_hz: float) -> BandMotion:
    """Position, velocity and acceleration below `band_hz`, at the samples and as means about them. position: (n, m),
    finite."""
    m = position.shape[1]

    def gain(frequency_hz: FloatArray) -> ComplexArray:
        wave = 2j * np.pi * frequency_hz
        mean = np.sinc(frequency_hz / sample_rate_hz)
        rows = [shape * wave**order for shape in (1.0, mean) for order in range(3)]
        band_gain = low_pass_gain(frequency_hz, band_hz) * np.array(rows)
        return np.asarray(np.einsum("rl,ij->lrij", band_gain, np.eye(m)).reshape(len(frequency_hz), 6 * m, m))

    filtered = filter_by_gain(position, sample_rate_hz, gain).reshape(len(position), 6, m)
    slope = (position[-1] - position[0]) / max(len(position) - 1, 1) * sample_rate_hz
    filtered[:, [0, 3]] += end_to_end_line(position)[:, None]
    filtered[:, [1, 4]] += slope
    x, v, a, mean_x, mean_v, mean_a = (np.ascontiguousarray(filtered[:, k]) for k in range(6))
    return BandMotion(position, sample_rate_hz, band_hz, (x, v, a), (mean_x, mean_v, mean_a))


def compute_required_force(model: MechanicalModel, motion: BandMotion) -> RequiredForce:
    """Required force, mean over one sample period around each sample, and motion of the axes at the samples. Actuator,
    sensor and effects are not included. Raises numpy.linalg.LinAlgError where the first m outputs do not determine the
    model's motion."""
    if model.coordinates == model.inputs:
        return _force_of_square_model(model, motion)
    position, sample_rate_hz = motion.position, motion.sample_rate_hz
    m, inverse_at = model.inputs, fast_inverse_response(model, len(position), sample_rate_hz / 2)

    def gain(frequency_hz: FloatArray) -> ComplexArray:
        band_gain = low_pass_gain(frequency_hz, motion.band_hz)[:, None, None]
        inverse = inverse_at(frequency_hz)
        inverse[:, :m] *= np.sinc(frequency_hz / sample_rate_hz)[:, None, None]
        wave = 2j * np.pi * frequency_hz[:, None, None]
        axes = inverse[:, m:]
        return np.asarray(band_gain * np.concatenate([inverse[:, :m], axes, wave * axes, wave**2 * axes], axis=1))

    filtered = filter_by_gain(position, sample_rate_hz, gain) + _force_along_line(model, position, sample_rate_hz)
    return RequiredForce(*(filtered[:, part * m : (part + 1) * m] for part in range(4)))


def _force_of_square_model(model: MechanicalModel, motion: BandMotion) -> RequiredForce:
    """Required force of a model whose every coordinate is measured: the derivatives suffice, without another Fourier
    transform."""
    to_coordinates = np.linalg.inv(model.output[: model.inputs])
    to_commands = np.linalg.inv(model.input)
    matrices = model.stiffness, model.damping, model.mass
    force = sum(
        (
            derivative @ (to_commands @ matrix @ to_coordinates).T
            for derivative, matrix in zip(motion.around_samples, matrices, strict=True)
        ),
        np.zeros_like(motion.position),
    )
    to_axes = (driven_axes(model).T @ to_coordinates).T
    return RequiredForce(force, *(derivative @ to_axes for derivative in motion.at_samples))


def _force_along_line(model: MechanicalModel, position: FloatArray, sample_rate_hz: float) -> FloatArray:
    """(n, 4 m): required force, position, velocity and acceleration of the axes for the straight line between first and
    last position, in steady state: y of constant slope needs the force G(0) y + G'(0) y' with the inverse response
    G."""
    m = model.inputs
    line = end_to_end_line(position)
    slope = (position[-1] - position[0]) / max(len(position) - 1, 1) * sample_rate_hz
    near_static = inverse_response(model, np.array([0.0, _NEARLY_STILL_HZ]))
    static, rate = near_static[0].real, near_static[1].imag / (2 * np.pi * _NEARLY_STILL_HZ)
    force_and_position = line @ static.T + slope @ rate.T
    velocity = np.broadcast_to(slope @ static[m:].T, (len(line), m))
    return np.hstack([force_and_position, velocity, np.zeros((len(line), m))])
