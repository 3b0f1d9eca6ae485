"""Frequency response of a mechanical model from command samples to response samples, exact for the hold between them.

M a + D v + K q = B u, with the actuator's lag, is decomposed into its poles p (modal form): each is a state
x' = p x + u, whose response to a held command has a closed form, so that a spectral line costs a product of small
matrices. With z = e^(s T), T the sample period, and E(t) the integral of e^(p tau) over 0 < tau < t,

    zero-order hold, delay k T + d, 0 <= d < T:  z^-k (E(T - d) + e^(p (T - d)) E(d) / z) / (z - e^(p T))
    linear between samples:                      (E(T) + R (z - 1)) / (z - e^(p T)),  R the state after a unit ramp
    band-limited:                                1 / (s - p)

For the last two, a delay multiplies by e^(-s delay). `response[k]` is taken just before `command[k]` is written, as in
`signals.recording`.

Reference: Franklin, Powell and Workman, Digital Control of Dynamic Systems (1998), chapters 4 and 6.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.signals.recording import Hold
from equalizer.signals.signal import ComplexArray, FloatArray

_LARGEST_INTEGRATOR_STEP = 1e-9
"""Magnitude of a pole times the duration of an integral below which the pole counts as an integrator (numerically
zero). Chosen."""
_LARGEST_GROWTH_EXPONENT = 200.0
"""Upper limit of the real part of a pole times the sample period. Chosen: its exponential is a finite number."""


@dataclass(frozen=True, slots=True, eq=False)
class PoleForm:
    """Pole-residue form of the plant in continuous time, without delay and sensor:
    outputs diag(1 / (s - poles)) inputs + direct."""

    poles: ComplexArray
    """(states,), 1/s"""
    outputs: ComplexArray
    """(p, states)"""
    inputs: ComplexArray
    """(states, m)"""
    direct: FloatArray
    """(p, m)"""
    states: ComplexArray
    """(states, states): modal amplitude of each pole (row) for a unit initial value of each state (column)."""


def compute_pole_form(model: MechanicalModel) -> PoleForm:
    """Compute the pole-residue form of a model by diagonalisation of its state matrix. Raises numpy.linalg.LinAlgError
    where its state matrix cannot be diagonalised."""
    n, m = model.coordinates, model.inputs
    acceleration_gains = np.linalg.solve(
        model.mass, np.concatenate([model.stiffness, model.damping, model.input], axis=1)
    )
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n], A[n:, n:] = -acceleration_gains[:, :n], -acceleration_gains[:, n : 2 * n]
    B = np.concatenate([np.zeros((n, m)), acceleration_gains[:, 2 * n :]])
    order = DERIVATIVE_OF_QUANTITY[model.quantity]
    C = model.output @ (A[n:] if order == 2 else np.eye(2 * n)[order * n : (order + 1) * n])
    direct = model.output @ B[n:] if order == 2 else np.zeros((model.outputs, m))
    if model.actuator.bandwidth_hz:
        A, B, C, direct = _append_input_lag(A, B, C, direct, 2 * np.pi * model.actuator.bandwidth_hz)
    poles, vectors = np.linalg.eig(A)
    inverse_vectors = np.linalg.inv(vectors)
    return PoleForm(poles.astype(complex), C @ vectors, inverse_vectors @ B, direct, inverse_vectors.astype(complex))


def compute_sampled_response(
    model: MechanicalModel, frequency_hz: FloatArray, rate_hz: float, hold: Hold, form: PoleForm | None = None
) -> ComplexArray:
    """Compute the frequency response (lines, p, m), with sensor and delay, of commands reconstructed by `hold`.
    frequency_hz: (lines,), above zero. form: the model's, if known."""
    form = form or compute_pole_form(model)
    z = np.exp(2j * np.pi * np.asarray(frequency_hz) / rate_hz)
    pole_terms, direct = compute_pole_responses(form.poles, z, rate_hz, hold, model.actuator.delay_s)
    response = _sum_poles(pole_terms, form.outputs, form.inputs) + direct[:, None, None] * form.direct
    return np.asarray(response * compute_sensor_response(model.sensor.bandwidth_hz, z, rate_hz)[:, None, None])


def compute_free_response(
    model: MechanicalModel, frequency_hz: FloatArray, rate_hz: float, form: PoleForm | None = None
) -> ComplexArray:
    """Compute the spectra (lines, p, states) of the free response to each state, per difference between the state's
    values at the segment's two ends. form: the model's, if known.

    A segment's spectrum contains a real combination of these (transient, or leakage).
    """
    form = form or compute_pole_form(model)
    z = np.exp(2j * np.pi * np.asarray(frequency_hz) / rate_hz)
    # A fit may try an unstable model: the growth per sample is limited, so that its response stays finite.
    exponents = np.minimum(form.poles.real / rate_hz, _LARGEST_GROWTH_EXPONENT) + 1j * form.poles.imag / rate_hz
    pole_terms = z[:, None] / (z[:, None] - np.exp(exponents))
    spectra = _sum_poles(pole_terms, form.outputs, form.states)
    return np.asarray(spectra * compute_sensor_response(model.sensor.bandwidth_hz, z, rate_hz)[:, None, None])


