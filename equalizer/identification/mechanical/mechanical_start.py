"""Starting values of a mechanical fit: linear least squares on the dynamic stiffness.

At each spectral line s = j w the command's force u and the motion x of the m driven axes obey

    u = (M s² + D s + K) x + transient

which is linear in the entries of the symmetric matrices M (mass), D (damping) and K (stiffness). The sensor's low pass,
the hold and the delay are removed from the measured motion first; of the trial delays, where the delay is to be
estimated, that with the least residual is kept. The noise of x enters the equation times the dynamic stiffness
M s² + D s + K: each equation is weighted by that of the previous solution, again and again (Sanathanan and Koerner,
IEEE Trans. Autom. Control 8:56 (1963)), because lines without motion would bias the solution towards zero. The matrices
are then made positive definite, as the nonlinear fit needs.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from equalizer.identification.frequency_response.noise_floor import smooth_over_lines
from equalizer.identification.mechanical.mechanical_lines import SMOOTHING_LINES, SegmentLines
from equalizer.identification.mechanical.mechanical_response import compute_sensor_response
from equalizer.identification.mechanical.mechanical_structure import Structure, pack_mass, pack_square_root
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.signal import ComplexArray, FloatArray

_LEAST_EIGENVALUE = 0.05
"""Least eigenvalue of the starting mass matrix, relative to the largest magnitude of an eigenvalue. Chosen."""
_TRIAL_DELAY_COUNT = 33
"""Number of trial delays, evenly spaced from zero. Chosen."""
_REWEIGHTINGS = 10
"""Largest number of solutions with weights of the previous one; they end once no entry changes by a thousandth. Chosen:
four or five suffice on simulated devices."""
_MAX_DELAY_CYCLES = 8.0
"""Longest trial delay, in periods of the highest line of the first segment. Chosen."""
_LEAST_ERROR_SHARE = 1e-6
"""Least expected error of a line, relative to that of any other: without a command it is 0. Chosen."""


def estimate_rigid_starts(
    segments: Sequence[SegmentLines], structure: Structure, floor: float
) -> list[tuple[Structure, FloatArray]]:
    """Estimate a structure without modes, its mass scale, and its unknowns (parameters,). A negative mass of a single
    axis is that of a sensor that is positive against the command, or is due to noise or other physics in this band:
    then a start with the reversed sign follows. The delay is estimated where `structure.delayed`. floor: expected error
    of a linear model, relative to the response's magnitude."""
    m = structure.inputs
    if structure.delayed:
        delays_s = np.linspace(0.0, _MAX_DELAY_CYCLES / float(segments[0].frequency_hz[-1]), _TRIAL_DELAY_COUNT)
        weights = np.concatenate([_compute_weights(spectra, m, floor).ravel() for spectra in segments])
        residuals = [
            _solve_weighted(*_build_regression(segments, structure, float(delay_s)), weights)[1] for delay_s in delays_s
        ]
        delay_s = float(delays_s[int(np.argmin(residuals))])
    else:
        delay_s = structure.actuator.delay_s
    triangles = _solve_with_reweighting(segments, structure, floor, delay_s).reshape(3, -1)
    starts = [_make_start(segments, structure, triangles, delay_s)]
    if m == 1 and triangles[0, 0] < 0 and structure.signs == (1.0,):
        starts.append(_make_start(segments, replace(structure, signs=(-1.0,)), -triangles, delay_s))
    return starts


def _make_start(
    segments: Sequence[SegmentLines], structure: Structure, triangles: FloatArray, delay_s: float
) -> tuple[Structure, FloatArray]:
    """Make the structure with its mass scale, and its unknowns (parameters,). triangles: (3, m (m + 1) / 2), entries of
    mass, damping and stiffness, which are made positive definite; delay_s: delay of the command."""
    m = structure.inputs
    mass, damping, stiffness = (build_symmetric_matrix(triangle, m) for triangle in triangles)
    eigenvalues, eigenvectors = np.linalg.eigh(mass)
    largest_eigenvalue = max(float(np.abs(eigenvalues).max()), 1e-300)
    mass = (eigenvectors * np.maximum(eigenvalues, _LEAST_EIGENVALUE * largest_eigenvalue)) @ eigenvectors.T
    structure = replace(structure, mass_scale=float(np.trace(mass) / m))
    unit_scales = structure.units
    unknowns = np.zeros(structure.parameters)
    unknowns[structure.slices["delay"]] = delay_s / structure.step_s
    unknowns[structure.slices["mass"]] = pack_mass(mass / unit_scales[0])
    unknowns[structure.slices["damping"]] = pack_square_root(_make_positive(damping) / unit_scales[1])
    if structure.grounded:
        unknowns[structure.slices["stiffness"]] = pack_square_root(_make_positive(stiffness) / unit_scales[2])
    if structure.outputs > m:
        # The rows apply to the axes' motions, of which the axes' own sensors may measure the negative.
        rows = _fit_further_output_rows(segments, m) * np.array(structure.signs)
        unknowns[structure.slices["rows"]] = rows.ravel()
    return structure, unknowns


