"""Starting values of a further mode: a grid search over frequency and damping.

An oscillator with frequency w, damping ratio d and participation vector L adds, at the driven axes, the dynamic
stiffness L L' s² (2 d w s + w²) / (s² + 2 d w s + w²). To first order the response changes in proportion to L L', so
that for each w and d on the grid linear least squares gives the residual power that a further oscillator explains, with
all present unknowns re-adjusted (their tangent space is projected out).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.mechanical.mechanical_misfit import LineGroup, misfits, numerical_jacobian, stack_real
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit
from equalizer.identification.mechanical.mechanical_response import sample_response, sensor_response
from equalizer.identification.mechanical.mechanical_start import solve_scaled, symmetric_matrix, triangle_pairs
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray

_GRID = 60
"""Number of resonance frequencies that are tried."""
_RATIOS = (0.01, 0.05, 0.25)
"""Damping ratios that are tried. Heuristic."""
_MOST_ROWS = 6000
"""Largest number of rows of the regression, over all groups; more lines are thinned out."""
_SMALL_START = 0.02
"""Least starting value of the root of the mode's mass over the mass scale, as the linear estimate may be zero or
negative. Heuristic."""


@dataclass(frozen=True, slots=True, eq=False)
class ModeStart:
    """Structure with a further oscillator, the starting values of all its unknowns, and the oscillator's resonance."""

    structure: Structure
    unknowns: FloatArray
    frequency_hz: float
    explained: float
    """Fall of the residual sum of squares by the mode, to first order in its mass."""


def mode_starts(
    groups: Sequence[LineGroup], now: RefinedFit[Structure], band_hz: tuple[float, float], most: int = 2
) -> tuple[ModeStart, ...]:
    """Starting values of a further oscillator, at the `most` frequencies that explain most, best first; frequencies
    differ by more than 10 % (0.1 in the natural logarithm)."""
    thinned = [_thin_group(group.without_left_out(), len(groups)) for group in groups]
    model = now.structure.model(now.unknowns)
    misfit = stack_real(misfits(thinned, model))
    known = _tangent_basis(thinned, now, misfit)
    misfit = misfit - known @ (known.T @ misfit)
    moving = [_model_motion(group, model, now.structure) for group in thinned]
    found = []
    for frequency_hz in np.geomspace(band_hz[0] / 1.5, band_hz[1] * 1.5, _GRID):
        for ratio in _RATIOS:
            columns = _mode_columns(moving, now.structure, 2 * np.pi * frequency_hz, ratio)
            columns = columns - known @ (known.T @ columns)
            strengths = solve_scaled(columns, misfit)
            explained = float(misfit @ misfit - np.sum((misfit - columns @ strengths) ** 2))
            found.append((explained, float(frequency_hz), ratio, strengths))
    chosen: list[tuple[float, float, float, FloatArray]] = []
    for candidate in sorted(found, key=lambda each: -each[0]):
        if all(abs(np.log(candidate[1] / other[1])) > 0.1 for other in chosen):
            chosen.append(candidate)
    return tuple(_make_start(now, *candidate) for candidate in chosen[:most])


def _tangent_basis(groups: Sequence[LineGroup], now: RefinedFit[Structure], misfit: FloatArray) -> FloatArray:
    """(rows, parameters): orthonormal basis of the changes of the residuals by the present unknowns, to first order."""
    high = np.full(now.structure.parameters, np.inf)
    slope = numerical_jacobian(
        lambda unknowns: stack_real(misfits(groups, now.structure.model(unknowns))), now.unknowns, misfit, high
    )
    return np.asarray(np.linalg.qr(slope / np.maximum(np.linalg.norm(slope, axis=0), 1e-300))[0])


