"""Analysis of a folder of sessions: thresholds.csv, detection.csv, anova.json, figures and one HTML report.

The sessions that belong together are selected (`collect_sessions`), analysed (`analyse_study`: thresholds, hierarchical
model, analysis of variance) and written with their provenance.
"""

import errno
from pathlib import Path

from analysis.figures.picture import Picture
from analysis.figures.study_pictures import study_pictures
from analysis.psychophysics.ellipsoid import EllipsoidResult, ellipsoids, sensor_frame
from analysis.psychophysics.study_analysis import StudyAnalysis, analyse_study, make_anova_document
from analysis.psychophysics.threshold_table import ThresholdTable
from analysis.reports.declared_section import describe_declared
from analysis.reports.primary_tables import interval_words, limit_words
from analysis.reports.study_report import render_study_report
from study.errors import StudyError
from study.local_clock import local_now
from study.store.disk.file_errors import CannotWriteError
from study.store.disk.json_document import write_json
from study.store.disk.privacy import close_to_others, make_folder
from study.store.disk.provenance import Provenance, gather_provenance
from study.store.disk.text_file import write_text
from study.store.formats.recording_file import read_recording
from study.store.formats.thresholds_file import DETECTION_NAME, THRESHOLDS_NAME, write_thresholds
from study.store.sessions.written_elsewhere import note_written_folder
from study.workflows.picture_files import write_pictures
from study.workflows.results.analysis_files import PAGE_NAME, analysis_outputs
from study.workflows.results.collect_sessions import collect_sessions
from study.workflows.results.collected import CollectedTrials
from study.workflows.results.export_study import collect_exported, is_exported
from study.workflows.results.written_analysis import WrittenAnalysis


def analyze_data(
    data: Path | str, out_folder: Path | str, ellipsoid: Path | str | None = None, protocol_name: str | None = None
) -> WrittenAnalysis:
    """Analyse all sessions in `data`; an earlier analysis in `out_folder` is replaced. data: folder of sessions, a
    single session, or an exported dataset. ellipsoid: recording whose acceleration ellipses the report shows.
    protocol_name: protocol to analyse where there are several. Raises StudyError where there is nothing to analyse,
    where rows contradict their protocol, or where files cannot be written.
    """
    data, out_folder, ellipsoid = Path(data), Path(out_folder), None if ellipsoid is None else Path(ellipsoid)
    collected = collect_exported(data) if is_exported(data) else collect_sessions(data, protocol_name)
    try:
        analysis = analyse_study(collected.trials, collected.protocol, collected.left_out)
    except ValueError as problem:
        raise StudyError(
            "The data contradict their protocol", f"{problem}.", "Nothing was written; look at the sessions named."
        ) from problem
    found_ellipsoids = _ellipsoids(ellipsoid)
    parents = [*collected.parents, *([ellipsoid] if ellipsoid else [])]
    provenance = gather_provenance(
        protocol_hash=collected.protocol_hash,
        seeds={folder.name: seed for folder, seed in zip(collected.sessions, collected.seeds, strict=True)},
        parents=parents,
    )
    pictures = study_pictures(analysis, found_ellipsoids)
    _make_private(out_folder, data)
    note_written_folder(data, out_folder)
    _write(out_folder, analysis, pictures, found_ellipsoids, provenance, collected)
    return WrittenAnalysis(
        thresholds=analysis.thresholds,
        table=tuple(text_table(analysis)),
        warnings=(*collected.finished, *collected.left_out, *analysis.warnings),
        report=out_folder / PAGE_NAME,
    )


def text_table(analysis: StudyAnalysis) -> list[str]:
    """Table of thresholds for the terminal: one line per frequency, means in N, with medians and declared contrast."""
    lines = ["No complete test run: there is no threshold yet."]
    if any(row.complete for row in analysis.thresholds):
        declared = describe_declared(analysis.declared_result)
        lines = [*_lines(analysis.table, "threshold"), *_primary_lines(analysis), *declared]
    if any(row.complete for row in analysis.detection):
        lines += _lines(analysis.detection_table, "felt from")
    return lines


