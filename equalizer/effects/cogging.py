"""Cogging: a force that is periodic in position, as of magnets over iron, gear teeth, or the strands of a cable.

    F = A sin(2 pi x / p + phase)        A in N, pitch p in m (a rotation: N m, rad)

The pitch for a fit is found in the spectrum of the missing force over position, amplitude and phase by linear least
squares.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import (
    AxisMotion,
    PartialRegression,
    axis_motion,
    regress_out_linear_terms,
)
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

CELLS = 4096
"""Number of cells into which the travel is divided; the shortest pitch that is found is four cells long."""
PITCHES = 3
"""Number of pitches that are tried, strongest peak of the periodogram first. By hand."""
_ZERO_PADDING = 8
"""Factor of zero padding: spectral points per period over the travel, so that a peak between two lines is found."""
_LEAST_PERIODS = 2
"""Least number of periods over the travel: fewer cannot be distinguished from a nonlinear spring."""
_ITERATIONS = 4
"""Fixed-point iterations of the implicit step: each multiplies the error by the force's slope over the position times
the step's motion per newton, below 1 unless a pitch is crossed within a step. By hand."""


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Mean of the force at the step's start and end; the position at the end depends on the force (implicit step)."""
    start, force = np.sin(parameters[1] * at[X] + parameters[2]), 0.0
    for _ in range(_ITERATIONS):
        force = (
            0.5 * parameters[0] * (start + np.sin(parameters[1] * (at[X_FREE] + at[X_PER_N] * force) + parameters[2]))
        )
    at[F_END] = parameters[0] * np.sin(parameters[1] * (at[X_FREE] + at[X_PER_N] * force) + parameters[2])
    return float(force)


def _pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """Parameters of `_law`: amplitude (N), wave number (rad/m), phase (rad)."""
    return np.array([values["amplitude"], 2 * np.pi / values["pitch"], values.get("phase", 0.0)])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """A set of values for each likely pitch, the set that explains most of the missing force first."""
    motion = axis_motion(evidence, axis)
    regression = regress_out_linear_terms(motion)
    fits = [_fit_pitch(motion, regression, pitch) for pitch in _likely_pitches(motion, regression)]
    return tuple(values for _, values in sorted(fits, key=lambda item: -item[0]))


def _likely_pitches(motion: AxisMotion, regression: PartialRegression) -> list[float]:
    """Starting values of the pitch (m) from a periodogram of the missing force over the position, strongest first; none
    where the axis does not move. regression: regression with the linear terms projected out of the missing force."""
    travel_range = float(np.ptp(motion.position))
    if travel_range == 0:
        return []
    cell = ((motion.position - motion.position.min()) / travel_range * (CELLS - 1)).astype(int)
    force = np.bincount(cell, regression.force, CELLS)
    density = np.bincount(cell, minlength=CELLS).astype(float)
    smooth = np.convolve(density, np.ones(9) / 9, "same")
    # Cells are weighted alike: noise from where the axis dwells would otherwise hide the pattern.
    weight = 1 / np.sqrt(np.maximum(smooth, 1.0))
    power = np.abs(np.fft.rfft(force * weight, CELLS * _ZERO_PADDING)) ** 2
    power[: _LEAST_PERIODS * _ZERO_PADDING] = 0
    power[CELLS * _ZERO_PADDING // 4 :] = 0
    pitches = []
    for _ in range(PITCHES):
        line = int(np.argmax(power))
        if power[line] <= 0:
            break
        pitches.append(travel_range * CELLS / (CELLS - 1) * _ZERO_PADDING / line)
        power[max(line - _ZERO_PADDING, 0) : line + _ZERO_PADDING + 1] = 0
    return pitches


def _fit_pitch(motion: AxisMotion, regression: PartialRegression, pitch: float) -> tuple[float, Values]:
    """Share of the missing force that sine and cosine of this pitch (m) explain beyond linear terms, and the values:
    A sin(angle + phase) = A cos(phase) sin(angle) + A sin(phase) cos(angle), by linear least squares."""
    angle = 2 * np.pi * motion.position / pitch
    fit = regression.fit(np.sin(angle), np.cos(angle))
    sine, cosine = fit.strengths.tolist()
    return fit.explained_share, {
        "amplitude": float(np.hypot(sine, cosine)), "pitch": pitch, "phase": float(np.arctan2(cosine, sine))
    }  # fmt: skip


EFFECT = Effect(
    name="cogging",
    equation="F = amplitude sin(2 pi x / pitch + phase)",
    source="Hanselman, Brushless Permanent Magnet Motor Design, chapter 5",
    signature="the missing force has one line in its spectrum over the position, at every level; odd and even "
    "harmonics alike",
    parameters=(
        Parameter("amplitude", 1e-9, 1e6, none=0.0),
        Parameter("pitch", 1e-9, 1e3, none=None, step=0.002),
        Parameter("phase", -1e3, 1e3, none=None, scale="linear", step=0.02),
    ),
    action=AxisForce(_law, _pack),
    starts=_starts,
)
