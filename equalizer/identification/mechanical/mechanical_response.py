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

_SMALL = 1e-9
"""Magnitude of a pole times the step below which the pole counts as an integrator."""
_FASTEST_GROWTH = 200.0
"""Upper limit of the real part of a pole times the step: e to this power is still a finite number."""


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


def pole_form(model: MechanicalModel) -> PoleForm:
    """Pole-residue form of a model. Raises numpy.linalg.LinAlgError where its state matrix cannot be diagonalised."""
    n, m = model.coordinates, model.inputs
    weights = np.linalg.solve(model.mass, np.concatenate([model.stiffness, model.damping, model.input], axis=1))
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n], A[n:, n:] = -weights[:, :n], -weights[:, n : 2 * n]
    B = np.concatenate([np.zeros((n, m)), weights[:, 2 * n :]])
    order = DERIVATIVE_OF_QUANTITY[model.quantity]
    C = model.output @ (A[n:] if order == 2 else np.eye(2 * n)[order * n : (order + 1) * n])
    direct = model.output @ B[n:] if order == 2 else np.zeros((model.outputs, m))
    if model.actuator.bandwidth_hz:
        A, B, C, direct = _append_input_lag(A, B, C, direct, 2 * np.pi * model.actuator.bandwidth_hz)
    poles, vectors = np.linalg.eig(A)
    inverse = np.linalg.inv(vectors)
    return PoleForm(poles.astype(complex), C @ vectors, inverse @ B, direct, inverse.astype(complex))


def sample_response(
    model: MechanicalModel, frequency_hz: FloatArray, rate_hz: float, hold: Hold, form: PoleForm | None = None
) -> ComplexArray:
    """Frequency response (lines, p, m), with sensor and delay, of commands that are held as `hold` says. frequency_hz:
    (lines,), above zero. form: the model's, if known."""
    form = form or pole_form(model)
    z = np.exp(2j * np.pi * np.asarray(frequency_hz) / rate_hz)
    pole_terms, direct = pole_responses(form.poles, z, rate_hz, hold, model.actuator.delay_s)
    response = _sum_poles(pole_terms, form.outputs, form.inputs) + direct[:, None, None] * form.direct
    return np.asarray(response * sensor_response(model.sensor.bandwidth_hz, z, rate_hz)[:, None, None])


def free_response(
    model: MechanicalModel, frequency_hz: FloatArray, rate_hz: float, form: PoleForm | None = None
) -> ComplexArray:
    """Spectra (lines, p, states) of the free response to each state, per difference between the state's values at the
    segment's two ends. form: the model's, if known.

    The spectrum of a segment is the response to its commands plus a real combination of these (transient, or leakage).
    """
    form = form or pole_form(model)
    z = np.exp(2j * np.pi * np.asarray(frequency_hz) / rate_hz)
    # A fit may try an unstable model: the growth per sample is limited, so that its response stays finite.
    growth = np.minimum(form.poles.real / rate_hz, _FASTEST_GROWTH) + 1j * form.poles.imag / rate_hz
    decays = z[:, None] / (z[:, None] - np.exp(growth))
    spectra = _sum_poles(decays, form.outputs, form.states)
    return np.asarray(spectra * sensor_response(model.sensor.bandwidth_hz, z, rate_hz)[:, None, None])


def _sum_poles(pole_terms: ComplexArray, outputs: ComplexArray, inputs: ComplexArray) -> ComplexArray:
    """Sum over the poles, (lines, p, m), in one product of matrices. pole_terms: response of each pole, (lines,
    poles)."""
    residues = outputs.T[:, :, None] * inputs[:, None, :]
    products = pole_terms @ residues.reshape(len(residues), -1)
    return np.asarray(products.reshape(len(pole_terms), *residues.shape[1:]))


def sensor_response(bandwidth_hz: float, z: ComplexArray, rate_hz: float) -> ComplexArray:
    """(lines,): response of the sensor's first-order low-pass y += (1 - exp(-2 pi f / rate)) (x - y), f its bandwidth;
    1 where the bandwidth is 0, which means no low-pass."""
    if not bandwidth_hz:
        return np.ones(len(z), dtype=np.complex128)
    decay = np.exp(-2 * np.pi * bandwidth_hz / rate_hz)
    return np.asarray((1 - decay) / (1 - decay / z))


def _append_input_lag(
    A: FloatArray, B: FloatArray, C: FloatArray, direct: FloatArray, rate: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """State-space matrices A, B, C and D with a first-order lag in front of each input: u' = rate (command - u), rate
    in 1/s."""
    n, m = B.shape
    lagged = np.block([[A, B], [np.zeros((m, n)), -rate * np.eye(m)]])
    driven = np.concatenate([np.zeros((n, m)), rate * np.eye(m)])
    return lagged, driven, np.concatenate([C, direct], axis=1), np.zeros_like(direct)


def pole_responses(
    poles: ComplexArray, z: ComplexArray, rate_hz: float, hold: Hold, delay_s: float
) -> tuple[ComplexArray, ComplexArray]:
    """Response to a held command of each pole, (lines, poles), and of the direct feedthrough, (lines,), by the formulas
    of the module docstring. z: (lines,), on the unit circle, none equal to 1."""
    step, column = 1 / rate_hz, z[:, None]
    # A fit may try an unstable model: the growth per sample is limited, so that its response stays finite.
    poles = np.minimum(poles.real, _FASTEST_GROWTH * rate_hz) + 1j * poles.imag
    if hold is Hold.ZERO_ORDER:
        whole_steps = np.floor(delay_s * rate_hz + 1e-9)
        delay_rest = max(delay_s - whole_steps * step, 0.0)
        step_rest = step - delay_rest
        first = _integrate_exponential(poles, step_rest)
        second = np.exp(poles * step_rest) * _integrate_exponential(poles, delay_rest)
        factor = column ** (-whole_steps)
        return factor * (first + second / column) / (column - np.exp(poles * step)), z ** (-whole_steps - 1)
    delayed = np.exp(-np.log(z) * delay_s * rate_hz)
    if hold is Hold.LINEAR:
        ramp = _integrate_ramp(poles, step)
        factor = column - np.exp(poles * step)
        return delayed[:, None] * (_integrate_exponential(poles, step) + ramp * (column - 1)) / factor, delayed
    return delayed[:, None] / (np.log(column) * rate_hz - poles), delayed


def _integrate_exponential(poles: ComplexArray, seconds: float) -> ComplexArray:
    """(poles,): integral of e^(p t) over 0 < t < seconds."""
    small = np.abs(poles) * seconds < _SMALL
    safe = np.where(small, 1.0, poles)
    return np.asarray(np.where(small, seconds, np.expm1(safe * seconds) / safe))


def _integrate_ramp(poles: ComplexArray, step: float) -> ComplexArray:
    """(poles,): state after a step in which the command rises linearly from 0 to 1. For a small |p| T, where the exact
    form would lose its digits, a Taylor series."""
    small = np.abs(poles) * step < 1e-4
    safe = np.where(small, 1.0, poles)
    exact = (np.expm1(safe * step) - safe * step) / (safe**2 * step)
    return np.asarray(np.where(small, step / 2 + poles * step**2 / 6, exact))
