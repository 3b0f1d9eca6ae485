"""Time-varying grip: damping and stiffness to the ground change sinusoidally with time.

    F = -depth sin(2 pi rate_hz t + phase) (D v + stiffness_share K x)

D (N s/m) and K (N/m) are the model's damping and stiffness to the ground along the axis, those of the hand included. v
and x are the velocity (m/s) and position (m) of the axis, t the time (s) from the start of the recording. An entry of
`catalogue`.
"""

import numpy as np
from scipy.fft import fft, ifft, next_fast_len

from equalizer.effects.effect import ALL_SITES, AxisForce, Effect, Parameter, Values
from equalizer.effects.simulation.instant import STEP_S, TIME_S, V_FREE, V_PER_N, X_FREE, X_PER_N, V, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import PartialRegression, regress_out_linear_terms, select_axis_motion
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray

HIGHEST_MODULATION_HZ = 15.0
"""Highest modulation frequency (Hz) that is searched, above that of tremor (8 to 12 Hz). Chosen."""
START_COUNT = 2
"""Number of starting values. Chosen."""
STIFFNESS_SHARE_RANGE = (-0.5, 2.0)
"""Range of the parameter `stiffness_share`. Chosen."""
_POINTS_PER_LINE = 16
"""Zero padding of the spectrum: points per line (one cycle per recording), so that a frequency is found to a sixteenth
of a line."""
_LEAST_DENOMINATOR = 0.2
"""Least denominator of the implicit step, which strong negative damping could otherwise bring to zero or below.
Chosen."""


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean force (N) over a step by the trapezoidal rule: F = -(d (v + v1) + k (x + x1)) / 2. The state x1,
    v1 at the end of the step is linear in F, so that the implicit equation is solved exactly, unless its denominator
    falls below `_LEAST_DENOMINATOR`: x1 = X_FREE + F X_PER_N, v1 = V_FREE + F V_PER_N. d and k are taken in the middle
    of the step. parameters: as `_pack_parameters` returns them; step_motion: see `instant`."""
    modulation = parameters[1] * np.sin(
        parameters[0] * (step_motion[TIME_S] + 0.5 * step_motion[STEP_S]) + parameters[2]
    )
    damping, stiffness = modulation * parameters[3], modulation * parameters[4]
    force = -0.5 * (
        damping * (step_motion[V] + step_motion[V_FREE]) + stiffness * (step_motion[X] + step_motion[X_FREE])
    )
    return float(
        force / max(1 + 0.5 * (damping * step_motion[V_PER_N] + stiffness * step_motion[X_PER_N]), _LEAST_DENOMINATOR)
    )


def condense_to_ground(matrix: FloatArray, driven_axes: FloatArray, axis: int) -> float:
    """Compute the damping (N s/m) or stiffness (N/m) between a driven axis and the ground; coordinates on which no
    command acts (rows of `driven_axes` with a norm below 1e-9, rounding) are eliminated by static condensation
    (Guyan 1965). matrix: (n, n), of damping or stiffness; driven_axes: (n, m)."""
    is_undriven = np.linalg.norm(driven_axes, axis=1) < 1e-9
    condensed_matrix = matrix[np.ix_(~is_undriven, ~is_undriven)]
    if is_undriven.any():
        coupling = matrix[np.ix_(~is_undriven, is_undriven)]
        condensed_matrix = (
            condensed_matrix - coupling @ np.linalg.pinv(matrix[np.ix_(is_undriven, is_undriven)]) @ coupling.T
        )
    direction = driven_axes[~is_undriven, axis]
    return float(direction @ condensed_matrix @ direction)


def _pack_parameters(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """Pack the parameters of `_compute_mean_force`, (5,): modulation frequency (rad/s), depth, phase (rad), D (N s/m),
    and stiffness_share K (N/m)."""
    driven_axes = compute_driven_axes(model)
    damping, stiffness = (
        condense_to_ground(model.damping, driven_axes, axis),
        condense_to_ground(model.stiffness, driven_axes, axis),
    )
    modulation_rad_s, stiffness_share = 2 * np.pi * values["rate_hz"], values.get("stiffness_share", 0.0)
    return np.array([modulation_rad_s, values["depth"], values.get("phase", 0.0), damping, stiffness_share * stiffness])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find starting values at the likeliest modulation frequencies, the best fit first; empty where the model has no
    damping to the ground or nothing moves."""
    sites = range(evidence.model.inputs) if axis == ALL_SITES else (axis,)
    sample_count, sample_rate_hz = len(evidence.command), evidence.sample_rate_hz
    missing_force, damping_force = np.zeros((sample_count, len(sites))), np.zeros((sample_count, len(sites)))
    spring_force = np.zeros((sample_count, len(sites)))
    driven_axes, is_used = compute_driven_axes(evidence.model), evidence.used > 0
    for column, site in enumerate(sites):
        missing_force[is_used, column] = regress_out_linear_terms(select_axis_motion(evidence, site)).force
        damping_force[is_used, column] = (
            -condense_to_ground(evidence.model.damping, driven_axes, site) * evidence.axis_velocity[is_used, site]
        )
        spring_force[is_used, column] = (
            -condense_to_ground(evidence.model.stiffness, driven_axes, site) * evidence.axis_position[is_used, site]
        )
    if not damping_force.any():
        return ()
    candidates = []
    for modulation_hz in _find_likely_frequencies(missing_force, damping_force, sample_rate_hz):
        angle = 2 * np.pi * modulation_hz * np.arange(sample_count)[:, None] / sample_rate_hz
        modulated_forces = [
            ground_force * wave
            for ground_force in (damping_force, spring_force)
            for wave in (np.sin(angle), np.cos(angle))
        ]
        fit = PartialRegression(
            missing_force.ravel(), np.column_stack([damping_force.ravel(), spring_force.ravel()])
        ).fit(*(modulated_force.ravel() for modulated_force in modulated_forces))
        candidates.append((fit.explained_share, _compute_grip_values(modulation_hz, fit.strengths)))
    return tuple(values for _, values in sorted(candidates, key=lambda item: -item[0]))


