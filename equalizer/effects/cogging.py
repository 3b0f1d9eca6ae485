"""Cogging: a force that is periodic in position, as of magnets over iron, gear teeth, or the strands of a cable.

    F = A sin(2 pi x / p + phase)        A in N, pitch p in m (a rotation: N m, rad)

For starting values the pitch is found in the spectrum of the missing force over position, amplitude and phase by linear
least squares. An entry of `catalogue`. Reference: Hanselman, Brushless Permanent Magnet Motor Design, chapter 5.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import (
    AxisMotion,
    PartialRegression,
    regress_out_linear_terms,
    select_axis_motion,
)
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

TRAVEL_CELLS = 4096
"""Number of cells into which the travel is divided, chosen by hand; pitches up to four cells are not found."""
PITCH_COUNT = 3
"""Number of pitches that are tried, strongest peak of the periodogram first. Chosen by hand."""
_ZERO_PADDING = 8
"""Factor of zero padding: spectral points per period over the travel, so that a peak between two lines is
found. Chosen by hand."""
_MIN_PERIODS = 2
"""Smallest number of periods over the travel: fewer cannot be distinguished from a nonlinear spring."""
_ITERATIONS = 4
"""Fixed-point iterations of the implicit step. They converge where the amplitude, held over a step, moves the axis by
less than 0.3 pitches. Chosen by hand."""


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean of the force (N) at the step's start and end; the position at the end depends on the force
    (implicit step, by fixed-point iteration). parameters: as `_pack_parameters` returns them. step_motion: see
    `instant`; the force at the end is written to it."""
    sine_at_start, force = np.sin(parameters[1] * step_motion[X] + parameters[2]), 0.0
    for _ in range(_ITERATIONS):
        force = (
            0.5
            * parameters[0]
            * (
                sine_at_start
                + np.sin(parameters[1] * (step_motion[X_FREE] + step_motion[X_PER_N] * force) + parameters[2])
            )
        )
    step_motion[F_END] = parameters[0] * np.sin(
        parameters[1] * (step_motion[X_FREE] + step_motion[X_PER_N] * force) + parameters[2]
    )
    return float(force)


def _pack_parameters(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """Pack the parameters of `_compute_mean_force`, (3,): amplitude (N), wave number (rad/m), phase (rad; 0
    where it is missing)."""
    return np.array([values["amplitude"], 2 * np.pi / values["pitch"], values.get("phase", 0.0)])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find starting values of the parameters for each likely pitch, those that explain most of the missing force first;
    empty where the axis does not move."""
    motion = select_axis_motion(evidence, axis)
    regression = regress_out_linear_terms(motion)
    fits = [_fit_pitch(motion, regression, pitch) for pitch in _find_likely_pitches(motion, regression)]
    return tuple(values for _, values in sorted(fits, key=lambda fit: -fit[0]))


def _find_likely_pitches(motion: AxisMotion, regression: PartialRegression) -> list[float]:
    """Find at most `PITCH_COUNT` pitches (m) from a periodogram of the missing force over the position, strongest peak
    first; none where the axis does not move. regression: regression with the linear terms projected out of the missing
    force."""
    travel_range = float(np.ptp(motion.position))
    if travel_range == 0:
        return []
    cell_index = ((motion.position - motion.position.min()) / travel_range * (TRAVEL_CELLS - 1)).astype(int)
    force_by_cell = np.bincount(cell_index, regression.force, TRAVEL_CELLS)
    samples_by_cell = np.bincount(cell_index, minlength=TRAVEL_CELLS).astype(float)
    smoothed_samples = np.convolve(samples_by_cell, np.ones(9) / 9, "same")
    # Sums of n samples, divided by sqrt(n), have equal noise in all cells: the noise of cells in which the axis dwells
    # would otherwise hide the pattern. n is averaged over nine cells, chosen by hand.
    cell_weight = 1 / np.sqrt(np.maximum(smoothed_samples, 1.0))
    power = np.abs(np.fft.rfft(force_by_cell * cell_weight, TRAVEL_CELLS * _ZERO_PADDING)) ** 2
    power[: _MIN_PERIODS * _ZERO_PADDING] = 0
    power[TRAVEL_CELLS * _ZERO_PADDING // 4 :] = 0
    pitches = []
    for _ in range(PITCH_COUNT):
        line_index = int(np.argmax(power))
        if power[line_index] <= 0:
            break
        pitches.append(travel_range * TRAVEL_CELLS / (TRAVEL_CELLS - 1) * _ZERO_PADDING / line_index)
        power[max(line_index - _ZERO_PADDING, 0) : line_index + _ZERO_PADDING + 1] = 0
    return pitches


def _fit_pitch(motion: AxisMotion, regression: PartialRegression, pitch: float) -> tuple[float, Values]:
    """Fit amplitude and phase at a pitch (m), by linear least squares of A sin(angle + phase) = A cos(phase) sin(angle)
    + A sin(phase) cos(angle). Returns the share of the missing force that both terms explain beyond linear terms, and
    the values."""
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
    action=AxisForce(_compute_mean_force, _pack_parameters),
    starts=_find_starting_values,
)
