"""Write the result folder of a diagnosis: document (JSON), improved model, figures and report (HTML), in this order.

A `Picture` is a figure with title and caption; a drawing makes one or more. Drawings run in parallel; one that crashes
is left out, with a remark in the report (`crash_guard`).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from analysis.diagnosis.result.findings import Findings
from analysis.figures.diagnosis.diagnosis_pictures import list_drawings
from analysis.figures.picture import Picture
from analysis.reports.diagnosis_report import render_diagnosis_report
from study.local_clock import format_local_now
from study.store.disk.provenance import Provenance, gather_provenance
from study.store.disk.text_file import write_text
from study.store.formats.diagnosis_file import DIAGNOSIS_NAME, MODEL_NAME, PAGE_NAME, write_diagnosis
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.sessions.archive import SessionFolder, holds_session
from study.store.sessions.written_elsewhere import note_written_folder
from study.workflows.crash_guard import make_crash_guard
from study.workflows.forked_map import map_forked
from study.workflows.picture_files import DrawnPicture, draw_picture, write_drawn_pictures


def note_sessions(sources: Sequence[Path], out: Path) -> tuple[SessionFolder, ...]:
    """Note the result's folder in the data folders of the sources that are sessions, or recordings in one, so that a
    withdrawal names it. Returns these sessions."""
    paths = [source.resolve() for source in sources]
    recorded_in = [path.parent.parent for path in paths if not path.is_dir()]
    session_folders = dict.fromkeys(
        [*(path for path in paths if path.is_dir()), *(folder for folder in recorded_in if holds_session(folder))]
    )
    for session_folder in session_folders:
        note_written_folder(session_folder, out)
    return tuple(SessionFolder(session_folder) for session_folder in session_folders)


def write_diagnosis_into(folder: Path, findings: Findings, parents: Sequence[Path]) -> Findings:
    """Write the files into an existing empty `folder`. parents: input files, for the provenance. Returns the findings
    with a remark for each drawing that crashed. Raises StudyError where a file cannot be written."""
    provenance = gather_provenance(parents=parents)
    write_diagnosis(folder / DIAGNOSIS_NAME, findings.diagnosis, provenance)
    improved_model = replace(findings.improved, provenance=provenance.as_dict())
    write_mechanical_model(folder / MODEL_NAME, improved_model)
    guard = make_crash_guard()
    drawing_parts = [replace(part, work=partial(_draw_pictures, part.work)) for part in list_drawings(findings)]
    drawn_pictures = [
        drawn_picture for part_pictures in guard.run_parts(map_forked, drawing_parts) for drawn_picture in part_pictures
    ]
    findings = replace(findings, remarks=(*guard.sentences, *findings.remarks))
    write_drawn_pictures(folder / "figures", drawn_pictures)
    page = render_diagnosis_report(
        findings,
        [drawn_picture.picture for drawn_picture in drawn_pictures],
        _format_provenance(provenance),
        format_local_now(),
    )
    write_text(folder / PAGE_NAME, page)
    return findings


def _draw_pictures(draw: Callable[[], Sequence[Picture]]) -> list[DrawnPicture]:
    """Make the pictures of a drawing and render them."""
    return [draw_picture(picture) for picture in draw()]


def _format_provenance(provenance: Provenance) -> dict[str, str]:
    """Format the provenance for the report: input files with the first 12 digits of their SHA-256, command line,
    versions."""
    return {
        "made from": ", ".join(f"{parent.file} ({parent.sha256[:12]})" for parent in provenance.parents),
        "command": " ".join(provenance.command),
        "versions": ", ".join(f"{name} {version}" for name, version in provenance.versions.items()),
    }
