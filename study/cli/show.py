"""Command `hapteq show`: print a session (facts, thresholds, staircases), a diagnosis, or a recording.

WHAT is taken as a recording file, else as a diagnosis (any other file, or a folder with diagnosis.json), else as a
session.
"""

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from study.cli.look import draw_recording_lines, print_lines
from study.cli.results import JsonOption
from study.cli.screen import read_terminal_width
from study.cli.session_options import DataOption

if TYPE_CHECKING:
    from study.session.views.archive_views import DiagnosisView, SessionView, Staircase

PLOT_COLUMNS, PLOT_ROWS = 78, 12
"""Width and height of a staircase's plot, in characters. Chosen for a terminal of 80 columns."""


def show(
    target: Annotated[
        str,
        typer.Argument(
            help="A session (its folder or name), a diagnosis (its file or folder), or a recording.", metavar="WHAT"
        ),
    ],
    data: DataOption = Path("data"),
    log: Annotated[bool, typer.Option("--log", help="Also the log in words.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Facts, thresholds, warnings and staircases of a session; verdict, effects and fit of a diagnosis; or channels,
    segments and facts of a recording."""
    from study.importing.arrays.json_arrays import is_hapteq_document
    from study.importing.arrays.read_arrays import FOREIGN_ENDINGS
    from study.store.disk.hdf5_file import is_hdf5

    target_path = Path(target)
    is_foreign = (
        target_path.is_file() and target_path.suffix.lower() in FOREIGN_ENDINGS and not is_hapteq_document(target_path)
    )
    if is_foreign or (target_path.is_file() and is_hdf5(target_path)):
        _show_recording(Path(target), as_json)
        return
    diagnosis_path = Path(target) / "diagnosis.json" if (Path(target) / "diagnosis.json").is_file() else Path(target)
    if diagnosis_path.is_file():
        from study.workflows.views.view_diagnosis import make_diagnosis_view

        diagnosis = make_diagnosis_view(diagnosis_path)
        print_lines([json.dumps(asdict(diagnosis), indent=2)] if as_json else _format_diagnosis(diagnosis))
        return
    from study.local_clock import convert_to_machine_zone
    from study.session.views.local_time import to_utc
    from study.workflows.views.view_session import make_session_view

    session = make_session_view(_find_session_folder(target, data), to_utc if as_json else convert_to_machine_zone)
    print_lines([json.dumps(asdict(session), indent=2)] if as_json else _format_session(session, log))


def _show_recording(path: Path, as_json: bool) -> None:
    """Print channels, segments and facts of a recording, or the same as JSON."""
    from study.workflows.recording.look_at_recordings import (
        inspect_recordings,
        list_recording_facts,
        make_look_document,
    )

    overviews = inspect_recordings([path])
    if as_json:
        print_lines([json.dumps(make_look_document(overviews)[0], indent=2)])
        return
    print_lines(
        [
            *list_recording_facts(overviews[0]),
            *draw_recording_lines(overviews[0]),
            "",
            f"Its checks: hapteq look {path}",
        ]
    )


def _find_session_folder(target: str, data: Path) -> Path:
    """Find the folder of a session, also of a withdrawn or unreadable one. target: the folder, or its name in `data`.
    Raises as `find_session` where it is no session."""
    from study.store.sessions.archive import find_session, list_session_folders

    folder = Path(target) if Path(target).is_dir() else data / target
    session_paths = [session.path.resolve() for session in list_session_folders(folder.absolute().parent)]
    return folder if folder.resolve() in session_paths else find_session(target, data).path


def _format_session(view: "SessionView", with_log: bool) -> Iterable[str]:
    """Format the lines of a session: summary, facts, thresholds, warnings, staircases, its events in words where
    with_log, and path of the report."""
    from study.tui.drawing.staircase_drawing import LEGEND
    from study.tui.session_status import describe_session
    from study.tui.text_rows import align_rows

    yield describe_session(view.line)
    yield ""
    yield from align_rows(view.facts, read_terminal_width())
    if view.thresholds:
        yield from ("", *align_rows(view.thresholds, read_terminal_width()))
    for warning in view.warnings:
        yield f"\nNote: {warning}"
    if view.staircases:
        yield f"\n{LEGEND}"
    for staircase in view.staircases:
        yield from _draw_plot(staircase)
    if with_log:
        yield from ("", *view.events)
    if view.report:
        yield f"\nReport: {view.report}"


def _draw_plot(staircase: "Staircase") -> Iterable[str]:
    """Draw the lines of a staircase: title, plot and summary."""
    from study.tui.drawing.staircase_drawing import draw_staircase, summarise_staircase

    yield f"\n{staircase.title}"
    yield from draw_staircase(staircase, PLOT_COLUMNS, PLOT_ROWS)
    yield summarise_staircase(staircase)


def _format_diagnosis(view: "DiagnosisView") -> Iterable[str]:
    """Format the lines of a diagnosis: verdict, effects, candidates, rivals, fit, mismatch, remainder, notes, next
    experiment, and path of the report; empty sections are left out."""
    from study.tui.text_rows import align_rows

    width = read_terminal_width()
    inner_width = None if width is None else width - 2
    yield view.verdict
    sections = (
        ("Effects", view.sentences),
        ("Candidates, not confirmed", view.candidates),
        ("Rivals, and why rejected", view.rivals),
    )
    for title, sentences in sections:
        if sentences:
            yield from ("", title, *(f"  {sentence}" for sentence in sentences))
    for title, rows in (("Fit", view.fit), ("Mismatch", view.mismatch), ("What remains", view.remainder)):
        if rows:
            yield from ("", title, *(f"  {row}" for row in align_rows(rows, inner_width)))
    yield ""
    yield from view.notes
    if view.next_experiment:
        yield from ("", "Next", *(f"  {text_line}" for text_line in view.next_experiment.splitlines()))
    if view.report:
        yield f"\nReport: {view.report}"
