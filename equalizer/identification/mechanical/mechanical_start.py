"""Starting values of a mechanical fit: linear least squares on the dynamic stiffness.

At each spectral line s = j w the command's force u and the motion x of the m driven axes obey

    u = (M s² + D s + K) x + transient

which is linear in the entries of the symmetric matrices M (mass), D (damping) and K (stiffness). The sensor's low pass,
the hold and a trial delay are removed from the measured motion first; the delay with the least residual is kept. The
matrices are then made positive definite, as the nonlinear fit needs.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from equalizer.identification.mechanical.mechanical_lines import SegmentLines
from equalizer.identification.mechanical.mechanical_response import sensor_response
from equalizer.identification.mechanical.mechanical_structure import Structure, pack_mass, pack_square_root
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.signal import ComplexArray, FloatArray

_LEAST_EIGENVALUE = 0.05
"""Least eigenvalue of the starting mass matrix, relative to the largest magnitude of an eigenvalue."""
_DELAYS = 33
"""Number of trial delays, evenly spaced from zero."""
_MOST_DELAY_CYCLES = 8.0
"""Longest trial delay, in periods of the highest line."""


def rigid_start(segments: Sequence[SegmentLines], structure: Structure, floor: float) -> tuple[Structure, FloatArray]:
    """Structure without modes, with the sign and mass scale that the data require, and its unknowns. A single axis with
    a negative mass has a sensor that counts the other way: its sign is reversed. floor: relative error of the response
    that is allowed for besides the noise."""
    m = structure.inputs
    if structure.delayed:
        delays_s = np.linspace(0.0, _MOST_DELAY_CYCLES / float(segments[0].frequency_hz[-1]), _DELAYS)
        trials = [_solve_matrices(segments, structure, floor, float(delay_s)) for delay_s in delays_s]
        delay_s = float(delays_s[int(np.argmin([residual for _, residual in trials]))])
    else:
        delay_s = structure.actuator.delay_s
    parts = _solve_matrices(segments, structure, floor, delay_s)[0].reshape(3, -1)
    mass, damping, stiffness = (symmetric_matrix(part, m) for part in parts)
    if m == 1 and mass[0, 0] < 0 and structure.signs == (1.0,):
        return rigid_start(segments, replace(structure, signs=(-1.0,)), floor)
    values, vectors = np.linalg.eigh(mass)
    largest = max(float(np.abs(values).max()), 1e-300)
    mass = (vectors * np.maximum(values, _LEAST_EIGENVALUE * largest)) @ vectors.T
    structure = replace(structure, mass_scale=float(np.trace(mass) / m))
    units = structure.units
    unknowns = np.zeros(structure.parameters)
    unknowns[structure.slices["delay"]] = delay_s / structure.step_s
    unknowns[structure.slices["mass"]] = pack_mass(mass / units[0])
    unknowns[structure.slices["damping"]] = pack_square_root(_make_positive(damping) / units[1])
    if structure.grounded:
        unknowns[structure.slices["stiffness"]] = pack_square_root(_make_positive(stiffness) / units[2])
    if structure.outputs > m:
        unknowns[structure.slices["rows"]] = _other_rows(segments, m).ravel()
    return structure, unknowns


def _solve_matrices(
    segments: Sequence[SegmentLines], structure: Structure, floor: float, delay_s: float
) -> tuple[FloatArray, float]:
    """Entries of mass, damping and stiffness (lower triangles, row by row), and the weighted residual sum of
    squares."""
    rows, target = _stiffness_rows(segments, structure, floor, delay_s)
    solution = solve_scaled(rows, target)
    m = structure.inputs
    return solution[: 3 * m * (m + 1) // 2], float(np.sum((target - rows @ solution) ** 2))


def _stiffness_rows(
    segments: Sequence[SegmentLines], structure: Structure, floor: float, delay_s: float
) -> tuple[FloatArray, FloatArray]:
    """Regressors (rows, k) and target (rows,) of u = M a + D v + K x plus each segment's transient: real, then
    imaginary parts, divided by the expected error of the force."""
    m, order = structure.inputs, DERIVATIVE_OF_QUANTITY[structure.quantity]
    # A held force shows in the acceleration one sample later, in velocity and position half a sample later.
    delay_steps = 1.0 if order == 2 else 0.5
    blocks, targets = [], []
    transients = [i for i, segment in enumerate(segments) if segment.transient]
    for number, lines in enumerate(segments):
        s = 2j * np.pi * lines.frequency_hz
        z = np.exp(s / lines.rate_hz)
        delay_samples = delay_steps if lines.hold.value == "zero-order" else 0.0
        sensor = sensor_response(structure.sensor.bandwidth_hz, z, lines.rate_hz) * z ** (-delay_samples)
        sensor = sensor * np.exp(-s * delay_s)
        motion = lines.response[:, :m] * np.array(structure.signs) / sensor[:, None]
        size = np.linalg.norm(lines.response[:, :m], axis=1)
        noise = np.sqrt(np.nan_to_num(lines.noise[:, :m]).sum(axis=1)) / np.maximum(size, 1e-300)
        weight = lines.excited / (np.linalg.norm(lines.command, axis=1) * np.hypot(5 * floor, noise) + 1e-300)
        columns = [
            _entry_force(motion * (s ** (power - order))[:, None], pair)
            for power in (2, 1, 0)
            for pair in triangle_pairs(m)
        ]
        transient_columns = np.zeros((len(s), m, 3 * m * len(transients)), dtype=np.complex128)
        if lines.transient:
            # The states at the segment's ends add s, 1, 1 / s, over s^order, times unknown factors.
            for axis in range(m):
                first = 3 * (m * transients.index(number) + axis)
                transient_columns[:, axis, first : first + 3] = s[:, None] ** (np.array([1, 0, -1]) - order)
        block = np.concatenate([np.stack(columns, axis=2), transient_columns], axis=2) * weight[:, None, None]
        blocks.append(block.reshape(-1, block.shape[2]))
        targets.append((lines.command * weight[:, None]).ravel())
    complex_rows, complex_targets = np.concatenate(blocks), np.concatenate(targets)
    return (
        np.concatenate([complex_rows.real, complex_rows.imag]),
        np.concatenate([complex_targets.real, complex_targets.imag]),
    )


def triangle_pairs(m: int) -> list[tuple[int, int]]:
    """Row and column of the m (m + 1) / 2 entries of a lower triangle, row by row."""
    return list(zip(*(part.tolist() for part in np.tril_indices(m)), strict=True))


def _entry_force(motion: ComplexArray, pair: tuple[int, int]) -> ComplexArray:
    """(lines, m): a symmetric matrix with this entry 1 and all others 0, times the motion (lines, m). pair: its row and
    column."""
    force = np.zeros_like(motion)
    row, column = pair
    force[:, row] += motion[:, column]
    if row != column:
        force[:, column] += motion[:, row]
    return force


def solve_scaled(rows: FloatArray, target: FloatArray) -> FloatArray:
    """(k,): least-squares solution of rows (n, k) @ x = target (n,), computed with columns of unit length; singular
    values below 1e-12 of the largest are cut off."""
    scale = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(rows / scale, target, rcond=1e-12)[0] / scale)


def symmetric_matrix(entries: FloatArray, m: int) -> FloatArray:
    """(m, m): symmetric matrix from the m (m + 1) / 2 entries of its lower triangle, row by row."""
    lower = np.zeros((m, m))
    lower[np.tril_indices(m)] = entries
    return np.asarray(lower + np.tril(lower, -1).T)


def _make_positive(matrix: FloatArray) -> FloatArray:
    """The symmetric matrix with its eigenvalues raised to at least 0.001 of the largest magnitude."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.maximum(values, 1e-3 * max(np.abs(values).max(), 1e-300))) @ vectors.T)


def _other_rows(segments: Sequence[SegmentLines], m: int) -> FloatArray:
    """(p - m, m): output rows of the further responses: their least-squares weights on the driven axes' responses."""
    axis_responses = np.concatenate([segment.response[:, :m] for segment in segments])
    further_responses = np.concatenate([segment.response[:, m:] for segment in segments])
    return np.asarray(
        np.linalg.lstsq(
            np.concatenate([axis_responses.real, axis_responses.imag]),
            np.concatenate([further_responses.real, further_responses.imag]),
            rcond=None,
        )[0].T
    )
