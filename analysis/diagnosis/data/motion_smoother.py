"""States of a model, and the missing force along each axis, estimated from measurements by a Kalman smoother.

With the state x, the force u along the axes and the missing force g (a latent force modelled as a random walk; Alvarez
and others 2009; Rogers and Friis 2021), sample by sample:

    x' = A x + B (u + g)      g' = g + w      y = C x + D (u of the step before + g) + e

Gains are those of the steady state: the Riccati equation is solved by doubling (Anderson 1978), and the backward pass
is that of Rauch, Tung and Striebel (1965). Unlike deconvolution, this works for plants that drift.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit, types
from scipy.linalg import solve_discrete_are

from analysis.diagnosis.data.observed import Observed
from equalizer.effects.simulation.sensor_path import undo_low_pass
from equalizer.plant.linear_simulation import LinearSteps, discretise_model
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

EXPECTED_SHARE = 0.1
"""Rms change of a missing force within `CHANGES_S`, relative to the rms of the command. By hand."""
CHANGES_S = 0.005
"""Time in s in which a missing force may change by `EXPECTED_SHARE`."""
_LEAK_SHARE = 1e-5
"""Share of the state that is forgotten per sample: without it, unobservable states have no steady-state filter."""
_PROCESS_NOISE = 1e-12
"""Process noise of all states per sample, relative to their size: without it the Riccati equation has no stabilising
solution."""
_DOUBLINGS = 40
"""Largest number of doublings, which is equivalent to running the filter over 2^40 samples."""
_MATRIX = types.float64[:, ::1]
_READ = types.Array(types.float64, 2, "C", readonly=True)


@njit(types.void(_MATRIX, _MATRIX, _MATRIX, _MATRIX, _READ, _READ, _MATRIX), cache=True, nogil=True)
def smooth(  # noqa: C901, PLR0913 - a kernel takes flat arrays and writes its products out
    advance: FloatArray,
    observation: FloatArray,
    gain: FloatArray,
    back: FloatArray,
    pushed: FloatArray,
    measured: FloatArray,
    out: FloatArray,
) -> None:
    """Kalman smoother of constant gains, forwards, then backwards (Rauch, Tung and Striebel 1965).

    Fill out (n, s), the smoothed states. advance (s, s), observation (c, s), gain (s, c), back (s, s): see
    `motion_smoother`. pushed (n, s): input of the step that begins at a sample. measured (n, c): NaN where nothing was
    measured."""
    n, s, c = out.shape[0], out.shape[1], observation.shape[0]
    predicted = np.empty((n, s))
    state = out[0].copy()
    for k in range(n):
        predicted[k] = state
        complete = True
        for i in range(c):
            complete = complete and not np.isnan(measured[k, i])
        if complete:
            innovation = np.empty(c)
            for i in range(c):
                total = measured[k, i]
                for j in range(s):
                    total -= observation[i, j] * predicted[k, j]
                innovation[i] = total
            for j in range(s):
                for i in range(c):
                    state[j] += gain[j, i] * innovation[i]
        out[k] = state
        for j in range(s):
            total = pushed[k, j]
            for i in range(s):
                total += advance[j, i] * out[k, i]
            state[j] = total
    for k in range(n - 2, -1, -1):
        for j in range(s):
            total = 0.0
            for i in range(s):
                total += back[j, i] * (out[k + 1, i] - predicted[k + 1, i])
            state[j] = out[k, j] + total
        out[k] = state


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedMotion:
    """States and missing force, estimated by the smoother at each sample."""

    states: FloatArray
    """(n, 2 coordinates): positions, then velocities, just before each command is written."""
    axis_position: FloatArray
    """(n, m): positions along the driven axes, in m or rad."""
    axis_velocity: FloatArray
    """(n, m): velocities along the driven axes, in m/s or rad/s."""
    missing_force: FloatArray
    """(n, m): missing force along the driven axes, in N or N m."""


def smooth_motion(model: MechanicalModel, record: Observed, forces: FloatArray, unit: FloatArray) -> SmoothedMotion:
    """States and missing force of a record. forces: (n, m), force along the axes over each sample's time, effects
    included. unit: (c,), standard deviations of the measured channels. Raises numpy.linalg.LinAlgError where no filter
    exists."""
    rate_hz, m = record.recording.sample_rate_hz, model.inputs
    steps, size = discretise_model(model, 1 / rate_hz), 2 * model.coordinates
    advance = np.eye(size + m)
    advance[:size, :size], advance[:size, size:] = steps.advance, steps.by_axis_force
    advance *= 1 - _LEAK_SHARE
    observation, direct = _observation_matrices(steps, record.measured.shape[1])
    expected = EXPECTED_SHARE * np.sqrt(np.mean(record.command**2, axis=0)) + 1e-12
    walk_variance = np.concatenate([np.zeros(size), expected**2 / (CHANGES_S * rate_hz)])
    gain, back = _smoother_gains(advance, observation / unit[:, None], walk_variance, _state_sizes(steps, expected))
    gain = gain / unit[None, :]
    measured = _subtract_feedthrough(model, record, forces, direct)
    pushed = np.hstack([forces @ steps.by_axis_force.T, np.zeros((len(forces), m))])
    out = np.zeros((len(forces), size + m))
    first = measured[np.isfinite(measured).all(axis=1)][:1]
    if len(first):
        out[0] = np.linalg.pinv(observation, rcond=1e-6) @ first[0]
    smooth(
        advance,
        observation,
        np.ascontiguousarray(gain),
        back,
        np.ascontiguousarray(pushed),
        np.ascontiguousarray(measured),
        out,
    )
    axis_motion = out[:, :size] @ steps.motion[: 2 * m].T
    return SmoothedMotion(out[:, :size], axis_motion[:, :m], axis_motion[:, m:], out[:, size:])


def _observation_matrices(steps: LinearSteps, channels: int) -> tuple[FloatArray, FloatArray]:
    """Observation matrix (c, s + m) of state and missing force; and that (c, m) of the force over the step before."""
    p, m = len(steps.position), steps.by_axis_force.shape[1]
    of_state = np.vstack([steps.response, steps.position])[:channels]
    of_force = np.vstack([steps.response_by_axis_force, np.zeros((p, m))])[:channels]
    return np.ascontiguousarray(np.hstack([of_state, of_force])), of_force


def _subtract_feedthrough(
    model: MechanicalModel, record: Observed, forces: FloatArray, direct: FloatArray
) -> FloatArray:
    """(n, c): measured channels without the sensor's low pass, less the direct effect of the force just before."""
    measured, responses = np.array(record.measured), model.outputs
    if model.sensor.bandwidth_hz > 0:
        measured[:, :responses] = undo_low_pass(
            measured[:, :responses], record.recording.sample_rate_hz, model.sensor.bandwidth_hz
        )
    measured[1:] -= forces[:-1] @ direct.T
    return measured


