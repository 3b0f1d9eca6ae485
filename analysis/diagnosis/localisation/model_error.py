"""A model's typical error on held-out data, by channel and band, beyond which a mismatch is significant.

No model is exact, and its error does not follow from the noise. The residual in a cell is therefore modelled as noise
plus model error, both random, with the error's power a share of the signal's that varies slowly with frequency. The
share is learned from the held-out cells of the most complete model, of the same channel, in the same octave and those
beside it: other levels, other axes, other recordings. Its robust estimate is the median, so that a mismatch at one
level or in one octave does not raise its own reference.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc

from analysis.diagnosis.data.frequency_cells import Band
from analysis.diagnosis.localisation.mismatch_cells import MismatchCell, adjust_for_cells

BESIDE = 2.1
"""Ratio of two octaves' lower ends up to which they are the same or neighbours."""


@dataclass(frozen=True, slots=True)
class _HeldOutShare:
    fold: tuple[int, str, float]
    """Key of a cell: part, input and level."""
    band_hz: Band
    share: float


@dataclass(frozen=True, slots=True, eq=False)
class ModelError:
    """Held-out mismatch as shares of the signal, from which the usual error near a cell follows."""

    held: Mapping[tuple[str, str], tuple[_HeldOutShare, ...]]
    """Held-out shares by (channel, quantity)."""

    def of(self, cell: MismatchCell) -> tuple[float, int]:
        """Expected square of the cell's share, from other cells near it, and their number; 0 and 0 without any."""
        near = [
            held.share**2
            for held in self.held.get((cell.output, cell.quantity), ())
            if 1 / BESIDE < held.band_hz[0] / cell.band_hz[0] < BESIDE
            and (held.fold, held.band_hz) != (_fold(cell), cell.band_hz)
        ]
        # The power of one line is exponentially distributed, with a median of ln 2 times its mean.
        return (float(np.median(near) / np.log(2)), len(near)) if near else (0.0, 0)

    def typical(self) -> Mapping[tuple[str, str], float]:
        """Median share over all cells, by (channel, quantity)."""
        return {channel: float(np.median([held.share for held in all_])) for channel, all_ in self.held.items()}


def model_error(held_out: Sequence[MismatchCell]) -> ModelError:
    """held_out: cells of samples that nothing was fitted to, of the most complete model."""
    found: dict[tuple[str, str], list[_HeldOutShare]] = {}
    for cell in held_out:
        found.setdefault((cell.output, cell.quantity), []).append(_HeldOutShare(_fold(cell), cell.band_hz, cell.share))
    return ModelError({channel: tuple(held) for channel, held in found.items()})


def adjust_for_model_error(cells: Sequence[MismatchCell], error: ModelError) -> tuple[MismatchCell, ...]:
    """The cells with p-values against noise and model error together; `beyond_noise` is kept."""
    return adjust_for_cells([replace(cell, p_value=_p_value(cell, error)) for cell in cells])


def _p_value(cell: MismatchCell, error: ModelError) -> float:
    """p-value of an F ratio of two sums of powers, each with the degrees of freedom of a chi-squared variable of its
    mean and variance (Satterthwaite 1946). The model error in the cell has the degrees of freedom of a single line."""
    share, count = error.of(cell)
    erred = share * cell.signal_in_noise
    if not count or erred <= 0:
        return cell.p_value
    expected = 1 + erred
    own = 2 * expected**2 / (1 / cell.lines + erred**2)
    known = 2 * expected**2 / (2 / cell.freedom + erred**2 / (count * np.log(2) ** 2))
    return max(float(fdtrc(own, known, cell.in_noise**2 / expected)), cell.p_value)


def _fold(cell: MismatchCell) -> tuple[int, str, float]:
    return cell.part, cell.input, cell.amplitude