def _compute_grip_values(modulation_hz: float, strengths: FloatArray) -> Values:
    """Compute the parameters from the weights of the damping force times sine and cosine, then of the spring force
    times these. The stiffness share is the projection of the spring force's modulation on that of the damping force,
    limited to `STIFFNESS_SHARE_RANGE`."""
    sine, cosine, spring_sine, spring_cosine = strengths.tolist()
    depth = float(np.hypot(sine, cosine))
    stiffness_share = (spring_sine * sine + spring_cosine * cosine) / max(depth**2, np.finfo(float).tiny)
    phase = float(np.arctan2(cosine, sine))
    stiffness_share = float(np.clip(stiffness_share, *STIFFNESS_SHARE_RANGE))
    return {"rate_hz": modulation_hz, "depth": depth, "phase": phase, "stiffness_share": stiffness_share}


def _compute_low_lines(samples: FloatArray, padded_size: int, line_count: int) -> ComplexArray:
    """Compute the first `line_count` lines of the DFT of samples zero-padded to `padded_size`, without computing the
    others."""
    # Bluestein's chirp transform (Rabiner, Schafer and Rader 1969, Bell Syst. Tech. J. 48:1249).
    sample_count, chirp_length = len(samples), max(len(samples), line_count)
    chirp = np.exp(-1j * np.pi / padded_size * np.arange(chirp_length) ** 2)
    kernel = np.concatenate([chirp[sample_count - 1 : 0 : -1], chirp[:line_count]]).conj()
    padded_length = next_fast_len(sample_count + line_count - 1)
    convolved = ifft(fft(samples * chirp[:sample_count], padded_length) * fft(kernel, padded_length))
    return np.asarray(convolved[sample_count - 1 : sample_count - 1 + line_count] * chirp[:line_count])


