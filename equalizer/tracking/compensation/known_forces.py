"""With which force known physics resists a motion along one axis, and what of that a linear model has already in it.

Each law takes its parameters, position (m), velocity (m/s) and the speed below which a change of sign is smoothed, and
gives the force (N) that must be added to the command: the effect's own, with the opposite sign. Rotations likewise.
"""

from collections.abc import Callable, Mapping

import numpy as np

from equalizer.signals.lockin import ComplexArray
from equalizer.signals.signal import FloatArray

Law = Callable[[Mapping[str, float], FloatArray, FloatArray, float], FloatArray]

CYCLE = 256
"""Samples per cycle on which an equivalent is evaluated."""
AMPLITUDES = 48
"""Amplitudes at which it is; in between it is interpolated."""


def _sign(velocity: FloatArray, slip: float) -> FloatArray:
    return np.asarray(np.tanh(velocity / slip))


def _coulomb(of: Mapping[str, float], x: FloatArray, v: FloatArray, slip: float) -> FloatArray:
    return of["level"] * _sign(v, slip)


def _asymmetric_friction(of: Mapping[str, float], x: FloatArray, v: FloatArray, slip: float) -> FloatArray:
    return np.where(v > 0, of["level_positive"], of["level_negative"]) * _sign(v, slip)


def _along_the_way(of: Mapping[str, float], x: FloatArray, v: FloatArray, slip: float) -> FloatArray:
    level = of["level"] * (1 + of["slope_per_m"] * x + of["bend_per_m2"] * x**2)
    return np.asarray(np.maximum(level, 0.0) * _sign(v, slip))


def _stribeck(of: Mapping[str, float], x: FloatArray, v: FloatArray, slip: float) -> FloatArray:
    level = of["coulomb"] + (of["static"] - of["coulomb"]) * np.exp(-((v / of["speed"]) ** 2))
    return np.asarray(level * _sign(v, slip))


def _presliding(of: Mapping[str, float], x: FloatArray, v: FloatArray, slip: float) -> FloatArray:
    """Dahl's bristle, solved backwards: it bends with the motion and slips at the level."""
    longest, bent = of["level"] / of["stiffness"], 0.0
    bends = np.empty_like(x)
    for k, travel in enumerate(np.diff(x, prepend=x[:1])):
        bent = bends[k] = (bent + travel) / (1 + abs(travel) / longest)
    return np.asarray(of["stiffness"] * bends)


def _quadratic_damping(of: Mapping[str, float], x: FloatArray, v: FloatArray, slip: float) -> FloatArray:
    return of["coefficient"] * v * np.abs(v)


def _hardening(of: Mapping[str, float], x: FloatArray, v: FloatArray, slip: float) -> FloatArray:
    return np.asarray(of["k3"] * x**3)


def _asymmetric_stiffness(of: Mapping[str, float], x: FloatArray, v: FloatArray, slip: float) -> FloatArray:
    return np.asarray(of["k2"] * x**2)


LAWS: dict[str, Law] = {
    "coulomb_friction": _coulomb,
    "asymmetric_friction": _asymmetric_friction,
    "position_dependent_friction": _along_the_way,
    "stribeck_friction": _stribeck,
    "presliding_hysteresis": _presliding,
    "quadratic_damping": _quadratic_damping,
    "hardening_stiffness": _hardening,
    "asymmetric_stiffness": _asymmetric_stiffness,
}


def equivalent_impedance(
    law: Law, of: Mapping[str, float], frequency_hz: FloatArray, speed: FloatArray, slip_share: float
) -> ComplexArray:
    """(lines,), N s/m: force over velocity at the fundamental, where the axis swings with amplitude `speed` (lines,),
    m/s, above zero. A sinusoidal describing function; the second of two cycles, so that a bristle has settled.
    """
    chosen = np.unique(np.linspace(0, len(frequency_hz) - 1, min(AMPLITUDES, len(frequency_hz))).round().astype(int))
    angle = 2 * np.pi * np.arange(2 * CYCLE) / CYCLE
    found = np.empty(len(chosen), dtype=np.complex128)
    for place, line in enumerate(chosen):
        v = speed[line] * np.sin(angle)
        x = -speed[line] / (2 * np.pi * frequency_hz[line]) * np.cos(angle)
        force = law(of, x, v, slip_share * speed[line])[CYCLE:]
        # sin is -i / 2 of the positive line, so that a force along the velocity gives a positive real part.
        found[place] = 2j * np.mean(force * np.exp(-1j * angle[CYCLE:])) / speed[line]
    at = frequency_hz[chosen]
    return np.asarray(
        np.interp(frequency_hz, at, found.real) + 1j * np.interp(frequency_hz, at, found.imag), dtype=np.complex128
    )


def deadband_share(width: float, amplitude: float) -> float:
    """What a dead band of half-width `width` lets through of a sinusoid's fundamental."""
    if width >= amplitude:
        return 0.0
    share = width / amplitude
    return float(1 - 2 / np.pi * (np.arcsin(share) + share * np.sqrt(1 - share**2)))
