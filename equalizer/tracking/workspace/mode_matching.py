"""Matching of resonances between models, by frequency and the modal assurance criterion of their residues."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.workspace.band_modes import BandMode

FREQUENCY_SCALE = 0.3
"""Change of log frequency that costs as much as orthogonal shapes."""
ALONE = 0.6
"""Cost of a mode without a partner; a pair may cost twice as much at most."""
LEAST_LIKENESS = 0.5
"""Least likeness (MAC, 0 to 1) of the shapes of two modes that are matched."""
LEAST_MARGIN = 0.1
"""Smallest difference in cost to the best matching without one of the pairs."""
WEAK = 0.1
"""Share of the response below which a mode without a partner is left to the smooth remainder."""


class ModesDoNotMatchError(ValueError):
    """The resonances of two models cannot be matched with confidence; the text says why."""


def mode_likeness(first: ComplexArray, second: ComplexArray) -> float:
    """Modal assurance criterion of residue matrices (p, m): 1 = equal but for a complex factor, 0 = orthogonal."""
    sizes = float(np.vdot(first, first).real * np.vdot(second, second).real)
    return float(abs(np.vdot(first, second)) ** 2 / sizes) if sizes else 0.0


def match_modes(
    firsts: Sequence[BandMode], seconds: Sequence[BandMode], band_hz: tuple[float, float]
) -> tuple[tuple[int, int], ...]:
    """Pairs of indices, in the order of the first model's modes. A weak mode, or one outside the band, may stay alone.

    Raises ModesDoNotMatchError where a strong mode of the band finds no partner, a pair is unlike, or another matching
    is nearly as good.
    """
    costs = _assignment_costs(firsts, seconds)
    pairs, total = _assign_modes(costs, len(firsts), len(seconds))
    for side, modes, taken in ((0, firsts, {i for i, _ in pairs}), (1, seconds, {j for _, j in pairs})):
        for index, mode in enumerate(modes):
            if index not in taken and mode.share >= WEAK and band_hz[0] <= mode.natural_hz <= band_hz[1]:
                where = "second" if side == 0 else "first"
                raise ModesDoNotMatchError(
                    f"the resonance at {mode.natural_hz:.1f} Hz has no partner in the {where} model; "
                    "identify a place between"
                )
    for i, j in pairs:
        likeness = mode_likeness(firsts[i].residue, seconds[j].residue)
        named = f"{firsts[i].natural_hz:.1f} Hz and {seconds[j].natural_hz:.1f} Hz"
        if likeness < LEAST_LIKENESS:
            raise ModesDoNotMatchError(
                f"the resonances at {named} differ in shape (likeness {likeness:.2f}); "
                "identify places nearer to each other"
            )
        forbidden = costs.copy()
        forbidden[i, j] = 10.0
        if _assign_modes(forbidden, len(firsts), len(seconds))[1] - total < LEAST_MARGIN:
            raise ModesDoNotMatchError(
                f"it is in doubt whether the resonances at {named} are the same one; identify a place between"
            )
    return pairs


def _assignment_costs(firsts: Sequence[BandMode], seconds: Sequence[BandMode]) -> FloatArray:
    """Square cost matrix; further rows and columns mean having no partner."""
    rows, columns = len(firsts), len(seconds)
    costs = np.full((rows + columns, rows + columns), ALONE)
    costs[rows:, columns:] = 0.0
    for i, each in enumerate(firsts):
        for j, other in enumerate(seconds):
            moved = abs(np.log(each.natural_hz / other.natural_hz)) / FREQUENCY_SCALE
            costs[i, j] = moved + 1 - mode_likeness(each.residue, other.residue)
    return costs


def _assign_modes(costs: FloatArray, rows: int, columns: int) -> tuple[tuple[tuple[int, int], ...], float]:
    i, j = linear_sum_assignment(costs)
    pairs = tuple((int(a), int(b)) for a, b in zip(i, j, strict=True) if a < rows and b < columns)
    return pairs, float(costs[i, j].sum())
