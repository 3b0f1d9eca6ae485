"""Report sections on nonlinear distortion by channel, input and level, found without a model."""

from collections.abc import Mapping, Sequence

from analysis.diagnosis.localisation.distortion import Distortion, Kind
from analysis.diagnosis.localisation.level_trends import LevelTrend, level_trends
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.settings import DISTORTION_P
from analysis.diagnosis.unit_wording import share_text
from analysis.reports.page import Section, Table
from analysis.wording import MISSING, conjoin

_KINDS: tuple[Kind, ...] = ("odd", "even", "either", "varying")
_WORDS: Mapping[Kind, str] = {
    "odd": "Odd",
    "even": "Even",
    "either": "Odd or even",
    "varying": "Varying between periods",
}
_TREND_WORDS = {
    "falls": "falls as the level rises",
    "rises": "rises with the level",
    "rises from nothing": "appears only at higher levels",
    "stays": "has the same share at all levels",
    "": "is present, at too few levels to determine how it grows",
}
_LEAST_RESPONSE = 0.1
"""Response relative to the largest of its quantity, input and level, below which a channel has no row. By hand."""


def distortion_sections(findings: Findings) -> list[Section]:
    """The section on distortion, with trends over the level in words and a table; empty where distortion was not
    examined."""
    measured = findings.localisation.distortions
    if not measured.cells and not measured.remarks:
        return []
    table = _distortion_table(findings)
    return [
        Section(
            "What kind of distortion the device shows",
            paragraphs=(*_trend_paragraphs(measured.cells), *measured.remarks),
            tables=(table,) if table is not None else (),
        )
    ]


def _trend_paragraphs(cells: Sequence[Distortion]) -> tuple[str, ...]:
    if not cells:
        return ()
    responding = [cell for cell in cells if cell.whole_band and _responds(cell, cells)]
    groups: dict[tuple[Kind, str], list[LevelTrend]] = {}
    for trend in level_trends(responding):
        if trend.present:
            groups.setdefault((trend.kind, trend.level_dependence), []).append(trend)
    if not groups:
        return ("No distortion exceeds the noise: by repeats and silent lines the device appears linear.",)
    return tuple(
        f"{_WORDS[kind]}{' distortion' if kind != 'varying' else ''} {_TREND_WORDS[dependence]}: "
        f"{conjoin([f'{member.output} driven by {member.input}' for member in trends])}."
        for (kind, dependence), trends in groups.items()
    )


def _distortion_table(findings: Findings) -> Table | None:
    cells = [cell for cell in findings.localisation.distortions.cells if cell.whole_band]
    responding = [cell for cell in cells if _responds(cell, cells)]
    kinds = [kind for kind in _KINDS if any(distortion.kind == kind for distortion in responding)]
    rows: dict[tuple[str, str, str, float], dict[Kind, Distortion]] = {}
    for responding_cell in responding:
        rows.setdefault(
            (responding_cell.output, responding_cell.quantity, responding_cell.input, responding_cell.amplitude), {}
        )[responding_cell.kind] = responding_cell
    if not rows:
        return None
    noise = _noise_rms(findings)
    return Table(
        "Noise and distortion, per cent of the response there",
        ("Channel", "Driven by", "Level", "Noise", *(_WORDS[kind] for kind in kinds)),
        tuple(
            (
                output,
                input_,
                f"{amplitude:g}",
                _share_of_signal(noise.get((output, quantity)), next(iter(by_kind.values())).signal_rms),
                *(_cell_text(by_kind.get(kind)) for kind in kinds),
            )
            for (output, quantity, input_, amplitude), by_kind in rows.items()
        ),
        (
            "Root-mean-square over the driven band. <: below the detection limit, which is stated. "
            "Channels with less than a tenth of the strongest response are left out.",
        ),
        folded=True,
    )


def _responds(cell: Distortion, cells: Sequence[Distortion]) -> bool:
    """Whether its response is at least `_LEAST_RESPONSE` of the strongest of its quantity, input and level."""
    signal_rms = [
        other_cell.signal_rms
        for other_cell in cells
        if (other_cell.quantity, other_cell.input, other_cell.amplitude, other_cell.whole_band)
        == (cell.quantity, cell.input, cell.amplitude, cell.whole_band)
    ]
    return cell.signal_rms > _LEAST_RESPONSE * max(signal_rms)


def _noise_rms(findings: Findings) -> dict[tuple[str, str], float]:
    """Rms by channel and quantity."""
    if findings.floor is None or not findings.time_series:
        return {}
    rms = [*findings.floor.response_rms, *(() if findings.floor.position_rms is None else findings.floor.position_rms)]
    keys = dict.fromkeys((cell.output, cell.quantity) for cell in findings.localisation.distortions.cells)
    return {key: float(value) for key, value in zip(keys, rms, strict=False)}


def _share_of_signal(rms: float | None, signal: float) -> str:
    return MISSING if rms is None or not signal > 0 else share_text(rms / signal)


def _cell_text(cell: Distortion | None) -> str:
    if cell is None:
        return MISSING
    if cell.p_value < DISTORTION_P:
        return _share_of_signal(cell.rms, cell.signal_rms)
    return f"< {_share_of_signal(cell.limit_rms, cell.signal_rms)}"
