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
"""Change of the natural logarithm of the frequency that costs as much as orthogonal shapes (MAC = 0). Chosen."""
UNMATCHED_COST = 0.6
"""Cost of a mode without a partner; a pair is therefore matched only where it costs at most twice as much. Chosen."""
LEAST_MAC = 0.5
"""Least MAC (0 to 1) of two modes that are matched. Chosen."""
LEAST_COST_MARGIN = 0.1
"""Least additional cost of the best matching without a given pair; below it, the pair counts as ambiguous.
Heuristic."""
WEAK_SHARE = 0.1
"""Share of the response (`BandMode.share`) below which a mode may stay without a partner. Chosen."""


class ModesDoNotMatchError(ValueError):
    """The resonances of two models cannot be matched unambiguously; the message says why."""


def compute_modal_assurance(first_residue: ComplexArray, second_residue: ComplexArray) -> float:
    """Compute the modal assurance criterion |<a, b>|^2 / (<a, a> <b, b>) of residue matrices (p, m): 1 = proportional
    with a complex factor, 0 = orthogonal, or one of them zero."""
    norm_product = float(np.vdot(first_residue, first_residue).real * np.vdot(second_residue, second_residue).real)
    return float(abs(np.vdot(first_residue, second_residue)) ** 2 / norm_product) if norm_product else 0.0


def match_modes(
    first_modes: Sequence[BandMode], second_modes: Sequence[BandMode], band_hz: tuple[float, float]
) -> tuple[tuple[int, int], ...]:
    """Match the modes of two models: pairs of indices (first model, second model), in the order of the first model's
    modes. A weak mode, or one outside the band, may stay without a partner.

    Raises ModesDoNotMatchError where a strong mode in the band has no partner, the MAC of a pair is too small, or
    another matching costs nearly as little.
    """
    costs = _compute_assignment_costs(first_modes, second_modes)
    pairs, total_cost = _assign_modes(costs, len(first_modes), len(second_modes))
    for model_index, model_modes, matched_indices in (
        (0, first_modes, {i for i, _ in pairs}),
        (1, second_modes, {j for _, j in pairs}),
    ):
        for index, mode in enumerate(model_modes):
            if (
                index not in matched_indices
                and mode.share >= WEAK_SHARE
                and band_hz[0] <= mode.natural_hz <= band_hz[1]
            ):
                other_model = "second" if model_index == 0 else "first"
                raise ModesDoNotMatchError(
                    f"the resonance at {mode.natural_hz:.1f} Hz has no partner in the {other_model} model; "
                    "identify a place between"
                )
    for i, j in pairs:
        mac = compute_modal_assurance(first_modes[i].residue, second_modes[j].residue)
        pair_text = f"{first_modes[i].natural_hz:.1f} Hz and {second_modes[j].natural_hz:.1f} Hz"
        if mac < LEAST_MAC:
            raise ModesDoNotMatchError(
                f"the resonances at {pair_text} differ in shape (MAC {mac:.2f}); identify places nearer to each other"
            )
        costs_without_pair = costs.copy()
        # Far more than leaving both modes without a partner: the assignment avoids this pair.
        costs_without_pair[i, j] = 10.0
        if _assign_modes(costs_without_pair, len(first_modes), len(second_modes))[1] - total_cost < LEAST_COST_MARGIN:
            raise ModesDoNotMatchError(
                f"it is in doubt whether the resonances at {pair_text} are the same one; identify a place between"
            )
    return pairs


def _compute_assignment_costs(first_modes: Sequence[BandMode], second_modes: Sequence[BandMode]) -> FloatArray:
    """Compute the cost of each pair, (r + c, r + c), for r modes of the first and c of the second model; the rows and
    columns after the modes stand for the absence of a partner."""
    first_count, second_count = len(first_modes), len(second_modes)
    costs = np.full((first_count + second_count, first_count + second_count), UNMATCHED_COST)
    costs[first_count:, second_count:] = 0.0
    for i, first_mode in enumerate(first_modes):
        for j, second_mode in enumerate(second_modes):
            frequency_cost = abs(np.log(first_mode.natural_hz / second_mode.natural_hz)) / FREQUENCY_SCALE
            costs[i, j] = frequency_cost + 1 - compute_modal_assurance(first_mode.residue, second_mode.residue)
    return costs


def _assign_modes(costs: FloatArray, first_count: int, second_count: int) -> tuple[tuple[tuple[int, int], ...], float]:
    """Find the pairs of modes with the least total cost, and that cost. first_count, second_count: number of
    modes of each model; costs as in `_compute_assignment_costs`."""
    row_indices, column_indices = linear_sum_assignment(costs)
    pairs = tuple(
        (int(row), int(column))
        for row, column in zip(row_indices, column_indices, strict=True)
        if row < first_count and column < second_count
    )
    return pairs, float(costs[row_indices, column_indices].sum())