def _sum_poles(pole_terms: ComplexArray, outputs: ComplexArray, inputs: ComplexArray) -> ComplexArray:
    """Sum over the poles, (lines, p, m), in one product of matrices. pole_terms: response of each pole, (lines,
    poles)."""
    residues = outputs.T[:, :, None] * inputs[:, None, :]
    products = pole_terms @ residues.reshape(len(residues), -1)
    return np.asarray(products.reshape(len(pole_terms), *residues.shape[1:]))


def compute_sensor_response(bandwidth_hz: float, z: ComplexArray, rate_hz: float) -> ComplexArray:
    """Compute the response (lines,) of the sensor's first-order low-pass y += (1 - exp(-2 pi f / rate)) (x - y), f its
    bandwidth; 1 where the bandwidth is 0, which means no low-pass."""
    if not bandwidth_hz:
        return np.ones(len(z), dtype=np.complex128)
    decay = np.exp(-2 * np.pi * bandwidth_hz / rate_hz)
    return np.asarray((1 - decay) / (1 - decay / z))


def _append_input_lag(
    A: FloatArray, B: FloatArray, C: FloatArray, direct: FloatArray, lag_rate: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Append a first-order lag in front of each input, u' = lag_rate (command - u), lag_rate in 1/s; returns A, B, C
    and D."""
    n, m = B.shape
    lagged_A = np.block([[A, B], [np.zeros((m, n)), -lag_rate * np.eye(m)]])
    lagged_B = np.concatenate([np.zeros((n, m)), lag_rate * np.eye(m)])
    return lagged_A, lagged_B, np.concatenate([C, direct], axis=1), np.zeros_like(direct)


def compute_pole_responses(
    poles: ComplexArray, z: ComplexArray, rate_hz: float, hold: Hold, delay_s: float
) -> tuple[ComplexArray, ComplexArray]:
    """Compute the response to a held command of each pole, (lines, poles), and of the direct feedthrough, (lines,), by
    the formulas of the module docstring. z: (lines,), on the unit circle, none equal to 1."""
    step_s, z_column = 1 / rate_hz, z[:, None]
    # A fit may try an unstable model: the growth per sample is limited, so that its response stays finite.
    poles = np.minimum(poles.real, _LARGEST_GROWTH_EXPONENT * rate_hz) + 1j * poles.imag
    if hold is Hold.ZERO_ORDER:
        whole_steps = np.floor(delay_s * rate_hz + 1e-9)
        fractional_delay_s = max(delay_s - whole_steps * step_s, 0.0)
        remaining_step_s = step_s - fractional_delay_s
        new_part = _integrate_exponential(poles, remaining_step_s)
        old_part = np.exp(poles * remaining_step_s) * _integrate_exponential(poles, fractional_delay_s)
        shift = z_column ** (-whole_steps)
        return shift * (new_part + old_part / z_column) / (z_column - np.exp(poles * step_s)), z ** (-whole_steps - 1)
    delay_phase = np.exp(-np.log(z) * delay_s * rate_hz)
    if hold is Hold.LINEAR:
        ramp_terms = _integrate_ramp(poles, step_s)
        denominator = z_column - np.exp(poles * step_s)
        return delay_phase[:, None] * (
            _integrate_exponential(poles, step_s) + ramp_terms * (z_column - 1)
        ) / denominator, delay_phase
    return delay_phase[:, None] / (np.log(z_column) * rate_hz - poles), delay_phase


def _integrate_exponential(poles: ComplexArray, duration_s: float) -> ComplexArray:
    """Integrate e^(p t) over 0 < t < duration_s for each pole, (poles,)."""
    is_small = np.abs(poles) * duration_s < _LARGEST_INTEGRATOR_STEP
    safe_poles = np.where(is_small, 1.0, poles)
    return np.asarray(np.where(is_small, duration_s, np.expm1(safe_poles * duration_s) / safe_poles))


def _integrate_ramp(poles: ComplexArray, step_s: float) -> ComplexArray:
    """Compute the state (poles,) after a sample period in which the command rises linearly from 0 to 1. For a small |p|
    T (below 1e-4) the exact form loses digits by cancellation: a Taylor series replaces it."""
    is_small = np.abs(poles) * step_s < 1e-4
    safe_poles = np.where(is_small, 1.0, poles)
    exact = (np.expm1(safe_poles * step_s) - safe_poles * step_s) / (safe_poles**2 * step_s)
    return np.asarray(np.where(is_small, step_s / 2 + poles * step_s**2 / 6, exact))
