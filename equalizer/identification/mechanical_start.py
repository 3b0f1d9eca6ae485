"""Where the fit of a mechanical model starts: least squares on the dynamic stiffness, and where a mode is missing.

A small oscillator changes the response in proportion to its mass, so that a grid over frequency and damping shows what
each would explain once everything else has been adjusted to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.mechanical_lines import SegmentLines
from equalizer.identification.mechanical_misfit import LineGroup, jacobian, misfits, stacked
from equalizer.identification.mechanical_refinement import Refined
from equalizer.identification.mechanical_response import sampled_response, sensor_response
from equalizer.identification.mechanical_structure import Structure, packed_mass, packed_square
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.signals.lockin import ComplexArray
from equalizer.signals.signal import FloatArray

_LEAST_EIGENVALUE = 0.05
_GRID = 60
_RATIOS = (0.01, 0.05, 0.25)
_MOST_ROWS = 6000
_DELAYS = 33
_MOST_DELAY_CYCLES = 8.0
"""Of the highest line."""
_SMALL_START = 0.02
"""Root of an added mass over the whole, where the linear estimate says nothing."""


def rigid_start(segments: Sequence[SegmentLines], structure: Structure, floor: float) -> tuple[Structure, FloatArray]:
    """Unknowns of a structure without modes; in it the signs and scales that the data ask for."""
    m = structure.inputs
    if structure.delayed:
        delays_s = np.linspace(0.0, _MOST_DELAY_CYCLES / float(segments[0].frequency_hz[-1]), _DELAYS)
        solved = [_solved(segments, structure, floor, float(delay_s)) for delay_s in delays_s]
        delay_s = float(delays_s[int(np.argmin([left for _, left in solved]))])
    else:
        delay_s = structure.actuator.delay_s
    parts = _solved(segments, structure, floor, delay_s)[0].reshape(3, -1)
    mass, damping, stiffness = (_symmetric(part, m) for part in parts)
    if m == 1 and mass[0, 0] < 0 and structure.signs == (1.0,):
        return rigid_start(segments, replace(structure, signs=(-1.0,)), floor)
    values, vectors = np.linalg.eigh(mass)
    top = max(float(np.abs(values).max()), 1e-300)
    mass = (vectors * np.maximum(values, _LEAST_EIGENVALUE * top)) @ vectors.T
    structure = replace(structure, mass_scale=float(np.trace(mass) / m))
    units = structure.units
    unknowns = np.zeros(structure.parameters)
    unknowns[structure.slices["delay"]] = delay_s / structure.step_s
    unknowns[structure.slices["mass"]] = packed_mass(mass / units[0])
    unknowns[structure.slices["damping"]] = packed_square(_not_negative(damping) / units[1])
    if structure.grounded:
        unknowns[structure.slices["stiffness"]] = packed_square(_not_negative(stiffness) / units[2])
    if structure.outputs > m:
        unknowns[structure.slices["rows"]] = _other_rows(segments, m).ravel()
    return structure, unknowns


def _solved(
    segments: Sequence[SegmentLines], structure: Structure, floor: float, delay_s: float
) -> tuple[FloatArray, float]:
    """Entries of the three matrices, and the squares that are left."""
    rows, right = _stiffness_rows(segments, structure, floor, delay_s)
    found = _scaled_least_squares(rows, right)
    m = structure.inputs
    return found[: 3 * m * (m + 1) // 2], float(np.sum((right - rows @ found) ** 2))


def _stiffness_rows(
    segments: Sequence[SegmentLines], structure: Structure, floor: float, delay_s: float
) -> tuple[FloatArray, FloatArray]:
    """u = M a + D v + K x, and what a segment's ends add; real rows, weighted by the force's expected error."""
    m, order = structure.inputs, DERIVATIVE_OF_QUANTITY[structure.quantity]
    late_steps = 1.0 if order == 2 else 0.5
    blocks, right = [], []
    transients = [i for i, one in enumerate(segments) if one.transient]
    for number, one in enumerate(segments):
        s = 2j * np.pi * one.frequency_hz
        z = np.exp(s / one.rate_hz)
        late = late_steps if one.hold.value == "zero-order" else 0.0
        shown = sensor_response(structure.sensor.bandwidth_hz, z, one.rate_hz) * z ** (-late)
        shown = shown * np.exp(-s * delay_s)
        moved = one.response[:, :m] * np.array(structure.signs) / shown[:, None]
        size = np.linalg.norm(one.response[:, :m], axis=1)
        noise = np.sqrt(np.nan_to_num(one.noise[:, :m]).sum(axis=1)) / np.maximum(size, 1e-300)
        weight = one.excited / (np.linalg.norm(one.command, axis=1) * np.hypot(5 * floor, noise) + 1e-300)
        columns = [
            _acting(moved * (s ** (power - order))[:, None], one_of) for power in (2, 1, 0) for one_of in _pairs(m)
        ]
        ends = np.zeros((len(s), m, 3 * m * len(transients)), dtype=np.complex128)
        if one.transient:
            for axis in range(m):
                first = 3 * (m * transients.index(number) + axis)
                ends[:, axis, first : first + 3] = s[:, None] ** (np.array([1, 0, -1]) - order)
        block = np.concatenate([np.stack(columns, axis=2), ends], axis=2) * weight[:, None, None]
        blocks.append(block.reshape(-1, block.shape[2]))
        right.append((one.command * weight[:, None]).ravel())
    complex_rows, complex_right = np.concatenate(blocks), np.concatenate(right)
    return (
        np.concatenate([complex_rows.real, complex_rows.imag]),
        np.concatenate([complex_right.real, complex_right.imag]),
    )


def _pairs(m: int) -> list[tuple[int, int]]:
    return list(zip(*(part.tolist() for part in np.tril_indices(m)), strict=True))


def _acting(motion: ComplexArray, pair: tuple[int, int]) -> ComplexArray:
    """(lines, m): force of a unit entry of a symmetric matrix. motion: (lines, m)."""
    force = np.zeros_like(motion)
    row, column = pair
    force[:, row] += motion[:, column]
    if row != column:
        force[:, column] += motion[:, row]
    return force


def _scaled_least_squares(rows: FloatArray, right: FloatArray) -> FloatArray:
    scale = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    return np.asarray(np.linalg.lstsq(rows / scale, right, rcond=1e-12)[0] / scale)


def _symmetric(entries: FloatArray, m: int) -> FloatArray:
    lower = np.zeros((m, m))
    lower[np.tril_indices(m)] = entries
    return np.asarray(lower + np.tril(lower, -1).T)


def _not_negative(matrix: FloatArray) -> FloatArray:
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.maximum(values, 1e-3 * max(np.abs(values).max(), 1e-300))) @ vectors.T)


def _other_rows(segments: Sequence[SegmentLines], m: int) -> FloatArray:
    """(p - m, m): what the other responses see of the driven axes."""
    own = np.concatenate([one.response[:, :m] for one in segments])
    others = np.concatenate([one.response[:, m:] for one in segments])
    return np.asarray(
        np.linalg.lstsq(np.concatenate([own.real, own.imag]), np.concatenate([others.real, others.imag]), rcond=None)[
            0
        ].T
    )


@dataclass(frozen=True, slots=True, eq=False)
class ModeStart:
    structure: Structure
    unknowns: FloatArray
    frequency_hz: float
    explained: float
    """Of the fitted lines' squares, as far as a small mode can tell."""


