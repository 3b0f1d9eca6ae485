"""Forces by which known effects resist a motion along an axis, and their linear equivalents (describing functions).

Each law F(parameters, x, v, slip_mps) takes the position x (m), the velocity v (m/s), (N,) each, and the speed (m/s)
below which a change of sign is smoothed: sign(v) becomes tanh(v / slip_mps), with slip_mps above zero. It returns the
force (N) that must be added to the command: the effect's own force with the opposite sign. For rotations the units are
rad, rad/s and N m. Reference for describing functions: Gelb and Vander Velde, Multiple-Input Describing Functions and
Nonlinear System Design (1968).
"""

from collections.abc import Callable, Mapping

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray

ForceLaw = Callable[[Mapping[str, float], FloatArray, FloatArray, float], FloatArray]
"""Function of the module docstring; the parameters are in SI units, by their names in the catalogue of effects."""

SAMPLES_PER_CYCLE = 256
"""Samples per cycle of the sinusoid for which a describing function is evaluated. Chosen."""
MOST_EVALUATED_LINES = 48
"""Largest number of lines at which a describing function is evaluated; it is interpolated linearly between them.
Chosen, to limit computing time."""


def _smooth_sign(velocity: FloatArray, slip_mps: float) -> FloatArray:
    """Compute tanh(v / slip_mps) in place of sign(v), because a discontinuous force cannot be played."""
    return np.asarray(np.tanh(velocity / slip_mps))


def _compute_position_dependent_friction(
    parameters: Mapping[str, float], x: FloatArray, v: FloatArray, slip_mps: float
) -> FloatArray:
    """Coulomb friction with the level max(0, level (1 + slope x + bend x²))."""
    level = parameters["level"] * (1 + parameters["slope_per_m"] * x + parameters["bend_per_m2"] * x**2)
    return np.asarray(np.maximum(level, 0.0) * _smooth_sign(v, slip_mps))


def _compute_stribeck_friction(
    parameters: Mapping[str, float], x: FloatArray, v: FloatArray, slip_mps: float
) -> FloatArray:
    """Stribeck friction, F = (coulomb + (static - coulomb) exp(-(v / speed)²)) sign(v)."""
    level = parameters["coulomb"] + (parameters["static"] - parameters["coulomb"]) * np.exp(
        -((v / parameters["speed"]) ** 2)
    )
    return np.asarray(level * _smooth_sign(v, slip_mps))


def _compute_presliding_hysteresis(
    parameters: Mapping[str, float], x: FloatArray, v: FloatArray, slip_mps: float
) -> FloatArray:
    """Dahl's bristle model (1968): F = stiffness z with dz/dx = 1 - sign(v) z stiffness / level, by implicit Euler
    steps from z = 0. At z = level / stiffness the bristle slips."""
    slip_deflection, deflection = parameters["level"] / parameters["stiffness"], 0.0
    deflections = np.empty_like(x)
    for k, travel in enumerate(np.diff(x, prepend=x[:1])):
        deflection = deflections[k] = (deflection + travel) / (1 + abs(travel) / slip_deflection)
    return np.asarray(parameters["stiffness"] * deflections)


LAWS: dict[str, ForceLaw] = {
    "coulomb_friction": lambda parameters, x, v, slip_mps: parameters["level"] * _smooth_sign(v, slip_mps),
    "asymmetric_friction": lambda parameters, x, v, slip_mps: (
        np.where(v > 0, parameters["level_positive"], parameters["level_negative"]) * _smooth_sign(v, slip_mps)
    ),
    "position_dependent_friction": _compute_position_dependent_friction,
    "stribeck_friction": _compute_stribeck_friction,
    "presliding_hysteresis": _compute_presliding_hysteresis,
    "quadratic_damping": lambda parameters, x, v, slip_mps: parameters["coefficient"] * v * np.abs(v),
    "hardening_stiffness": lambda parameters, x, v, slip_mps: parameters["k3"] * x**3,
    "asymmetric_stiffness": lambda parameters, x, v, slip_mps: parameters["k2"] * x**2,
}
"""Laws by name of the effect. `hardening_stiffness`: cubic (Duffing)."""


def compute_equivalent_impedance(
    law: ForceLaw, parameters: Mapping[str, float], frequency_hz: FloatArray, speed_mps: FloatArray, slip_share: float
) -> ComplexArray:
    """Compute the describing function (lines,), N s/m: complex ratio of force to velocity at the fundamental, for
    velocity amplitudes `speed_mps` (lines,), m/s, above zero. From the second of two cycles, because presliding begins
    without deflection. slip_share: slip speed over velocity amplitude."""
    line_indices = np.unique(
        np.linspace(0, len(frequency_hz) - 1, min(MOST_EVALUATED_LINES, len(frequency_hz))).round().astype(int)
    )
    phase_rad = 2 * np.pi * np.arange(2 * SAMPLES_PER_CYCLE) / SAMPLES_PER_CYCLE
    impedance = np.empty(len(line_indices), dtype=np.complex128)
    for index, line_index in enumerate(line_indices):
        v = speed_mps[line_index] * np.sin(phase_rad)
        x = -speed_mps[line_index] / (2 * np.pi * frequency_hz[line_index]) * np.cos(phase_rad)
        force = law(parameters, x, v, slip_share * speed_mps[line_index])[SAMPLES_PER_CYCLE:]
        # sin is -i / 2 of the positive line, so that a force along the velocity gives a positive real part.
        impedance[index] = 2j * np.mean(force * np.exp(-1j * phase_rad[SAMPLES_PER_CYCLE:])) / speed_mps[line_index]
    evaluated_hz = frequency_hz[line_indices]
    return np.asarray(
        np.interp(frequency_hz, evaluated_hz, impedance.real)
        + 1j * np.interp(frequency_hz, evaluated_hz, impedance.imag),
        dtype=np.complex128,
    )


def apply_deadband(parameters: Mapping[str, float], command: FloatArray) -> FloatArray:
    """Compute the force (N) at the output of a dead band for commands u (N): 0 where |u| <= width, else u - (1 - jump)
    width sgn(u), with the parameters width (N) and jump (share of the width, 0 where not given)."""
    width, jump = parameters["width"], parameters.get("jump", 0.0)
    is_outside = np.abs(command) > width
    return np.asarray(np.where(is_outside, command - (1.0 - jump) * width * np.sign(command), 0.0))


def compute_deadband_describing_function(parameters: Mapping[str, float], amplitude: float) -> float:
    """Compute the describing function of a dead band: the share of a sinusoid's fundamental that passes, 0 for an
    amplitude (N, above zero) up to the width. With s = width / amplitude it is 1 - 2/pi (arcsin s + s sqrt(1 - s^2)) of
    the dead zone, and 4/pi jump s sqrt(1 - s^2) of the jump (relay with dead zone; Gelb and Vander Velde, 1968,
    chapter 2)."""
    relative_width = parameters["width"] / amplitude
    if relative_width >= 1.0:
        return 0.0
    root = np.sqrt(1 - relative_width**2)
    jump_share = 4 / np.pi * parameters.get("jump", 0.0) * relative_width * root
    return float(1 - 2 / np.pi * (np.arcsin(relative_width) + relative_width * root) + jump_share)