def _solve_with_reweighting(
    segments: Sequence[SegmentLines], structure: Structure, floor: float, delay_s: float
) -> FloatArray:
    """Solve for the entries of mass, damping and stiffness, lower triangles, row by row, with weights of the previous
    solution."""
    m = structure.inputs
    entry_count = 3 * m * (m + 1) // 2
    rows, target = _build_regression(segments, structure, delay_s)
    weights = np.concatenate([_compute_weights(spectra, m, floor).ravel() for spectra in segments])
    entries = _solve_weighted(rows, target, weights)[0][:entry_count]
    for _ in range(_REWEIGHTINGS):
        previous_entries = entries
        matrices = [build_symmetric_matrix(triangle, m) for triangle in entries.reshape(3, -1)]
        weights = np.concatenate(
            [
                _compute_weights(spectra, m, floor, _compute_force_noise(spectra, structure, matrices)).ravel()
                for spectra in segments
            ]
        )
        entries = _solve_weighted(rows, target, weights)[0][:entry_count]
        if np.allclose(entries, previous_entries, rtol=1e-3, atol=0.0):
            break
    return entries


def _solve_weighted(rows: ComplexArray, target: ComplexArray, weights: FloatArray) -> tuple[FloatArray, float]:
    """Solve rows (n, k) @ x = target (n,), times weights (n,), for real x; also returns the weighted residual sum of
    squares."""
    weighted_rows, weighted_target = rows * weights[:, None], target * weights
    real_rows = np.concatenate([weighted_rows.real, weighted_rows.imag])
    real_target = np.concatenate([weighted_target.real, weighted_target.imag])
    solution = solve_scaled(real_rows, real_target)
    return solution, float(np.sum((real_target - real_rows @ solution) ** 2))


def _build_regression(
    segments: Sequence[SegmentLines], structure: Structure, delay_s: float
) -> tuple[ComplexArray, ComplexArray]:
    """Build regressors (rows, k) and target (rows,) of u = M a + D v + K x plus each segment's transient: a row per
    segment, line and axis. delay_s: delay of the command that is removed."""
    m, order = structure.inputs, DERIVATIVE_OF_QUANTITY[structure.quantity]
    blocks, targets = [], []
    transient_segments = [i for i, segment in enumerate(segments) if segment.transient]
    for index, spectra in enumerate(segments):
        s = 2j * np.pi * spectra.frequency_hz
        sensor_path = _compute_sensor_path(spectra, structure) * np.exp(-s * delay_s)
        motion = spectra.response[:, :m] * np.array(structure.signs) / sensor_path[:, None]
        columns = [
            _compute_entry_force(motion * (s ** (power - order))[:, None], pair)
            for power in (2, 1, 0)
            for pair in list_triangle_pairs(m)
        ]
        transient_columns = np.zeros((len(s), m, 3 * m * len(transient_segments)), dtype=np.complex128)
        if spectra.transient:
            # The states at the segment's ends add s, 1, 1 / s, over s^order, times unknown factors.
            for axis in range(m):
                first_column = 3 * (m * transient_segments.index(index) + axis)
                transient_columns[:, axis, first_column : first_column + 3] = s[:, None] ** (
                    np.array([1, 0, -1]) - order
                )
        block = np.concatenate([np.stack(columns, axis=2), transient_columns], axis=2)
        blocks.append(block.reshape(-1, block.shape[2]))
        targets.append(spectra.command.ravel())
    return np.concatenate(blocks), np.concatenate(targets)


def _compute_sensor_path(spectra: SegmentLines, structure: Structure) -> ComplexArray:
    """Compute the response (lines,) of the sensor's low pass and of the hold: a held force shows in the acceleration
    one sample later, in velocity and position half a sample later."""
    hold_delay = 1.0 if DERIVATIVE_OF_QUANTITY[structure.quantity] == 2 else 0.5
    delay_samples = hold_delay if spectra.hold.value == "zero-order" else 0.0
    z = np.exp(2j * np.pi * spectra.frequency_hz / spectra.rate_hz)
    response = compute_sensor_response(structure.sensor.bandwidth_hz, z, spectra.rate_hz)
    return np.asarray(response * z ** (-delay_samples))