def mode_starts(
    groups: Sequence[LineGroup], now: Refined[Structure], band_hz: tuple[float, float], most: int = 2
) -> tuple[ModeStart, ...]:
    """The most promising frequencies for one more oscillator, best first."""
    thinned = [_thinned(group.without_left_out(), len(groups)) for group in groups]
    model = now.structure.model(now.unknowns)
    misfit = stacked(misfits(thinned, model))
    known = _known_directions(thinned, now, misfit)
    misfit = misfit - known @ (known.T @ misfit)
    found = []
    for frequency_hz in np.geomspace(band_hz[0] / 1.5, band_hz[1] * 1.5, _GRID):
        for ratio in _RATIOS:
            columns = _mode_columns(thinned, model, now.structure, 2 * np.pi * frequency_hz, ratio)
            columns = columns - known @ (known.T @ columns)
            strengths = _scaled_least_squares(columns, misfit)
            explained = float(misfit @ misfit - np.sum((misfit - columns @ strengths) ** 2))
            found.append((explained, float(frequency_hz), ratio, strengths))
    chosen: list[tuple[float, float, float, FloatArray]] = []
    for candidate in sorted(found, key=lambda each: -each[0]):
        if all(abs(np.log(candidate[1] / other[1])) > 0.1 for other in chosen):
            chosen.append(candidate)
    return tuple(_started(now, *candidate) for candidate in chosen[:most])


