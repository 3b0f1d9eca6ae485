"""Convert significant mismatch cells and regions of state to rows of the diagnosis document (`Mismatch`).

Cells are those of `mismatch_cells`, regions those of `state_regions`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.spectral_lines import Band
from analysis.diagnosis.document import Mismatch
from analysis.diagnosis.limits import FALSE_DISCOVERY_RATE
from analysis.diagnosis.localisation.mismatch_cells import MismatchCell
from analysis.diagnosis.localisation.state_regions import StateRegion

MOST_ROWS = 40
"""Largest number of rows of the table of mismatches. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class StateMismatch:
    """A region of state in which a mismatch is large, with the mismatch's output channel, driving inputs and band
    (Hz)."""

    output: str
    input: str
    band_hz: Band
    region: StateRegion


def list_mismatch_rows(
    cells: Sequence[MismatchCell], states: Sequence[StateMismatch] = (), limit: int = MOST_ROWS
) -> tuple[Mismatch, ...]:
    """List the significant rows, at most `limit`: first regions of state, by the share of the mismatch power that they
    contain; then cells, by their rms mismatch relative to the channel's rms signal over all bands. A row names no part
    of a recording: cells of several parts that differ in nothing else are one row (`_merge_parts`). `share` of a cell's
    row is relative to the signal within the cell (rms, at most 1), which is large in bands without signal and has
    little meaning by itself."""
    significant_states = [state for state in states if state.region.p_value <= FALSE_DISCOVERY_RATE]
    significant_cells = _merge_parts([cell for cell in cells if cell.significant])
    channel_rms = _compute_channel_rms(_merge_parts(cells))
    significant_states.sort(key=lambda state: (-state.region.share, state.region.p_value))
    significant_cells.sort(key=lambda cell: (-cell.rms / channel_rms[_identify_channel(cell)], cell.adjusted_p_value))
    return (*map(_make_state_row, significant_states), *map(_make_cell_row, significant_cells))[:limit]


def _merge_parts(cells: Sequence[MismatchCell]) -> list[MismatchCell]:
    """Merge the cells of all parts (records) with the same channel, input, band and level: powers of mismatch and
    signal are averaged by duration; the p-value is the least, which is adjusted for the number of parts."""
    groups: dict[tuple[object, ...], list[MismatchCell]] = {}
    for cell in cells:
        groups.setdefault((*_identify_channel(cell), cell.input, cell.band_hz, cell.amplitude), []).append(cell)
    return [group[0] if len(group) == 1 else _merge_cells(group) for group in groups.values()]


def _merge_cells(group: Sequence[MismatchCell]) -> MismatchCell:
    """Merge cells that differ in their part alone; the other attributes are those of the first."""
    seconds = np.array([cell.seconds for cell in group])
    mismatch_power, signal_power = (
        float(np.average(np.array(rms_values) ** 2, weights=seconds if seconds.any() else None))
        for rms_values in ([cell.rms for cell in group], [cell.signal_rms for cell in group])
    )
    return replace(
        group[0],
        rms=mismatch_power**0.5,
        signal_rms=signal_power**0.5,
        adjusted_p_value=min(cell.adjusted_p_value for cell in group),
    )


def _identify_channel(cell: MismatchCell) -> tuple[str, str]:
    """Return name and quantity of the cell's channel: response and position may share a name."""
    return cell.output, cell.quantity


def _compute_channel_rms(cells: Sequence[MismatchCell]) -> dict[tuple[str, str], float]:
    """Compute the rms of each channel's response over all bands, in the segment (input and level) with the largest."""
    powers: dict[tuple[str, str], dict[tuple[str, float], float]] = {}
    for cell in cells:
        segment_powers = powers.setdefault(_identify_channel(cell), {})
        segment_key = (cell.input, cell.amplitude)
        segment_powers[segment_key] = segment_powers.get(segment_key, 0.0) + cell.signal_rms**2
    return {channel: max(max(segment_powers.values()) ** 0.5, 1e-300) for channel, segment_powers in powers.items()}


def _make_cell_row(cell: MismatchCell) -> Mismatch:
    """Convert a cell to a row; its share is limited to 1, as the document requires."""
    return Mismatch(
        cell.output, cell.input, cell.band_hz, cell.amplitude or None, None, min(cell.share, 1.0), cell.adjusted_p_value
    )


def _make_state_row(state: StateMismatch) -> Mismatch:
    """Convert a region of state to a row without a level, because it covers all levels; its share is limited to 1."""
    region = state.region
    return Mismatch(
        state.output, state.input, state.band_hz, None, region.description, min(region.share, 1.0), region.p_value
    )