def _compute_force_noise(spectra: SegmentLines, structure: Structure, matrices: Sequence[FloatArray]) -> FloatArray:
    """Compute the rms force (lines, m) that the noise of the motion stands for, by mass, damping and stiffness (m, m)
    of `matrices`; noise that is not known counts as 0."""
    s = 2j * np.pi * spectra.frequency_hz
    order = DERIVATIVE_OF_QUANTITY[structure.quantity]
    stiffness = sum(matrix * (s ** (2 - i - order))[:, None, None] for i, matrix in enumerate(matrices))
    path_power = np.abs(_compute_sensor_path(spectra, structure)) ** 2
    noise = np.nan_to_num(spectra.noise[:, : structure.inputs]) / path_power[:, None]
    return np.asarray(np.sqrt(np.einsum("lij,lj->li", np.abs(stiffness) ** 2, noise)))


def _compute_weights(spectra: SegmentLines, m: int, floor: float, force_noise: FloatArray | None = None) -> FloatArray:
    """Compute 1 / expected error of the force (lines, m), zero at lines that are not excited; m: number of driven axes.

    The expected error includes five times `floor` (chosen): lines with little noise then do not dominate. With a
    transient, the command's magnitude is that of the lines around: a line without a command of its own has the
    transient's error, too. force_noise: from `_compute_force_noise`; None: by the ratio of noise to response."""
    command_norm = np.linalg.norm(spectra.command, axis=1)[:, None]
    if spectra.transient:
        command_norm = np.sqrt(smooth_over_lines(command_norm**2, SMOOTHING_LINES))
    if force_noise is None:
        response_norm = np.linalg.norm(spectra.response[:, :m], axis=1)
        noise_ratio = np.sqrt(np.nan_to_num(spectra.noise[:, :m]).sum(axis=1)) / np.maximum(response_norm, 1e-300)
        force_noise = np.repeat(command_norm * noise_ratio[:, None], m, axis=1)
    expected_error = np.hypot(5 * floor * command_norm, force_noise)
    least_error = max(_LEAST_ERROR_SHARE * float(expected_error.max(initial=0.0)), 1e-300)
    return np.asarray(spectra.excited[:, None] / np.maximum(expected_error, least_error))


def list_triangle_pairs(m: int) -> list[tuple[int, int]]:
    """List row and column of the m (m + 1) / 2 entries of a lower triangle, row by row."""
    return [(row, column) for row in range(m) for column in range(row + 1)]


def _compute_entry_force(motion: ComplexArray, pair: tuple[int, int]) -> ComplexArray:
    """Compute the force (lines, m) of a symmetric matrix with entry `pair` (row, column) 1 and all others 0, times the
    motion (lines, m)."""
    force = np.zeros_like(motion)
    row, column = pair
    force[:, row] += motion[:, column]
    if row != column:
        force[:, column] += motion[:, row]
    return force


def solve_scaled(rows: FloatArray, target: FloatArray) -> FloatArray:
    """Solve rows (n, k) @ x = target (n,) for x (k,) by least squares, computed with columns of unit length; singular
    values below 1e-12 of the largest are cut off."""
    scale = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(rows / scale, target, rcond=1e-12)[0] / scale)


def build_symmetric_matrix(entries: FloatArray, m: int) -> FloatArray:
    """Build a symmetric matrix (m, m) from the m (m + 1) / 2 entries of its lower triangle, row by row."""
    lower = np.zeros((m, m))
    lower[np.tril_indices(m)] = entries
    return np.asarray(lower + np.tril(lower, -1).T)


def _make_positive(matrix: FloatArray) -> FloatArray:
    """Raise the eigenvalues of a symmetric matrix to at least 0.001 (chosen) of the largest magnitude."""
    eigenvalues, eigenvectors = np.linalg.eigh(matrix)
    return np.asarray(
        (eigenvectors * np.maximum(eigenvalues, 1e-3 * max(np.abs(eigenvalues).max(), 1e-300))) @ eigenvectors.T
    )


def _fit_further_output_rows(segments: Sequence[SegmentLines], m: int) -> FloatArray:
    """Fit the output rows (p - m, m) of the further responses: their least-squares weights on the driven axes'
    responses."""
    axis_responses = np.concatenate([segment.response[:, :m] for segment in segments])
    further_responses = np.concatenate([segment.response[:, m:] for segment in segments])
    return np.asarray(
        np.linalg.lstsq(
            np.concatenate([axis_responses.real, axis_responses.imag]),
            np.concatenate([further_responses.real, further_responses.imag]),
            rcond=None,
        )[0].T
    )