def _known_directions(groups: Sequence[LineGroup], now: Refined[Structure], misfit: FloatArray) -> FloatArray:
    """Orthonormal: what the present unknowns could still change."""
    high = np.full(now.structure.parameters, np.inf)
    slope = jacobian(
        lambda unknowns: stacked(misfits(groups, now.structure.model(unknowns))), now.unknowns, misfit, high
    )
    return np.asarray(np.linalg.qr(slope / np.maximum(np.linalg.norm(slope, axis=0), 1e-300))[0])


def _thinned(group: LineGroup, groups: int) -> LineGroup:
    rows = 2 * group.target[0].size * len(group.frequency_hz)
    chosen = np.zeros(len(group.frequency_hz), dtype=bool)
    chosen[:: max(1, rows * groups // _MOST_ROWS)] = True
    return group.of(chosen)


def _mode_columns(
    groups: Sequence[LineGroup], model: MechanicalModel, structure: Structure, speed: float, ratio: float
) -> FloatArray:
    """Misfit's change per entry of L Lᵀ (pairs), then per entry of (what a response sees) Lᵀ."""
    m, p = structure.inputs, structure.outputs
    order = DERIVATIVE_OF_QUANTITY[structure.quantity]
    parts = []
    for group in groups:
        s = 2j * np.pi * group.frequency_hz
        z = np.exp(s / group.rate_hz)
        response = sampled_response(model, group.frequency_hz, group.rate_hz, group.hold)
        late = (1.0 if order == 2 else 0.5) if group.hold.value == "zero-order" else 0.0
        shown = sensor_response(model.sensor.bandwidth_hz, z, group.rate_hz) * z ** (-late) * s**order
        moved = response[:, :m] * np.array(structure.signs)[:, None] / shown[:, None, None]
        below = s**2 + 2 * ratio * speed * s + speed**2
        heavier = s**2 * (2 * ratio * speed * s + speed**2) / below
        changes = [
            -heavier[:, None, None] * np.einsum("lp,lm->lpm", response[:, :, row], moved[:, column])
            + (0 if row == column else 1)
            * -heavier[:, None, None]
            * np.einsum("lp,lm->lpm", response[:, :, column], moved[:, row])
            for row, column in _pairs(m)
        ]
        for seen in range(0 if structure.shared else m, p):
            for axis in range(m):
                change = np.zeros_like(response)
                change[:, seen] = (-(s**2) / below * shown)[:, None] * moved[:, axis]
                changes.append(change)
        columns = [-np.einsum("lpem,lpm->lpe", group.root, change) for change in changes]
        parts.append(columns)
    flat = [stacked([part[k] for part in parts]) for k in range(len(parts[0]))]
    return -np.stack(flat, axis=1)


def _started(
    now: Refined[Structure], explained: float, frequency_hz: float, ratio: float, strengths: FloatArray
) -> ModeStart:
    structure, m = now.structure, now.structure.inputs
    grown = replace(structure, modes=structure.modes + 1)
    unknowns = structure.carried_over(now.unknowns, grown)
    pairs = m * (m + 1) // 2
    own, others = _symmetric(strengths[:pairs], m), strengths[pairs:].reshape(-1, m)
    root = np.sqrt(structure.mass_scale)
    # One direction for both: what drives the mode. The other responses count by what they show at the mode itself.
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
