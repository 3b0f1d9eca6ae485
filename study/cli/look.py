"""Command `hapteq look`: shows the signals of recordings and checks them, before any model is fitted.

Prints, for each recording, a summary, time series, spectra, tables of channels and segments, and the findings of the
checks. Calls `study.workflows.recording.look_at_recordings`. `study.cli.show` uses the drawing functions.
"""

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
    list_passed_checks: Annotated[bool, typer.Option("--all", help="Also the checks that found nothing.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Show signals, spectra, coherence, levels and repeats; check units, clock, derivatives, lags, clipping and steps.
    Exit code 0 also where a check fails: that is a result."""
    from study.cli.progress import show_share
    from study.workflows.recording.look_at_recordings import (
        inspect_recordings,
        list_import_notes,
        make_look_document,
        write_look_page,
    )

    with show_share("Looking") as on_progress:
        overviews = inspect_recordings(recordings, on_progress)
    if as_json:
        typer.echo(json.dumps(make_look_document(overviews), indent=2))
    else:
        for overview in overviews:
            print_lines(format_overview(overview, list_passed_checks))
    import_notes = dict.fromkeys(note for overview in overviews for note in list_import_notes(overview))
    print_lines((f"Note: {note}" for note in import_notes), to_stderr=True)
    if out is not None:
        typer.echo(f"Report: {write_look_page(overviews, out)}", err=True)


def format_overview(overview: "Overview", list_passed_checks: bool) -> Iterable[str]:
    """Format measurements and checks of one recording as lines. list_passed_checks: also list the passed checks, which
    otherwise are only counted."""
    from analysis.reports.look_report import summarise_overview
    from study.tui.text_rows import wrap_hanging

    yield summarise_overview(overview)
    yield from draw_recording_lines(overview)
    yield ""
    for check in overview.checks:
        if list_passed_checks or check.level != "fine":
            yield from wrap_hanging(
                f"{check.level:6s}  {check.name}: {check.finding} {check.advice}".rstrip(), 8, read_terminal_width()
            )
    passed_count = sum(check.level == "fine" for check in overview.checks)
    if not list_passed_checks and passed_count:
        yield f"fine    {passed_count} further checks (--all shows them)"
    yield ""


def draw_recording_lines(overview: "Overview") -> Iterable[str]:
    """Draw time series and spectra (if there are any) of a recording as lines of text, with the tables of channels and
    segments."""
    from study.tui.drawing.recording_drawing import draw_spectra, draw_time_series

    yield ""
    for channel in overview.channels:
        yield from draw_time_series(channel)
    if overview.spectra is not None:
        yield ""
        yield from draw_spectra(overview)
    yield from ("", *_format_tables(overview))


def _format_tables(overview: "Overview") -> Iterable[str]:
    """Format the table of the channels, and that of the segments (the first `MAX_SEGMENT_ROWS`), if there are any."""
    from analysis.wording import typeset
    from study.tui.text_rows import align_rows

    rows: list[tuple[str, ...]] = [("channel", "quantity", "unit", "lowest", "highest", "mean", "rms", "missing")]
    for summary in overview.summaries:
        statistic_cells = [
            typeset(f"{value:.4g}") for value in (summary.lowest, summary.highest, summary.mean, summary.rms)
        ]
        rows.append(
            (f"{summary.role} {summary.name}", summary.quantity, summary.unit, *statistic_cells, str(summary.missing))
        )
    yield from align_rows(tuple(rows), read_terminal_width())
    segments = overview.recording.segments
    if segments:
        yield ""
        rms_headings = [f"rms {channel.role} {channel.name}" for channel in overview.channels]
        segment_rows: list[tuple[str, ...]] = [("segment", "role", "start s", "length s", "period", *rms_headings)]
        for segment_level in overview.levels[:MAX_SEGMENT_ROWS]:
            statistic_cells = [f"{value:.4g}" for value in segment_level.rms]
            time_cells = (
                f"{segment_level.start_s:.4g}",
                f"{segment_level.duration_s:.4g}",
                str(segment_level.period) if segment_level.period else "",
            )
            segment_rows.append(
                (f"{segment_level.number} {segment_level.kind}", segment_level.role, *time_cells, *statistic_cells)
            )
        yield from align_rows(tuple(segment_rows), read_terminal_width())
        if len(segments) > MAX_SEGMENT_ROWS:
            yield f"and {len(segments) - MAX_SEGMENT_ROWS} segments more"


MAX_SEGMENT_ROWS = 20
"""Largest number of segments that are listed in the terminal; the page of --out lists all. Chosen."""


def print_lines(lines: Iterable[str], *, to_stderr: bool = False) -> None:
    """Print lines; control characters, which may come from a file, are replaced."""
    from study.session.views.printable import replace_unprintable

    for line in lines:
        typer.echo(replace_unprintable(line), err=to_stderr)
