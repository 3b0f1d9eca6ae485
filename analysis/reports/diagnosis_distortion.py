"""Report sections on nonlinear distortion by channel, input and level, measured without a model."""

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.diagnosis.limits import DISTORTION_P
from analysis.diagnosis.localisation.distortion import Distortion, Kind
from analysis.diagnosis.localisation.level_trends import LevelTrend, compute_level_trends
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.unit_wording import format_share
from analysis.reports.page import Section, Table
from analysis.wording import MISSING, conjoin

_KINDS_IN_ORDER: tuple[Kind, ...] = ("odd", "even", "either", "varying")
"""Order of the columns of the table."""
_KIND_NAMES: Mapping[Kind, str] = {
    "odd": "Odd",
    "even": "Even",
    "either": "Odd or even",
    "varying": "Varying between periods",
}
"""Name of each kind of distortion, as a heading and as the beginning of a sentence."""
_TREND_DESCRIPTIONS = {
    "falls": "falls as the level rises",
    "rises": "rises with the level",
    "rises from nothing": "appears only at higher levels",
    "stays": "has the same share at all levels",
    "": "is present, at too few levels to determine how it grows",
}
"""Predicate of a sentence for each value of `LevelTrend.level_dependence`."""
_LEAST_RESPONSE_RATIO = 0.1
"""Response relative to the largest of its quantity, input and level, up to which a channel is left out. Chosen."""


def make_distortion_sections(findings: Findings) -> list[Section]:
    """Make the section on distortion, with trends over the level in words and a table; empty where distortion was not
    examined."""
    distortions = findings.localisation.distortions
    if not distortions.cells and not distortions.remarks:
        return []
    table = _tabulate_distortion(findings)
    return [
        Section(
            "What kind of distortion the device shows",
            paragraphs=(*_describe_trends(distortions.cells), *distortions.remarks),
            tables=(table,) if table is not None else (),
        )
    ]


def _describe_trends(cells: Sequence[Distortion]) -> tuple[str, ...]:
    """Describe how each kind of distortion depends on the level, with the channels in which it does so; empty without
    cells."""
    if not cells:
        return ()
    responding_cells = [cell for cell in cells if cell.whole_band and _is_responding(cell, cells)]
    trends_by_kind: dict[tuple[Kind, str], list[LevelTrend]] = {}
    for trend in compute_level_trends(responding_cells):
        if trend.present:
            trends_by_kind.setdefault((trend.kind, trend.level_dependence), []).append(trend)
    if not trends_by_kind:
        return ("No distortion exceeds the noise: by repeats and silent lines the device appears linear.",)
    return tuple(
        f"{_KIND_NAMES[kind]}{' distortion' if kind != 'varying' else ''} {_TREND_DESCRIPTIONS[level_dependence]}: "
        f"{conjoin([f'{channel_trend.output} driven by {channel_trend.input}' for channel_trend in trends])}."
        for (kind, level_dependence), trends in trends_by_kind.items()
    )


def _tabulate_distortion(findings: Findings) -> Table | None:
    """Tabulate noise and distortion by channel, input and level; None where no channel responds."""
    cells = [cell for cell in findings.localisation.distortions.cells if cell.whole_band]
    responding_cells = [cell for cell in cells if _is_responding(cell, cells)]
    kinds = [kind for kind in _KINDS_IN_ORDER if any(distortion.kind == kind for distortion in responding_cells)]
    cells_by_row: dict[tuple[str, str, str, float], dict[Kind, Distortion]] = {}
    for responding_cell in responding_cells:
        row_key = (
            responding_cell.output,
            responding_cell.quantity,
            responding_cell.input,
            responding_cell.amplitude,
        )
        row = cells_by_row.setdefault(row_key, {})
        # Of several recordings at this level, the most significant cell counts.
        row[responding_cell.kind] = min(
            responding_cell, row.get(responding_cell.kind, responding_cell), key=lambda cell: cell.p_value
        )
    if not cells_by_row:
        return None
    return Table(
        "Noise and distortion, per cent of the response there",
        ("Channel", "Driven by", "Level", "Noise", *(_KIND_NAMES[kind] for kind in kinds)),
        tuple(
            (
                output,
                input_name,
                f"{amplitude:g}",
                _format_noise(next(iter(distortion_by_kind.values()))),
                *(_format_distortion(distortion_by_kind.get(kind)) for kind in kinds),
            )
            for (output, _, input_name, amplitude), distortion_by_kind in cells_by_row.items()
        ),
        (
            "Root-mean-square over the driven band. <: below the detection limit, which is stated. "
            "Channels with less than a tenth of the strongest response are left out.",
        ),
        folded=True,
    )


def _is_responding(cell: Distortion, cells: Sequence[Distortion]) -> bool:
    """Whether a channel's response is above `_LEAST_RESPONSE_RATIO` of the strongest of its quantity, input and
    level."""
    compared_signal_rms = [
        other_cell.signal_rms
        for other_cell in cells
        if (other_cell.quantity, other_cell.input, other_cell.amplitude, other_cell.whole_band)
        == (cell.quantity, cell.input, cell.amplitude, cell.whole_band)
    ]
    return cell.signal_rms > _LEAST_RESPONSE_RATIO * max(compared_signal_rms)


def _format_noise(cell: Distortion) -> str:
    """Format the noise of a cell's channel as a share of the signal; `MISSING` where it is unknown."""
    return MISSING if np.isnan(cell.noise_rms) else _format_share_of_signal(cell.noise_rms, cell.signal_rms)


def _format_share_of_signal(rms: float, signal_rms: float) -> str:
    """Format an rms as a share of the signal's; `MISSING` without a signal."""
    return format_share(rms / signal_rms) if signal_rms > 0 else MISSING


def _format_distortion(cell: Distortion | None) -> str:
    """Format a distortion as a share of the signal, or "<" and its detection limit where it is not significant at
    `DISTORTION_P`; `MISSING` for None."""
    if cell is None:
        return MISSING
    if cell.p_value < DISTORTION_P:
        return _format_share_of_signal(cell.rms, cell.signal_rms)
    return f"< {_format_share_of_signal(cell.limit_rms, cell.signal_rms)}"
