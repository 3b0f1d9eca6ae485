"""Matching of resonances between models that were identified at different places of the workspace.

A pair of modes costs |ln(f1 / f2)| / FREQUENCY_SCALE + 1 - MAC, with the natural frequencies f and the modal assurance
criterion of their residue matrices (MAC; Allemang and Brown, IMAC 1982). The pairs with the least total cost are found
as a linear assignment problem, in which a mode may also stay without a partner at a fixed cost.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.workspace.band_modes import BandMode

FREQUENCY_SCALE = 0.3
"""Change of the natural logarithm of the frequency that costs as much as orthogonal shapes (MAC = 0)."""
UNMATCHED_COST = 0.6
"""Cost of a mode without a partner; a pair is therefore matched only where it costs at most twice as much."""
LEAST_LIKENESS = 0.5
"""Least MAC (0 to 1) of two modes that are matched."""
LEAST_MARGIN = 0.1
"""Least additional cost of the best matching without a pair; below it, the pair is ambiguous."""
WEAK_SHARE = 0.1
"""Share of the response (`BandMode.share`) below which a mode may stay without a partner."""


class ModesDoNotMatchError(ValueError):
    """The resonances of two models cannot be matched unambiguously; the message says why."""


def mode_likeness(first: ComplexArray, second: ComplexArray) -> float:
    """Modal assurance criterion |<a, b>|^2 / (<a, a> <b, b>) of residue matrices (p, m): 1 = proportional with a
    complex factor, 0 = orthogonal, or one of them zero."""
    sizes = float(np.vdot(first, first).real * np.vdot(second, second).real)
    return float(abs(np.vdot(first, second)) ** 2 / sizes) if sizes else 0.0


def match_modes(
    first_modes: Sequence[BandMode], second_modes: Sequence[BandMode], band_hz: tuple[float, float]
) -> tuple[tuple[int, int], ...]:
    """Pairs of indices (first model, second model), in the order of the first model's modes. A weak mode, or one
    outside the band, may stay without a partner.

    Raises ModesDoNotMatchError where a strong mode in the band has no partner, the MAC of a pair is too small, or
    another matching costs nearly as little.
    """
    costs = _assignment_costs(first_modes, second_modes)
    pairs, total = _assign_modes(costs, len(first_modes), len(second_modes))
    for side, modes, matched in ((0, first_modes, {i for i, _ in pairs}), (1, second_modes, {j for _, j in pairs})):
        for index, mode in enumerate(modes):
            if index not in matched and mode.share >= WEAK_SHARE and band_hz[0] <= mode.natural_hz <= band_hz[1]:
                other_model = "second" if side == 0 else "first"
                raise ModesDoNotMatchError(
                    f"the resonance at {mode.natural_hz:.1f} Hz has no partner in the {other_model} model; "
                    "identify a place between"
                )
    for i, j in pairs:
        likeness = mode_likeness(first_modes[i].residue, second_modes[j].residue)
        frequencies = f"{first_modes[i].natural_hz:.1f} Hz and {second_modes[j].natural_hz:.1f} Hz"
        if likeness < LEAST_LIKENESS:
            raise ModesDoNotMatchError(
                f"the resonances at {frequencies} differ in shape (likeness {likeness:.2f}); "
                "identify places nearer to each other"
            )
        forbidden = costs.copy()
        # Far more than leaving both modes without a partner: the assignment avoids this pair.
        forbidden[i, j] = 10.0
        if _assign_modes(forbidden, len(first_modes), len(second_modes))[1] - total < LEAST_MARGIN:
            raise ModesDoNotMatchError(
                f"it is in doubt whether the resonances at {frequencies} are the same one; identify a place between"
            )
    return pairs


def _assignment_costs(first_modes: Sequence[BandMode], second_modes: Sequence[BandMode]) -> FloatArray:
    """(rows + columns, rows + columns): cost of each pair; the rows and columns after the modes of the two models stand
    for the absence of a partner."""
    rows, columns = len(first_modes), len(second_modes)
    costs = np.full((rows + columns, rows + columns), UNMATCHED_COST)
    costs[rows:, columns:] = 0.0
    for i, first in enumerate(first_modes):
        for j, second in enumerate(second_modes):
            frequency_cost = abs(np.log(first.natural_hz / second.natural_hz)) / FREQUENCY_SCALE
            costs[i, j] = frequency_cost + 1 - mode_likeness(first.residue, second.residue)
    return costs


def _assign_modes(costs: FloatArray, rows: int, columns: int) -> tuple[tuple[tuple[int, int], ...], float]:
    """Pairs of modes with the least total cost, and that cost. rows, columns: number of modes of the two models."""
    i, j = linear_sum_assignment(costs)
    pairs = tuple((int(a), int(b)) for a, b in zip(i, j, strict=True) if a < rows and b < columns)
    return pairs, float(costs[i, j].sum())
