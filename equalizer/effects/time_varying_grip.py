"""Time-varying grip: damping and stiffness to the ground change sinusoidally with time.

    F = -depth sin(2 pi rate_hz t + phase) (D v + stiffness_share K x)

D (N s/m) and K (N/m) are the model's damping and stiffness to the ground along the axis, mainly those of the hand. v
and x are the velocity (m/s) and position (m) of the axis, t the time (s) from the start of the recording. Starting
values: least squares of the missing force on the modulated forces, at every modulation frequency.
"""

import numpy as np
from scipy.fft import fft, ifft, next_fast_len

from equalizer.effects.effect import ALL_SITES, AxisForce, Effect, Parameter, Values
from equalizer.effects.simulation.instant import STEP_S, TIME_S, V_FREE, V_PER_N, X_FREE, X_PER_N, V, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import PartialRegression, axis_motion, regress_out_linear_terms
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray

FASTEST_HZ, STARTS = 15.0, 2
"""Highest modulation frequency that is searched, above that of tremor (8 to 12 Hz); and number of starting values."""
_POINTS_PER_LINE = 16
"""Zero padding of the spectrum: points per line (one cycle per recording), so that a frequency is found to a sixteenth
of a line."""
_LEAST_DENOMINATOR = 0.2
"""Least denominator of the implicit step, which strong negative damping could otherwise bring to zero or below."""


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """The mean force over a step by the trapezoidal rule: F = -(d (v + v1) + k (x + x1)) / 2. The state x1, v1 at the
    end of the step is linear in F, so that the implicit equation is solved exactly: x1 = X_FREE + F X_PER_N, and alike
    for v1. d and k are taken in the middle of the step."""
    modulation = parameters[1] * np.sin(parameters[0] * (at[TIME_S] + 0.5 * at[STEP_S]) + parameters[2])
    damping, stiffness = modulation * parameters[3], modulation * parameters[4]
    force = -0.5 * (damping * (at[V] + at[V_FREE]) + stiffness * (at[X] + at[X_FREE]))
    return float(force / max(1 + 0.5 * (damping * at[V_PER_N] + stiffness * at[X_PER_N]), _LEAST_DENOMINATOR))


def value_to_ground(matrix: FloatArray, axes: FloatArray, axis: int) -> float:
    """Damping (N s/m) or stiffness (N/m) between a driven axis and the ground; coordinates on which no command acts are
    eliminated by static condensation (Guyan 1965). matrix: (n, n), axes: (n, m)."""
    is_undriven = np.linalg.norm(axes, axis=1) < 1e-9
    condensed = matrix[np.ix_(~is_undriven, ~is_undriven)]
    if is_undriven.any():
        coupling = matrix[np.ix_(~is_undriven, is_undriven)]
        condensed = condensed - coupling @ np.linalg.pinv(matrix[np.ix_(is_undriven, is_undriven)]) @ coupling.T
    direction = axes[~is_undriven, axis]
    return float(direction @ condensed @ direction)