def _lines(table: ThresholdTable, heading: str) -> list[str]:
    """One line per frequency: mean threshold over participants in N (values limited by the cap are included), number of
    values limited by the cap, and number of participants."""
    lines = [f"{'frequency':>10}  {heading:>10}  {'cut by cap':>10}  participants"]
    for column, frequency_hz in enumerate(table.frequencies_hz):
        values = [value for row in table.values if (value := row[column]) is not None]
        censored = sum(row[column] for row in table.censored)
        mean = f"{sum(values) / len(values):.3f} N" if values else "-"
        lines.append(f"{frequency_hz:7g} Hz  {mean:>10}  {censored:>10}  {len(values):>12}")
    return lines


def _primary_lines(analysis: StudyAnalysis) -> list[str]:
    """Medians in N of the hierarchical model with their 95 % intervals; empty where it was not fitted."""
    if analysis.primary is None:
        return []
    lines = [f"{'frequency':>10}  {'median':>10}  95 % interval, all answers in one model"]
    for median in analysis.primary.medians:
        value = "above cap" if median.above_cap else f"{median.newton:.3f} N"
        unit = " N" if median.lower_n is not None else ""
        interval = interval_words(median.lower_n, median.upper_n, median.above_cap, 3) + unit
        lines.append(f"{median.frequency_hz:7g} Hz  {value:>10}  {interval}")
    return [*lines, limit_words(analysis.primary), analysis.compared]


def _ellipsoids(path: Path | None) -> tuple[EllipsoidResult, ...]:
    """Acceleration ellipses of a recording; none without a path. Raises StudyError where they cannot be computed."""
    if path is None:
        return ()
    recording = read_recording(path)
    try:
        return ellipsoids(recording, sensor_frame(recording))
    except ValueError as problem:
        raise StudyError(
            "No ellipsoids can be computed",
            f"{path.name}: {problem}.",
            "Give a recording made with: hapteq record ellipsoid",
            saved="Nothing was written.",
        ) from problem


def _make_private(folder: Path, data: Path) -> None:
    """Create an output folder inside the folder of sessions, readable only by this account. An output folder elsewhere
    is left to `_write`. Raises CannotWriteError."""
    if not folder.resolve().is_relative_to(data.resolve()):
        return
    try:
        make_folder(folder, private=True)
    except OSError as problem:
        raise CannotWriteError(folder, problem) from problem
    if folder.resolve() != data.resolve():
        close_to_others(folder, recursive=True)


def _write(
    folder: Path,
    analysis: StudyAnalysis,
    pictures: tuple[Picture, ...],
    found_ellipsoids: tuple[EllipsoidResult, ...],
    provenance: Provenance,
    collected: CollectedTrials,
) -> None:
    """Remove figures and report of an earlier analysis, then write all files. Raises CannotWriteError."""
    figures = folder / "figures"
    try:
        make_folder(figures)
        if figures.is_symlink():
            raise NotADirectoryError(errno.ENOTDIR, "it is a link, which is not followed")
        # The report is removed first and written last: while it is missing, the other files may be of different runs.
        for stale in analysis_outputs(folder):
            if stale.parent == figures or stale.name in (DETECTION_NAME, PAGE_NAME):
                stale.unlink()
    except OSError as problem:
        raise CannotWriteError(figures, problem) from problem
    write_thresholds(folder / THRESHOLDS_NAME, analysis.thresholds)
    if analysis.detection:
        write_thresholds(folder / DETECTION_NAME, analysis.detection)
    document = make_anova_document(analysis)
    format_name, version = document.pop("format"), document.pop("version")
    write_json(folder / "anova.json", format_name, version, document, provenance, overwrite=True)
    write_pictures(figures, pictures)
    origin = _origin_entries(provenance, collected)
    page = render_study_report(analysis, pictures, origin, local_now(), found_ellipsoids, collected.qualities)
    write_text(folder / PAGE_NAME, page, overwrite=True)


def _origin_entries(provenance: Provenance, collected: CollectedTrials) -> dict[str, str]:
    """Entries of the report's last section, on the origin of the results."""
    return {
        "protocol": f"{collected.protocol.name}, hash {collected.protocol_hash}",
        "locked before the data": collected.locked,
        "device": ", ".join(collected.devices) or "none",
        "participants": ", ".join(collected.observers) or "people",
        "sessions": ", ".join(folder.name for folder in collected.sessions) or "none",
        "left out": " ".join(collected.left_out) or "nothing",
        "seeds": ", ".join(str(seed) for seed in collected.seeds) or "none",
        "versions": ", ".join(f"{name} {version}" for name, version in provenance.versions.items()),
        "command": " ".join(provenance.command),
    }
