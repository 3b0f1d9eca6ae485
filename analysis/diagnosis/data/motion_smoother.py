"""States of a model, and the missing force along each axis, estimated from measurements by a Kalman smoother.

With the state x, the force u along the axes and the missing force g, a latent force modelled as a random walk (Alvarez
and others, Latent force models, AISTATS 2009; Rogers and Friis, Mech. Syst. Signal Process. 180:109474, 2022):

    x[k+1] = A x[k] + B (u[k] + g[k])      g[k+1] = g[k] + w[k]      y[k] = C x[k] + D (u[k-1] + g[k]) + e[k]

The smoother has constant gains, those of the steady state. With the augmented state z = (x, g), its transition matrix
T = [[A, B], [0, 1]], H = [C, D], and the steady covariances P of the prediction z_p and Q of the filtered state z_f:

    forward     z_f[k] = z_p[k] + K (y[k] - D u[k-1] - H z_p[k])      z_p[k+1] = T z_f[k] + (B u[k], 0)
    backward    z_s[k] = z_f[k] + S (z_s[k+1] - z_p[k+1])             S = Q Tᵀ inv(P)

with the Kalman gain K (Rauch, Tung and Striebel, AIAA J. 3:1445, 1965). P solves a Riccati equation, by doubling
(Anderson, Int. J. Control 28:295, 1978). Unlike deconvolution, this works for plants that drift. Called by
`errors.windows`.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit, types
from scipy.linalg import solve_discrete_are

from analysis.diagnosis.data.observed import Observed
from equalizer.effects.simulation.sensor_path import undo_low_pass
from equalizer.plant.linear_simulation import DiscreteModel, discretise_model
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

EXPECTED_CHANGE_SHARE = 0.1
"""Expected rms change of a missing force within `CHANGE_TIME_S`, relative to the rms of the command. Chosen by hand."""
CHANGE_TIME_S = 0.005
"""See `EXPECTED_CHANGE_SHARE`. Chosen by hand."""
_LEAK_SHARE = 1e-5
"""Decay of the state per sample, relative: without it, unobservable states may have no steady-state filter. Chosen by
hand."""
_PROCESS_NOISE = 1e-12
"""Process noise of all states per sample, relative to their size: without it the Riccati equation may have no
stabilising solution. Chosen by hand."""
_DOUBLINGS = 40
"""Largest number of doublings of the Riccati equation; 40 are equivalent to 2^40 samples of the filter."""
_MATRIX = types.float64[:, ::1]
_READONLY_MATRIX = types.Array(types.float64, 2, "C", readonly=True)


@njit(
    types.void(_MATRIX, _MATRIX, _MATRIX, _MATRIX, _READONLY_MATRIX, _READONLY_MATRIX, _MATRIX), cache=True, nogil=True
)
def run_smoother(  # noqa: C901, PLR0913 - a kernel takes flat arrays and writes its products out
    transition: FloatArray,
    observation: FloatArray,
    gain: FloatArray,
    smoother_gain: FloatArray,
    step_input: FloatArray,
    measured: FloatArray,
    smoothed: FloatArray,
) -> None:
    """Run the smoother of the module's equations: fill `smoothed` (n, s), whose first row is the initial prediction.

    transition (s, s): T; observation (c, s): H; gain (s, c): K; smoother_gain (s, s): S. step_input (n, s): (B u, 0) of
    the step that begins at a sample. measured (n, c): y less D u of the step before; a sample with a NaN is skipped."""
    n, s, c = smoothed.shape[0], smoothed.shape[1], observation.shape[0]
    predicted = np.empty((n, s))
    state = smoothed[0].copy()
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
        smoothed[k] = state
        for j in range(s):
            total = step_input[k, j]
            for i in range(s):
                total += transition[j, i] * smoothed[k, i]
            state[j] = total
    for k in range(n - 2, -1, -1):
        for j in range(s):
            total = 0.0
            for i in range(s):
                total += smoother_gain[j, i] * (smoothed[k + 1, i] - predicted[k + 1, i])
            state[j] = smoothed[k, j] + total
        smoothed[k] = state


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


def smooth_motion(
    model: MechanicalModel, record: Observed, forces: FloatArray, channel_noise: FloatArray
) -> SmoothedMotion:
    """Estimate states and missing force of a record. forces: (n, m), force along the axes during the step that begins
    at a sample, effects included. channel_noise: (c,), standard deviations of the measured channels. Raises
    numpy.linalg.LinAlgError where no stable filter exists."""
    rate_hz, m = record.recording.sample_rate_hz, model.inputs
    discrete_model, state_count = discretise_model(model, 1 / rate_hz), 2 * model.coordinates
    transition = np.eye(state_count + m)
    transition[:state_count, :state_count], transition[:state_count, state_count:] = (
        discrete_model.transition,
        discrete_model.state_by_port_force,
    )
    transition *= 1 - _LEAK_SHARE
    observation, feedthrough = _build_observation_matrices(discrete_model, record.measured.shape[1])
    expected_force = EXPECTED_CHANGE_SHARE * np.sqrt(np.mean(record.command**2, axis=0)) + 1e-12  # N (N m); above 0
    walk_variance = np.concatenate([np.zeros(state_count), expected_force**2 / (CHANGE_TIME_S * rate_hz)])
    gain, smoother_gain = _compute_smoother_gains(
        transition,
        observation / channel_noise[:, None],
        walk_variance,
        _estimate_state_sizes(discrete_model, expected_force),
    )
    gain = gain / channel_noise[None, :]
    measured = _subtract_feedthrough(model, record, forces, feedthrough)
    step_input = np.hstack([forces @ discrete_model.state_by_port_force.T, np.zeros((len(forces), m))])
    smoothed = np.zeros((len(forces), state_count + m))
    first_complete = measured[np.isfinite(measured).all(axis=1)][:1]
    if len(first_complete):
        smoothed[0] = np.linalg.pinv(observation, rcond=1e-6) @ first_complete[0]
    run_smoother(
        transition,
        observation,
        np.ascontiguousarray(gain),
        smoother_gain,
        np.ascontiguousarray(step_input),
        np.ascontiguousarray(measured),
        smoothed,
    )
    axis_motion = smoothed[:, :state_count] @ discrete_model.motion[: 2 * m].T
    return SmoothedMotion(smoothed[:, :state_count], axis_motion[:, :m], axis_motion[:, m:], smoothed[:, state_count:])


def _build_observation_matrices(discrete_model: DiscreteModel, channel_count: int) -> tuple[FloatArray, FloatArray]:
    """Build the observation matrix H (c, s + m) of state and missing force, and feedthrough D (c, m) of the force
    during the step before."""
    p, m = len(discrete_model.position), discrete_model.state_by_port_force.shape[1]
    response_by_state = np.vstack([discrete_model.response, discrete_model.position])[:channel_count]
    response_by_force = np.vstack([discrete_model.response_by_port_force, np.zeros((p, m))])[:channel_count]
    return np.ascontiguousarray(np.hstack([response_by_state, response_by_force])), response_by_force


def _subtract_feedthrough(
    model: MechanicalModel, record: Observed, forces: FloatArray, feedthrough: FloatArray
) -> FloatArray:
    """Compute (n, c): measured channels without the sensor's low pass, less the feedthrough of the force in the step
    before."""
    measured, responses = np.array(record.measured), model.outputs
    if model.sensor.bandwidth_hz > 0:
        measured[:, :responses] = undo_low_pass(
            measured[:, :responses], record.recording.sample_rate_hz, model.sensor.bandwidth_hz
        )
    measured[1:] -= forces[:-1] @ feedthrough.T
    return measured


def _estimate_state_sizes(discrete_model: DiscreteModel, expected_force: FloatArray) -> FloatArray:
    """Estimate (s + m,): scales of position, velocity and missing force: what a force of `expected_force` causes within
    `CHANGE_TIME_S`. A velocity scale is at least 1e-6 of the largest, so that no division is by zero."""
    coordinate_count = len(discrete_model.transition) // 2
    velocity_size = (
        np.abs(discrete_model.state_by_port_force[coordinate_count:])
        @ expected_force
        / discrete_model.step_s
        * CHANGE_TIME_S
    )
    velocity_size = np.maximum(velocity_size, 1e-6 * velocity_size.max())
    return np.concatenate([velocity_size * CHANGE_TIME_S, velocity_size, expected_force])


def _compute_smoother_gains(
    transition: FloatArray, observation: FloatArray, walk_variance: FloatArray, sizes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Compute the gains K (s, c) of the Kalman filter and S (s, s) of the backward pass. observation: H for channels in
    units of their noise. walk_variance: (s,), variance of w per sample. sizes: (s,), scales of the states, by which the
    equations are made well-conditioned. Raises numpy.linalg.LinAlgError where the filter is not stable."""
    noise_covariance = np.eye(len(observation))
    scaled_transition, scaled_observation = transition * sizes[None, :] / sizes[:, None], observation * sizes[None, :]
    process_noise = np.diag(walk_variance / sizes**2) + _PROCESS_NOISE * np.eye(len(transition))
    try:
        predicted_covariance = _solve_riccati_by_doubling(scaled_transition, scaled_observation, process_noise)
    except np.linalg.LinAlgError:  # ill-conditioned: an ordered Schur form is slower, but more accurate
        predicted_covariance = _solve_riccati_by_schur_form(scaled_transition, scaled_observation, process_noise)
    gain = np.linalg.solve(
        scaled_observation @ predicted_covariance @ scaled_observation.T + noise_covariance,
        scaled_observation @ predicted_covariance,
    ).T
    if np.abs(np.linalg.eigvals(scaled_transition - scaled_transition @ gain @ scaled_observation)).max() >= 1:
        raise np.linalg.LinAlgError("a filter for the motion is not stable in floating point")
    filtered_covariance = predicted_covariance - gain @ scaled_observation @ predicted_covariance
    smoother_gain = np.linalg.lstsq(predicted_covariance, scaled_transition @ filtered_covariance, rcond=1e-13)[0].T
    return gain * sizes[:, None], np.ascontiguousarray(smoother_gain * sizes[:, None] / sizes[None, :])


def _solve_riccati_by_schur_form(
    transition: FloatArray, observation: FloatArray, process_noise: FloatArray
) -> FloatArray:
    """Compute the steady prediction covariance P (s, s) by an ordered Schur form (SciPy). Raises
    numpy.linalg.LinAlgError where it does not exist."""
    try:
        return np.asarray(solve_discrete_are(transition.T, observation.T, process_noise, np.eye(len(observation))))
    except ValueError as error:  # not finite
        raise np.linalg.LinAlgError(str(error)) from error


def _solve_riccati_by_doubling(
    state_transition: FloatArray, observation: FloatArray, process_noise: FloatArray
) -> FloatArray:
    """Compute the steady prediction covariance P (s, s) by the doubling algorithm (Anderson 1978), for channels with
    unit noise. Raises numpy.linalg.LinAlgError where it does not converge to 1e-10 (relative) within `_DOUBLINGS`."""
    transition, information, covariance = state_transition.T, observation.T @ observation, process_noise
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