def _pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """(5,): the parameters of `_law`: rad/s, depth, phase in rad, D, and stiffness_share K."""
    axes = compute_driven_axes(model)
    damping, stiffness = value_to_ground(model.damping, axes, axis), value_to_ground(model.stiffness, axes, axis)
    turning, share = 2 * np.pi * values["rate_hz"], values.get("stiffness_share", 0.0)
    return np.array([turning, values["depth"], values.get("phase", 0.0), damping, share * stiffness])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Starting values from the likeliest modulation frequencies, the best fit first."""
    sites = range(evidence.model.inputs) if axis == ALL_SITES else (axis,)
    n, rate = len(evidence.command), evidence.sample_rate_hz
    force, damping_force = np.zeros((n, len(sites))), np.zeros((n, len(sites)))
    spring_force = np.zeros((n, len(sites)))
    axes, used = compute_driven_axes(evidence.model), evidence.used > 0
    for column, site in enumerate(sites):
        force[used, column] = regress_out_linear_terms(axis_motion(evidence, site)).force
        damping_force[used, column] = (
            -value_to_ground(evidence.model.damping, axes, site) * evidence.axis_velocity[used, site]
        )
        spring_force[used, column] = (
            -value_to_ground(evidence.model.stiffness, axes, site) * evidence.axis_position[used, site]
        )
    if not damping_force.any():
        return ()
    candidates = []
    for rate_hz in _likely_rates(force, damping_force, rate):
        angle = 2 * np.pi * rate_hz * np.arange(n)[:, None] / rate
        shapes = [part * wave for part in (damping_force, spring_force) for wave in (np.sin(angle), np.cos(angle))]
        fit = PartialRegression(force.ravel(), np.column_stack([damping_force.ravel(), spring_force.ravel()])).fit(
            *(shape.ravel() for shape in shapes)
        )
        candidates.append((fit.explained_share, _grip_values(rate_hz, fit.strengths)))
    return tuple(values for _, values in sorted(candidates, key=lambda item: -item[0]))


def _grip_values(rate_hz: float, strengths: FloatArray) -> Values:
    """Parameters from the weights of the damping force times sine and cosine, then the spring force times these. The
    stiffness share is the projection of the spring force's modulation on that of the damping force, limited to the
    range of the parameter."""
    sine, cosine, stiff_sine, stiff_cosine = strengths.tolist()
    depth = float(np.hypot(sine, cosine))
    share = (stiff_sine * sine + stiff_cosine * cosine) / max(depth**2, np.finfo(float).tiny)
    phase = float(np.arctan2(cosine, sine))
    share = float(np.clip(share, -0.5, 2.0))
    return {"rate_hz": rate_hz, "depth": depth, "phase": phase, "stiffness_share": share}


def _slow_lines(samples: FloatArray, size: int, count: int) -> ComplexArray:
    """The first `count` lines of the DFT of samples zero-padded to `size`, without computing the others."""
    # Bluestein's chirp transform (Rabiner, Schafer and Rader 1969, Bell Syst. Tech. J. 48:1249).
    n, last = len(samples), max(len(samples), count)
    chirp = np.exp(-1j * np.pi / size * np.arange(last) ** 2)
    kernel = np.concatenate([chirp[n - 1 : 0 : -1], chirp[:count]]).conj()
    padded_length = next_fast_len(n + count - 1)
    convolved = ifft(fft(samples * chirp[:n], padded_length) * fft(kernel, padded_length))
    return np.asarray(convolved[n - 1 : n - 1 + count] * chirp[:count])


def _likely_rates(force: FloatArray, damping_force: FloatArray, rate: float) -> list[float]:
    """Likeliest modulation frequencies in Hz, by the power that a regression of the missing force on the damping force
    (1, sine, cosine) explains at each frequency. force, damping_force: (n, sites); rate: of the samples, in Hz."""
    n = len(force)
    size = _POINTS_PER_LINE * n
    # The products of sine and cosine contain twice the frequency, which must stay below half of the sample rate.
    last = min(int(FASTEST_HZ / rate * size), size // 4)
    cross_spectrum = np.conj(_slow_lines(np.sum(force * damping_force, axis=1), size, last + 1))
    power_spectrum = np.conj(_slow_lines(np.sum(damping_force**2, axis=1), size, 2 * last + 1))
    double_frequency, total_power = power_spectrum[: 2 * last + 1 : 2], float(power_spectrum[0].real)
    normal = np.empty((last + 1, 3, 3))
    normal[:, 0, 0] = total_power
    normal[:, 0, 1] = normal[:, 1, 0] = power_spectrum[: last + 1].imag
    normal[:, 0, 2] = normal[:, 2, 0] = power_spectrum[: last + 1].real
    normal[:, 1, 1], normal[:, 2, 2] = (
        (total_power - double_frequency.real) / 2,
        (total_power + double_frequency.real) / 2,
    )
    normal[:, 1, 2] = normal[:, 2, 1] = double_frequency.imag / 2
    columns = np.stack([np.full(last + 1, cross_spectrum[0].real), cross_spectrum.imag, cross_spectrum.real], axis=1)
    # Ridge: near zero frequency the cosine equals the constant.
    normal += 1e-6 * total_power * np.eye(3)
    power = np.sum(columns * np.linalg.solve(normal, columns[:, :, None])[:, :, 0], axis=1)
    # Less than one cycle per recording is not distinguishable from a constant grip.
    power[:_POINTS_PER_LINE] = -np.inf
    rates = []
    for _ in range(STARTS):
        line = int(np.argmax(power))
        rates.append(line * rate / size)
        power[max(line - 2 * _POINTS_PER_LINE, 0) : line + 2 * _POINTS_PER_LINE + 1] = -np.inf
    return rates


EFFECT = Effect(
    name="time_varying_grip",
    equation="F = -depth sin(2 pi rate_hz t + phase) (D v + stiffness_share K x), D and K those towards the ground",
    source="Hasser and Cutkosky 2002, Haptics Symposium: damping and stiffness grow with the grip force",
    signature="periods differ from one another though the commands repeat, the more the higher the level",
    parameters=(
        Parameter("rate_hz", 1e-4, 1e3, none=None, step=0.002),
        Parameter("depth", 1e-6, 1.5, none=0.0),
        Parameter("phase", -1e3, 1e3, none=None, scale="linear", step=0.02),
        Parameter("stiffness_share", -0.5, 2.0, none=None, scale="linear", step=0.02),
    ),
    action=AxisForce(_law, _pack),
    starts=_starts,
    of_time=True,
    sites=("all", "one"),
)