def _state_sizes(steps: LinearSteps, expected: FloatArray) -> FloatArray:
    """(s + m,): sizes of position, velocity and force that the expected missing force reaches within `CHANGES_S`."""
    n = len(steps.advance) // 2
    fast = np.abs(steps.by_axis_force[n:]) @ expected / steps.step_s * CHANGES_S
    fast = np.maximum(fast, 1e-6 * fast.max())
    return np.concatenate([fast * CHANGES_S, fast, expected])


def _smoother_gains(
    advance: FloatArray, observation: FloatArray, walk_variance: FloatArray, sizes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Gains of the Kalman filter (s, c) and of the backward pass (s, s). observation: observation matrix of channels in
    units of their noise. Solved with all states scaled to about the same size."""
    eye = np.eye(len(observation))
    scaled, observed = advance * sizes[None, :] / sizes[:, None], observation * sizes[None, :]
    process_noise = np.diag(walk_variance / sizes**2) + _PROCESS_NOISE * np.eye(len(advance))
    try:
        predicted = _steady_covariance(scaled, observed, process_noise)
    except np.linalg.LinAlgError:  # states of very different sizes: by an ordered Schur form, which is slower
        predicted = _covariance_by_schur_form(scaled, observed, process_noise)
    gain = np.linalg.solve(observed @ predicted @ observed.T + eye, observed @ predicted).T
    if np.abs(np.linalg.eigvals(scaled - scaled @ gain @ observed)).max() >= 1:
        raise np.linalg.LinAlgError("a filter for the motion is not stable in floating point")
    filtered = predicted - gain @ observed @ predicted
    back = np.linalg.lstsq(predicted, scaled @ filtered, rcond=1e-13)[0].T
    return gain * sizes[:, None], np.ascontiguousarray(back * sizes[:, None] / sizes[None, :])


def _covariance_by_schur_form(advance: FloatArray, observation: FloatArray, process_noise: FloatArray) -> FloatArray:
    """Steady prediction covariance by an ordered Schur form (SciPy), slower than by doubling. Raises
    numpy.linalg.LinAlgError."""
    try:
        return np.asarray(solve_discrete_are(advance.T, observation.T, process_noise, np.eye(len(observation))))
    except ValueError as problem:  # not finite
        raise np.linalg.LinAlgError(str(problem)) from problem


def _steady_covariance(advance: FloatArray, observation: FloatArray, process_noise: FloatArray) -> FloatArray:
    """Steady prediction covariance by the doubling algorithm (Anderson 1978; noise of the channels is 1). Raises
    numpy.linalg.LinAlgError where it does not converge."""
    transition, information, covariance = advance.T, observation.T @ observation, process_noise
    for _ in range(_DOUBLINGS):
        solutions = np.linalg.solve(
            np.eye(len(transition)) + information @ covariance, np.hstack([transition, information])
        )
        propagated, information_term = solutions[:, : len(transition)], solutions[:, len(transition) :]
        increment = transition.T @ covariance @ propagated
        transition, information, covariance = (
            transition @ propagated,
            information + transition @ information_term @ transition.T,
            covariance + (increment + increment.T) / 2,
        )
        if not np.isfinite(covariance).all():
            break
        if np.abs(increment).max() <= 1e-10 * np.abs(covariance).max():
            return np.asarray(covariance)
    raise np.linalg.LinAlgError("a filter for the motion does not converge")
