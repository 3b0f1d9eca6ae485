"""Trends of distortion with level, which indicate a kind of physics before any fit.

Relative to the linear response, distortion by friction and dead zones falls with the level; by nonlinear stiffness and
drag it rises; by saturation it rises from nothing; by position-dependent forces it stays. Timing errors increase the
variation between periods; external noise does not depend on the level.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.data.spectral_lines import Band
from analysis.diagnosis.limits import DISTORTION_P, STEADY_DB
from analysis.diagnosis.localisation.distortion import Distortion, Kind
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

_LEAST_AMPLITUDE = 1e-300
"""Lower limit of an amplitude, so that its logarithm is finite."""


@dataclass(frozen=True, slots=True)
class LevelTrend:
    """Distortion of one kind in an output, for an input and a band (Hz), and its change with the level of excitation.
    Names, band and kind are as in `Distortion`."""

    output: str
    quantity: str
    input: str
    band_hz: Band
    whole_band: bool
    """True: the whole driven band; False: one octave of it."""
    kind: Kind
    p_value: float
    """p-value of no distortion: the smallest over the segments times their number (Bonferroni)."""
    db_per_doubling: float | None
    """Slope of the relative distortion with the level, dB per doubling; None where it is not known, see
    `_estimate_slope`."""
    from_nothing: bool
    """Whether it is not significant at the lowest level, but at another."""

    @property
    def present(self) -> bool:
        """Whether the distortion is significant: `p_value` below `DISTORTION_P`."""
        return self.p_value < DISTORTION_P

    @property
    def level_dependence(self) -> str:
        """Name of the trend: "falls", "rises", "rises from nothing", "stays", or "" where it is unknown."""
        if not self.present or self.db_per_doubling is None:
            return ""
        if abs(self.db_per_doubling) < STEADY_DB:
            return "stays"
        if self.db_per_doubling < 0:
            return "falls"
        return "rises from nothing" if self.from_nothing else "rises"


def compute_level_trends(cells: Sequence[Distortion]) -> tuple[LevelTrend, ...]:
    """Compute the trend of each output, input, band and kind. cells: distortions at all levels."""
    cells_by_group: dict[tuple[object, ...], list[Distortion]] = {}
    for cell in cells:
        # Realisations differ slightly in the whole band that they drive.
        band = None if cell.whole_band else cell.band_hz
        group = cell.output, cell.quantity, cell.input, band, cell.kind
        cells_by_group.setdefault(group, []).append(cell)
    return tuple(
        _compute_trend(sorted(group_cells, key=lambda cell: cell.amplitude)) for group_cells in cells_by_group.values()
    )


def _compute_trend(cells: Sequence[Distortion]) -> LevelTrend:
    """Compute the trend of distortions that differ in their level only, by rising level."""
    distortion_rms = np.array([max(cell.rms, cell.limit_rms) for cell in cells])
    signal_rms = np.array([cell.signal_rms for cell in cells])
    levels = np.array([cell.amplitude for cell in cells])
    relative_db = 20 * np.log10(np.maximum(distortion_rms, _LEAST_AMPLITUDE) / np.maximum(signal_rms, _LEAST_AMPLITUDE))
    p_value = min(1.0, min(cell.p_value for cell in cells) * len(cells))
    is_significant = np.array([cell.p_value < DISTORTION_P for cell in cells])
    slope = _estimate_slope(levels, relative_db, np.array([cell.lines for cell in cells]), is_significant)
    band_hz = min(cell.band_hz[0] for cell in cells), max(cell.band_hz[1] for cell in cells)
    from_nothing = bool(is_significant.any() and not is_significant[0])
    any_cell = cells[0]
    return LevelTrend(
        any_cell.output, any_cell.quantity, any_cell.input, band_hz, any_cell.whole_band, any_cell.kind,
        p_value, slope, from_nothing,
    )  # fmt: skip


def _estimate_slope(
    levels: FloatArray, relative_db: FloatArray, line_counts: FloatArray, is_significant: Mask
) -> float | None:
    """Estimate the slope in dB per doubling of the level; None where nothing is significant, a level is not above 0, or
    fewer than two levels can be compared. Where the distortion is not significant at a level, the detection limit takes
    its place, and bounds the slope: from below at the lowest level, from above at the highest. A bound that does not
    show a trend is not used: the slope is then that of the significant levels."""
    if not is_significant.any() or not (levels > 0).all() or len(set(levels)) < 2:
        return None
    bounded_slope = _regress_slope(np.log2(levels), relative_db, line_counts)
    is_rising = bounded_slope > STEADY_DB and not is_significant[0]
    is_falling = bounded_slope < -STEADY_DB and not is_significant[-1]
    if is_significant.all() or is_rising or is_falling:
        return bounded_slope
    return (
        _regress_slope(np.log2(levels[is_significant]), relative_db[is_significant], line_counts[is_significant])
        if len(set(levels[is_significant])) > 1
        else None
    )


def _regress_slope(doublings: FloatArray, relative_db: FloatArray, line_counts: FloatArray) -> float:
    """Regress the slope in dB per doubling of the level: linear regression, weighted by the number of lines. doublings:
    log2 of the levels."""
    centred_doublings = doublings - np.average(doublings, weights=line_counts)
    return float(np.sum(line_counts * centred_doublings * relative_db)) / float(
        np.sum(line_counts * centred_doublings**2)
    )
