"""Mismatch cells and regions of state as rows of the diagnosis document."""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.diagnosis.data.frequency_cells import Band
from analysis.diagnosis.document import Mismatch
from analysis.diagnosis.localisation.mismatch_cells import MismatchCell
from analysis.diagnosis.localisation.state_regions import StateRegion
from analysis.diagnosis.settings import FALSE_DISCOVERY_RATE

MOST_ROWS = 40


@dataclass(frozen=True, slots=True)
class StateMismatch:
    """A region of state, and the channel, inputs and band whose mismatch was looked at."""

    output: str
    input: str
    band_hz: Band
    region: StateRegion


def mismatch_rows(
    cells: Sequence[MismatchCell], states: Sequence[StateMismatch] = (), most: int = MOST_ROWS
) -> tuple[Mismatch, ...]:
    """Significant ones, largest share first; of the cells, the share of their signal (rms, at most 1), of the states,
    the share of the mismatch's power that sits there. What states there are is kept before what cells there are."""
    tied = [(state.region.share, _state_row(state)) for state in states if state.region.p_value <= FALSE_DISCOVERY_RATE]
    found = [(cell.share, _cell_row(cell)) for cell in cells if cell.significant]
    best = sorted(tied, key=_by_share)[:most]
    best += sorted(found, key=_by_share)[: most - len(best)]
    return tuple(row for _, row in sorted(best, key=_by_share))


def _by_share(row: tuple[float, Mismatch]) -> tuple[float, float]:
    return -row[0], row[1].p_value


def _cell_row(cell: MismatchCell) -> Mismatch:
    return Mismatch(
        cell.output, cell.input, cell.band_hz, cell.amplitude, None, min(cell.share, 1.0), cell.adjusted_p_value
    )


def _state_row(state: StateMismatch) -> Mismatch:
    region = state.region
    return Mismatch(
        state.output, state.input, state.band_hz, None, region.words, min(region.share, 1.0), region.p_value
    )
