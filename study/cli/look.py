"""`hapteq look`: what is in recordings, and what is wrong with them, before any model."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from study.cli.results import JsonOption
from study.cli.screen import read_terminal_width

if TYPE_CHECKING:
    from analysis.look.overview import Overview


def look(
    recordings: Annotated[list[Path], typer.Argument(help="Recordings, REC.h5 ...", metavar="REC.h5 ...")],
    out: Annotated[Path | None, typer.Option(help="Folder for a page with figures.")] = None,
    everything: Annotated[bool, typer.Option("--all", help="Also the checks that found nothing.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Signals, spectra, coherence, levels and repeats; and checks of units, clock, derivatives, lags, clipping and
    steps. Exit code 0 also where something is wrong: that is a result."""
    from study.cli.progress import show_late_bar
    from study.workflows.recording.look_at_recordings import inspect_recordings, make_look_document, write_look_page

    with show_late_bar("Looking (%)", total=100) as show:
        overviews = inspect_recordings(recordings, lambda share: show(round(100 * share)))
    if as_json:
        typer.echo(json.dumps(make_look_document(overviews), indent=2))
    else:
        for overview in overviews:
            print_lines(look_lines(overview, everything))
    if out is not None:
        typer.echo(f"Report: {write_look_page(overviews, out)}", err=True)


def look_lines(overview: "Overview", everything: bool) -> Iterable[str]:
    """Checks and measurements of one recording as lines; everything: also passed checks."""
    from analysis.reports.look_report import summarise_overview
    from study.tui.text_rows import wrap_hanging

    yield summarise_overview(overview)
    yield from draw_recording_lines(overview)
    yield ""
    for check in overview.checks:
        if everything or check.level != "fine":
            yield from wrap_hanging(
                f"{check.level:6s}  {check.name}: {check.finding} {check.advice}".rstrip(), 8, read_terminal_width()
            )
    fine = sum(check.level == "fine" for check in overview.checks)
    if not everything and fine:
        yield f"fine    {fine} further checks (--all shows them)"
    yield ""


def draw_recording_lines(overview: "Overview") -> Iterable[str]:
    """Time series, spectra, and tables of channels and segments."""
    from study.tui.drawing.recording_drawing import draw_spectra, draw_time_series

    yield ""
    for channel in overview.channels:
        yield from draw_time_series(channel)
    if overview.spectra is not None:
        yield ""
        yield from draw_spectra(overview)
    yield from ("", *_tables(overview))


def _tables(overview: "Overview") -> Iterable[str]:
    from analysis.wording import typeset
    from study.tui.text_rows import align_rows

    rows: list[tuple[str, ...]] = [("channel", "quantity", "unit", "lowest", "highest", "mean", "rms", "missing")]
    for summary in overview.summaries:
        sizes = [typeset(f"{value:.4g}") for value in (summary.lowest, summary.highest, summary.mean, summary.rms)]
        rows.append((f"{summary.role} {summary.name}", summary.quantity, summary.unit, *sizes, str(summary.missing)))
    yield from align_rows(tuple(rows), read_terminal_width())
    segments = overview.recording.segments
    if segments:
        yield ""
        heads = [f"rms {channel.role} {channel.name}" for channel in overview.channels]
        table: list[tuple[str, ...]] = [("segment", "role", "start s", "length s", "period", *heads)]
        for level in overview.levels[:MOST_SEGMENTS]:
            sizes = [f"{value:.4g}" for value in level.rms]
            times = (f"{level.start_s:.4g}", f"{level.duration_s:.4g}", str(level.period) if level.period else "")
            table.append((f"{level.number} {level.kind}", level.role, *times, *sizes))
        yield from align_rows(tuple(table), read_terminal_width())
        if len(segments) > MOST_SEGMENTS:
            yield f"and {len(segments) - MOST_SEGMENTS} segments more"


MOST_SEGMENTS = 20
"""Segments printed in the terminal; the page lists all."""


def print_lines(lines: Iterable[str]) -> None:
    """Print lines; control characters from a file are removed."""
    from study.session.views.printable import replace_unprintable

    for line in lines:
        typer.echo(replace_unprintable(line))
