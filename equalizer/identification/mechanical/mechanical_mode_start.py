"""Starting values of a further mode: a grid search over frequency and damping.

An oscillator with frequency w, damping ratio d and participation vector L adds, at the driven axes, the dynamic
stiffness L L' s² (2 d w s + w²) / (s² + 2 d w s + w²). To first order the response changes in proportion to L L', so
that for each w and d on the grid linear least squares gives the residual power that a further oscillator explains, with
all present unknowns re-adjusted (their tangent space is projected out).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.mechanical.mechanical_misfit import (
    LineGroup,
    compute_misfits,
    compute_numerical_jacobian,
    stack_real,
)
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit
from equalizer.identification.mechanical.mechanical_response import compute_sampled_response, compute_sensor_response
from equalizer.identification.mechanical.mechanical_start import (
    build_symmetric_matrix,
    list_triangle_pairs,
    solve_scaled,
)
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray

_GRID_FREQUENCIES = 60
"""Number of resonance frequencies on the grid. Chosen."""
_DAMPING_RATIOS = (0.01, 0.05, 0.25)
"""Damping ratios on the grid. Chosen."""
_INTENDED_ROWS = 6000
"""Intended number of rows of the regression over all groups; a larger number is reduced to one between this and twice
this. Chosen."""
_MIN_RELATIVE_ROOT_MASS = 0.02
"""Smallest starting value of the root of the mode's mass over the mass scale, because the linear estimate may be zero
or negative. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class ModeStart:
    """Structure with a further oscillator, the starting values of all its unknowns, and the oscillator's resonance."""

    structure: Structure
    unknowns: FloatArray
    """(parameters,): starting values, scaled as `Structure` states."""
    frequency_hz: float
    """Resonance frequency of the further oscillator (Hz)."""


def estimate_mode_starts(
    groups: Sequence[LineGroup], current: RefinedFit[Structure], band_hz: tuple[float, float], max_starts: int = 2
) -> tuple[ModeStart, ...]:
    """Estimate starting values of a further oscillator, at the `max_starts` frequencies whose oscillators reduce the
    residual most, best first; frequencies differ by more than 0.1 in the natural logarithm. band_hz: band of the
    frequency responses; the grid extends beyond it by a factor of 1.5, because a mode outside also acts inside. Both
    factors are chosen."""
    thinned_groups = [_thin_group(group.exclude_held_out(), len(groups)) for group in groups]
    model = current.structure.build_model(current.unknowns)
    misfit = stack_real(compute_misfits(thinned_groups, model))
    tangent = _compute_tangent_basis(thinned_groups, current, misfit)
    misfit = misfit - tangent @ (tangent.T @ misfit)
    motions = [_compute_model_motion(group, model, current.structure) for group in thinned_groups]
    candidates = []
    for frequency_hz in np.geomspace(band_hz[0] / 1.5, band_hz[1] * 1.5, _GRID_FREQUENCIES):
        for damping_ratio in _DAMPING_RATIOS:
            columns = _compute_mode_columns(motions, current.structure, 2 * np.pi * frequency_hz, damping_ratio)
            columns = columns - tangent @ (tangent.T @ columns)
            coefficients = solve_scaled(columns, misfit)
            # Fall of the residual sum of squares by the mode, to first order in its mass.
            explained_squares = float(misfit @ misfit - np.sum((misfit - columns @ coefficients) ** 2))
            candidates.append((explained_squares, float(frequency_hz), damping_ratio, coefficients))
    chosen_candidates: list[tuple[float, float, float, FloatArray]] = []
    for candidate in sorted(candidates, key=lambda item: -item[0]):
        if all(abs(np.log(candidate[1] / accepted[1])) > 0.1 for accepted in chosen_candidates):
            chosen_candidates.append(candidate)
    return tuple(_make_start(current, *candidate[1:]) for candidate in chosen_candidates[:max_starts])


def _compute_tangent_basis(
    groups: Sequence[LineGroup], current: RefinedFit[Structure], misfit: FloatArray
) -> FloatArray:
    """Compute an orthonormal basis (rows, parameters) of the first-order changes of the residuals by the present
    unknowns."""
    upper_bounds = np.full(current.structure.parameters, np.inf)
    jacobian = compute_numerical_jacobian(
        lambda unknowns: stack_real(compute_misfits(groups, current.structure.build_model(unknowns))),
        current.unknowns,
        misfit,
        upper_bounds,
    )
    return np.asarray(np.linalg.qr(jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300))[0])


