"""Inverse dynamics: the force u that a linear model needs for a measured motion y, computed in the frequency domain.

    M q'' + D q' + K q = B u,    y = C q        below the end of the band, by a zero-phase low pass

With as many coordinates as commands, q follows from y and the derivatives suffice; else the frequency response from y
to u is used (`compute_inverse_response`). The straight line between the first and the last sample, which a Fourier
transform cannot represent, is treated by itself in steady state.
"""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.forces.inverse_response import compute_inverse_response, make_fast_inverse_response
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.band_limited import compute_end_to_end_line, compute_low_pass_gain, filter_by_gain
from equalizer.signals.signal import ComplexArray, FloatArray

_NEAR_STATIC_HZ = 1e-6
"""Frequency (Hz) by which the derivative of the inverse response at 0 Hz is computed as a finite difference. Chosen
by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class RequiredForce:
    """Required force, and motion of the driven axes within a band; each (n, m)."""

    force: FloatArray
    """N (N m), as commands: means over one sample period around each sample."""
    axis_position: FloatArray
    """m (rad), at the samples."""
    axis_velocity: FloatArray
    """m/s (rad/s), at the samples."""
    axis_acceleration: FloatArray
    """m/s² (rad/s²), at the samples."""


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


def compute_band_motion(position: FloatArray, sample_rate_hz: float, band_hz: float) -> BandMotion:
    """Compute position, velocity and acceleration below `band_hz` (Hz), at the samples and as means over one sample
    period around them. position: (n, m), finite."""
    m = position.shape[1]

    def compute_gain(frequency_hz: FloatArray) -> ComplexArray:
        """Compute (lines, 6 m, m): low pass times derivative of order 0 to 2, at the samples, then averaged over a
        sample period."""
        derivative_factor = 2j * np.pi * frequency_hz
        averaging_gain = np.sinc(frequency_hz / sample_rate_hz)
        gains = [window_gain * derivative_factor**order for window_gain in (1.0, averaging_gain) for order in range(3)]
        band_gain = compute_low_pass_gain(frequency_hz, band_hz) * np.array(gains)
        return np.asarray(np.einsum("rl,ij->lrij", band_gain, np.eye(m)).reshape(len(frequency_hz), 6 * m, m))

    filtered = filter_by_gain(position, sample_rate_hz, compute_gain).reshape(len(position), 6, m)
    slope = (position[-1] - position[0]) / max(len(position) - 1, 1) * sample_rate_hz
    filtered[:, [0, 3]] += compute_end_to_end_line(position)[:, None]
    filtered[:, [1, 4]] += slope
    x, v, a, mean_x, mean_v, mean_a = (np.ascontiguousarray(filtered[:, k]) for k in range(6))
    return BandMotion(position, sample_rate_hz, band_hz, (x, v, a), (mean_x, mean_v, mean_a))


def compute_required_force(model: MechanicalModel, motion: BandMotion) -> RequiredForce:
    """Compute the required force and the motion of the axes. Actuator, sensor and effects are not included. Raises
    numpy.linalg.LinAlgError where the first m outputs do not determine the model's motion."""
    if model.coordinates == model.inputs:
        return _compute_square_model_force(model, motion)
    position, sample_rate_hz = motion.position, motion.sample_rate_hz
    m, compute_inverse = model.inputs, make_fast_inverse_response(model, len(position), sample_rate_hz / 2)

    def compute_gain(frequency_hz: FloatArray) -> ComplexArray:
        """Compute (lines, 4 m, m): from position to force (mean over a sample period), and to position and derivatives
        of the axes."""
        band_gain = compute_low_pass_gain(frequency_hz, motion.band_hz)[:, None, None]
        inverse = compute_inverse(frequency_hz)
        inverse[:, :m] *= np.sinc(frequency_hz / sample_rate_hz)[:, None, None]
        derivative_factor = 2j * np.pi * frequency_hz[:, None, None]
        axis_response = inverse[:, m:]
        return np.asarray(
            band_gain
            * np.concatenate(
                [
                    inverse[:, :m],
                    axis_response,
                    derivative_factor * axis_response,
                    derivative_factor**2 * axis_response,
                ],
                axis=1,
            )
        )

    filtered = filter_by_gain(position, sample_rate_hz, compute_gain) + _compute_force_along_line(
        model, position, sample_rate_hz
    )
    return RequiredForce(*(filtered[:, index * m : (index + 1) * m] for index in range(4)))


def _compute_square_model_force(model: MechanicalModel, motion: BandMotion) -> RequiredForce:
    """Compute the required force of a model with as many coordinates as commands, without another Fourier transform.
    Raises numpy.linalg.LinAlgError as `compute_required_force`."""
    output_inverse = np.linalg.inv(model.output[: model.inputs])
    input_inverse = np.linalg.inv(model.input)
    matrices = model.stiffness, model.damping, model.mass
    force = sum(
        (
            derivative @ (input_inverse @ matrix @ output_inverse).T
            for derivative, matrix in zip(motion.around_samples, matrices, strict=True)
        ),
        np.zeros_like(motion.position),
    )
    outputs_to_axes = (compute_driven_axes(model).T @ output_inverse).T
    return RequiredForce(force, *(derivative @ outputs_to_axes for derivative in motion.at_samples))


def _compute_force_along_line(model: MechanicalModel, position: FloatArray, sample_rate_hz: float) -> FloatArray:
    """Compute (n, 4 m): required force, position, velocity and acceleration of the axes for the straight line between
    first and last position, in steady state: y of constant slope needs the force G(0) y + G'(0) y' with the inverse
    response G and its derivative G' by s = i omega."""
    m = model.inputs
    line = compute_end_to_end_line(position)
    slope = (position[-1] - position[0]) / max(len(position) - 1, 1) * sample_rate_hz
    near_static = compute_inverse_response(model, np.array([0.0, _NEAR_STATIC_HZ]))
    static_gain, gain_slope = near_static[0].real, near_static[1].imag / (2 * np.pi * _NEAR_STATIC_HZ)
    force_and_position = line @ static_gain.T + slope @ gain_slope.T
    velocity = np.broadcast_to(slope @ static_gain[m:].T, (len(line), m))
    return np.hstack([force_and_position, velocity, np.zeros((len(line), m))])