def _thin_group(group: LineGroup, groups: int) -> LineGroup:
    rows = 2 * group.target[0].size * len(group.frequency_hz)
    chosen = np.zeros(len(group.frequency_hz), dtype=bool)
    chosen[:: max(1, rows * groups // _MOST_ROWS)] = True
    return group.of_lines(chosen)


@dataclass(frozen=True, slots=True, eq=False)
class _ModelMotion:
    """Motion of the present model at a group's lines."""

    group: LineGroup
    s: ComplexArray
    """(lines,): j 2 pi f, 1/s."""
    response: ComplexArray
    """(lines, p, m): response to the commands."""
    shown: ComplexArray
    """(lines,): frequency response of a sensor to a position, with the derivative that the response's quantity
    takes."""
    moved: ComplexArray
    """(lines, m, m): positions of the driven axes per unit command."""


def _model_motion(group: LineGroup, model: MechanicalModel, structure: Structure) -> _ModelMotion:
    order = DERIVATIVE_OF_QUANTITY[structure.quantity]
    s = np.asarray(2j * np.pi * group.frequency_hz, dtype=np.complex128)
    z = np.exp(s / group.rate_hz)
    response = sample_response(model, group.frequency_hz, group.rate_hz, group.hold)
    # A held force appears in an acceleration one sample later, in velocity and position half a sample later.
    late = (1.0 if order == 2 else 0.5) if group.hold.value == "zero-order" else 0.0
    shown = sensor_response(model.sensor.bandwidth_hz, z, group.rate_hz) * z ** (-late) * s**order
    moved = response[:, : structure.inputs] * np.array(structure.signs)[:, None] / shown[:, None, None]
    return _ModelMotion(group, s, response, shown, moved)


def _mode_columns(moving: Sequence[_ModelMotion], structure: Structure, speed: float, ratio: float) -> FloatArray:
    """Change of the weighted modelled response, (rows, columns): first per entry of L Lᵀ (lower triangle), then per
    entry of (sensor shape) Lᵀ, sensor by sensor. speed: natural frequency in rad/s; ratio: damping ratio."""
    m, p = structure.inputs, structure.outputs
    parts = []
    for lines in moving:
        s, response, moved = lines.s, lines.response, lines.moved
        below = s**2 + 2 * ratio * speed * s + speed**2
        heavier = s**2 * (2 * ratio * speed * s + speed**2) / below
        changes = [
            -heavier[:, None, None] * np.einsum("lp,lm->lpm", response[:, :, row], moved[:, column])
            + (0 if row == column else 1)
            * -heavier[:, None, None]
            * np.einsum("lp,lm->lpm", response[:, :, column], moved[:, row])
            for row, column in triangle_pairs(m)
        ]
        for seen in range(0 if structure.shared else m, p):
            for axis in range(m):
                change = np.zeros_like(response)
                change[:, seen] = (-(s**2) / below * lines.shown)[:, None] * moved[:, axis]
                changes.append(change)
        columns = [-np.einsum("lpem,lpm->lpe", lines.group.root, change) for change in changes]
        parts.append(columns)
    flat = [stack_real([part[k] for part in parts]) for k in range(len(parts[0]))]
    return -np.stack(flat, axis=1)


def _make_start(
    now: RefinedFit[Structure], explained: float, frequency_hz: float, ratio: float, strengths: FloatArray
) -> ModeStart:
    structure, m = now.structure, now.structure.inputs
    grown = replace(structure, modes=structure.modes + 1)
    unknowns = structure.transfer_unknowns(now.unknowns, grown)
    own_entries = m * (m + 1) // 2
    own, others = symmetric_matrix(strengths[:own_entries], m), strengths[own_entries:].reshape(-1, m)
    root = np.sqrt(structure.mass_scale)
    # A mode has a single participation vector: the dominant direction of the estimated matrices, to which further
    # sensors' shapes are then fitted.
    along = (
        np.linalg.svd(np.concatenate([own / root**2, others]))[2][0] if len(others) else np.linalg.eigh(own)[1][:, -1]
    )
    participation = along * max(np.sqrt(max(along @ own @ along, 0.0)), _SMALL_START * root)
    seen = others @ participation / (participation @ participation)
    speed = np.log(2 * np.pi * frequency_hz / structure.speed_scale)
    each = np.concatenate([[speed, np.log(ratio)], participation / root, seen * root])
    part = grown.slices["modes"]
    unknowns[part.stop - len(each) : part.stop] = each
    return ModeStart(grown, unknowns, frequency_hz, explained)