def _find_likely_frequencies(
    missing_force: FloatArray, damping_force: FloatArray, sample_rate_hz: float
) -> list[float]:
    """Find the likeliest modulation frequencies (Hz), by the power that a regression of the missing force on the
    damping force (times 1, sine, cosine) explains at each frequency; fewer than `START_COUNT`, or none, in a short
    recording. missing_force, damping_force: (n, sites), N."""
    sample_count = len(missing_force)
    padded_size = _POINTS_PER_LINE * sample_count
    # The products of sine and cosine contain twice the frequency, which must stay below half of the sample rate.
    last_line = min(int(HIGHEST_MODULATION_HZ / sample_rate_hz * padded_size), padded_size // 4)
    cross_spectrum = np.conj(
        _compute_low_lines(np.sum(missing_force * damping_force, axis=1), padded_size, last_line + 1)
    )
    power_spectrum = np.conj(_compute_low_lines(np.sum(damping_force**2, axis=1), padded_size, 2 * last_line + 1))
    double_frequency_spectrum, total_power = power_spectrum[: 2 * last_line + 1 : 2], float(power_spectrum[0].real)
    normal_matrices = np.empty((last_line + 1, 3, 3))
    normal_matrices[:, 0, 0] = total_power
    normal_matrices[:, 0, 1] = normal_matrices[:, 1, 0] = power_spectrum[: last_line + 1].imag
    normal_matrices[:, 0, 2] = normal_matrices[:, 2, 0] = power_spectrum[: last_line + 1].real
    normal_matrices[:, 1, 1], normal_matrices[:, 2, 2] = (
        (total_power - double_frequency_spectrum.real) / 2,
        (total_power + double_frequency_spectrum.real) / 2,
    )
    normal_matrices[:, 1, 2] = normal_matrices[:, 2, 1] = double_frequency_spectrum.imag / 2
    right_sides = np.stack(
        [np.full(last_line + 1, cross_spectrum[0].real), cross_spectrum.imag, cross_spectrum.real], axis=1
    )
    # Ridge of 1e-6 (chosen): near zero frequency the cosine equals the constant, and the equations are singular.
    normal_matrices += 1e-6 * total_power * np.eye(3)
    explained_power = np.sum(right_sides * np.linalg.solve(normal_matrices, right_sides[:, :, None])[:, :, 0], axis=1)
    # Less than one cycle per recording is not distinguishable from a constant grip.
    explained_power[:_POINTS_PER_LINE] = -np.inf
    modulation_frequencies_hz = []
    for _ in range(START_COUNT):
        line = int(np.argmax(explained_power))
        if explained_power[line] == -np.inf:  # a short recording has no further line
            break
        modulation_frequencies_hz.append(line * sample_rate_hz / padded_size)
        explained_power[max(line - 2 * _POINTS_PER_LINE, 0) : line + 2 * _POINTS_PER_LINE + 1] = -np.inf
    return modulation_frequencies_hz


EFFECT = Effect(
    name="time_varying_grip",
    equation="F = -depth sin(2 pi rate_hz t + phase) (D v + stiffness_share K x), D and K those towards the ground",
    source="Hasser and Cutkosky 2002, Haptics Symposium: damping and stiffness grow with the grip force",
    signature="periods differ from one another though the commands repeat, the more the higher the level",
    parameters=(
        Parameter("rate_hz", 1e-4, 1e3, none=None, step=0.002),
        Parameter("depth", 1e-6, 1.5, none=0.0),
        Parameter("phase", -1e3, 1e3, none=None, scale="linear", step=0.02),
        Parameter("stiffness_share", *STIFFNESS_SHARE_RANGE, none=None, scale="linear", step=0.02),
    ),
    action=AxisForce(_compute_mean_force, _pack_parameters),
    starts=_find_starting_values,
    of_time=True,
    sites=("all", "one"),
)