def _thin_group(group: LineGroup, group_count: int) -> LineGroup:
    """Reduce a group to every k-th line, with k such that `group_count` groups of this size have fewer than twice
    `_INTENDED_ROWS` rows together."""
    row_count = 2 * group.target[0].size * len(group.frequency_hz)
    is_kept = np.zeros(len(group.frequency_hz), dtype=bool)
    is_kept[:: max(1, row_count * group_count // _INTENDED_ROWS)] = True
    return group.select_lines(is_kept)


@dataclass(frozen=True, slots=True, eq=False)
class _ModelMotion:
    """Motion of the present model at a group's lines."""

    group: LineGroup
    s: ComplexArray
    """(lines,): j 2 pi f, 1/s."""
    response: ComplexArray
    """(lines, p, m): response to the commands."""
    sensor: ComplexArray
    """(lines,): frequency response of a sensor to a position, with the derivative that the response's quantity
    takes."""
    axis_motion: ComplexArray
    """(lines, m, m): positions of the driven axes per unit command."""


def _compute_model_motion(group: LineGroup, model: MechanicalModel, structure: Structure) -> _ModelMotion:
    """Compute the response and axis motion of the model at the lines of a group."""
    derivative_order = DERIVATIVE_OF_QUANTITY[structure.quantity]
    s = np.asarray(2j * np.pi * group.frequency_hz, dtype=np.complex128)
    z = np.exp(s / group.rate_hz)
    response = compute_sampled_response(model, group.frequency_hz, group.rate_hz, group.hold)
    # A held force appears in an acceleration one sample later, in velocity and position half a sample later.
    delay_samples = (1.0 if derivative_order == 2 else 0.5) if group.hold.value == "zero-order" else 0.0
    sensor = (
        compute_sensor_response(model.sensor.bandwidth_hz, z, group.rate_hz)
        * z ** (-delay_samples)
        * s**derivative_order
    )
    axis_motion = response[:, : structure.inputs] * np.array(structure.signs)[:, None] / sensor[:, None, None]
    return _ModelMotion(group, s, response, sensor, axis_motion)


def _compute_mode_columns(
    motions: Sequence[_ModelMotion], structure: Structure, natural_rad_s: float, damping_ratio: float
) -> FloatArray:
    """Compute the change of the weighted modelled response, (rows, columns), by the oscillator, to first order: first
    per entry of L Lᵀ (lower triangle, kg), then per entry of (sensor shape) Lᵀ, sensor by sensor. natural_rad_s:
    natural frequency in rad/s."""
    inputs, outputs = structure.inputs, structure.outputs
    group_columns = []
    for motion in motions:
        s, response, axis_motion = motion.s, motion.response, motion.axis_motion
        denominator = s**2 + 2 * damping_ratio * natural_rad_s * s + natural_rad_s**2
        dynamic_stiffness = s**2 * (2 * damping_ratio * natural_rad_s * s + natural_rad_s**2) / denominator
        changes = [
            -dynamic_stiffness[:, None, None] * np.einsum("lp,lm->lpm", response[:, :, row], axis_motion[:, column])
            + (0 if row == column else 1)
            * -dynamic_stiffness[:, None, None]
            * np.einsum("lp,lm->lpm", response[:, :, column], axis_motion[:, row])
            for row, column in list_triangle_pairs(inputs)
        ]
        for output in range(0 if structure.shared_sensors else inputs, outputs):
            for axis in range(inputs):
                change = np.zeros_like(response)
                change[:, output] = (-(s**2) / denominator * motion.sensor)[:, None] * axis_motion[:, axis]
                changes.append(change)
        columns = [-np.einsum("lpem,lpm->lpe", motion.group.root, change) for change in changes]
        group_columns.append(columns)
    stacked_columns = [
        stack_real([columns_of_group[k] for columns_of_group in group_columns]) for k in range(len(group_columns[0]))
    ]
    return -np.stack(stacked_columns, axis=1)


def _make_start(
    current: RefinedFit[Structure], frequency_hz: float, damping_ratio: float, coefficients: FloatArray
) -> ModeStart:
    """Make the starting values of the structure with a further oscillator. frequency_hz, damping_ratio: of the
    oscillator; coefficients: of the columns of `_compute_mode_columns`."""
    structure, inputs = current.structure, current.structure.inputs
    extended_structure = replace(structure, modes=structure.modes + 1)
    unknowns = structure.convert_unknowns(current.unknowns, extended_structure)
    pair_count = inputs * (inputs + 1) // 2
    mass_matrix, sensor_rows = (
        build_symmetric_matrix(coefficients[:pair_count], inputs),
        coefficients[pair_count:].reshape(-1, inputs),
    )
    root_mass = np.sqrt(structure.mass_scale)
    # A mode has a single participation vector: the dominant direction of the estimated matrices, to which further
    # sensors' shapes are then fitted.
    direction = (
        np.linalg.svd(np.concatenate([mass_matrix / root_mass**2, sensor_rows]))[2][0]
        if len(sensor_rows)
        else np.linalg.eigh(mass_matrix)[1][:, -1]
    )
    participation = direction * max(
        np.sqrt(max(direction @ mass_matrix @ direction, 0.0)), _MIN_RELATIVE_ROOT_MASS * root_mass
    )
    sensor_shape = sensor_rows @ participation / (participation @ participation)
    log_frequency = np.log(2 * np.pi * frequency_hz / structure.speed_scale)
    mode_unknowns = np.concatenate(
        [[log_frequency, np.log(damping_ratio)], participation / root_mass, sensor_shape * root_mass]
    )
    mode_slice = extended_structure.slices["modes"]
    unknowns[mode_slice.stop - len(mode_unknowns) : mode_slice.stop] = mode_unknowns
    return ModeStart(extended_structure, unknowns, frequency_hz)
