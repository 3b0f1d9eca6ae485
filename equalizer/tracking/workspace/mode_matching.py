"""Which resonance of one model is which of another: by frequency and by the likeness of residue matrices."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from equalizer.signals.lockin import ComplexArray
from equalizer.signals.signal import FloatArray
from equalizer.tracking.workspace.band_modes import BandMode

FREQUENCY_SCALE = 0.3
"""So large a change of log frequency counts as much as shapes that have nothing in common."""
ALONE = 0.6
"""Cost of a mode without a partner; two of them may cost as much as a pair does at most."""
LEAST_LIKENESS = 0.5
LEAST_MARGIN = 0.1
"""By so much must the matching be better than the best one without one of its pairs."""
WEAK = 0.1
"""Share of the response below which a mode without a partner is left to the smooth remainder."""


class ModesDoNotMatchError(ValueError):
    """The resonances of two models cannot be told to be the same ones; the text says why."""


def mode_likeness(one: ComplexArray, other: ComplexArray) -> float:
    """Modal assurance criterion of residue matrices (p, m): 1 = alike but for a complex factor, 0 = orthogonal."""
    sizes = float(np.vdot(one, one).real * np.vdot(other, other).real)
    return float(abs(np.vdot(one, other)) ** 2 / sizes) if sizes else 0.0


def matched_modes(
    ones: Sequence[BandMode], others: Sequence[BandMode], band_hz: tuple[float, float]
) -> tuple[tuple[int, int], ...]:
    """Pairs of indices, by the first. A mode that is weak, or outside the band, may stay alone.

    Raises ModesDoNotMatchError where a strong mode of the band finds no partner, a pair is unlike, or another matching
    is nearly as good.
    """
    costs = _costs(ones, others)
    pairs, total = _assigned(costs, len(ones), len(others))
    for side, modes, taken in ((0, ones, {i for i, _ in pairs}), (1, others, {j for _, j in pairs})):
        for index, mode in enumerate(modes):
            if index not in taken and mode.share >= WEAK and band_hz[0] <= mode.natural_hz <= band_hz[1]:
                where = "second" if side == 0 else "first"
                raise ModesDoNotMatchError(
                    f"the resonance at {mode.natural_hz:.1f} Hz has no partner in the {where} model"
                )
    for i, j in pairs:
        likeness = mode_likeness(ones[i].residue, others[j].residue)
        named = f"{ones[i].natural_hz:.1f} Hz and {others[j].natural_hz:.1f} Hz"
        if likeness < LEAST_LIKENESS:
            raise ModesDoNotMatchError(f"the resonances at {named} differ in shape (likeness {likeness:.2f})")
        forbidden = costs.copy()
        forbidden[i, j] = 10.0
        if _assigned(forbidden, len(ones), len(others))[1] - total < LEAST_MARGIN:
            raise ModesDoNotMatchError(f"it is in doubt whether the resonances at {named} are the same one")
    return pairs


def _costs(ones: Sequence[BandMode], others: Sequence[BandMode]) -> FloatArray:
    """Square: further rows and columns stand for having no partner."""
    rows, columns = len(ones), len(others)
    costs = np.full((rows + columns, rows + columns), ALONE)
    costs[rows:, columns:] = 0.0
    for i, each in enumerate(ones):
        for j, other in enumerate(others):
            moved = abs(np.log(each.natural_hz / other.natural_hz)) / FREQUENCY_SCALE
            costs[i, j] = moved + 1 - mode_likeness(each.residue, other.residue)
    return costs


def _assigned(costs: FloatArray, rows: int, columns: int) -> tuple[tuple[tuple[int, int], ...], float]:
    i, j = linear_sum_assignment(costs)
    pairs = tuple((int(a), int(b)) for a, b in zip(i, j, strict=True) if a < rows and b < columns)
    return pairs, float(costs[i, j].sum())
