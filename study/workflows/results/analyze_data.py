"""Analysis of a folder of sessions (`hapteq analyze`): thresholds.csv, detection.csv, anova.json, figures, HTML report.

The sessions that belong together are selected (`collect_sessions`) and analysed (`analyse_study`: thresholds,
hierarchical model, analysis of variance); the results are written with their provenance.
"""

import errno
from contextlib import suppress
from functools import partial
from pathlib import Path

from analysis.figures.picture import Picture
from analysis.figures.study_pictures import draw_study_pictures
from analysis.psychophysics.ellipsoid import EllipsoidResult, compute_ellipsoids, read_sensor_frame
from analysis.psychophysics.runs import InconsistentTrialsError
from analysis.psychophysics.study_analysis import StudyAnalysis, analyse_study, make_anova_document
from analysis.psychophysics.threshold_table import ThresholdTable
from analysis.reports.declared_section import describe_declared
from analysis.reports.primary_tables import describe_direction_limit, describe_undetermined, format_median_interval
from analysis.reports.study_report import render_study_report
from analysis.wording import format_newtons
from study.errors import StudyError, WrongUseError
from study.local_clock import format_local_now
from study.store.disk.file_errors import convert_write_errors
from study.store.disk.json_document import write_json
from study.store.disk.privacy import make_folder, restrict_to_owner
from study.store.disk.provenance import Provenance, gather_provenance
from study.store.disk.text_file import write_text
from study.store.formats.recording_file import read_recording
from study.store.formats.thresholds_file import DETECTION_NAME, THRESHOLDS_NAME, write_thresholds
from study.store.sessions.archive import holds_session, list_linked_sessions, require_consent
from study.store.sessions.written_elsewhere import note_written_folder
from study.workflows.picture_files import write_pictures
from study.workflows.results.analysis_files import ANALYSIS_NAME, PAGE_NAME, STATISTICS_NAME, list_analysis_outputs
from study.workflows.results.collect_sessions import collect_sessions
from study.workflows.results.collected_trials import CollectedTrials
from study.workflows.results.export_study import collect_exported, is_exported
from study.workflows.results.written_analysis import WrittenAnalysis


def analyze_data(
    data: Path | str, out_folder: Path | str, ellipsoid: Path | str | None = None, protocol_name: str | None = None
) -> WrittenAnalysis:
    """Analyse the sessions in `data`; an earlier analysis in `out_folder` is replaced. data: folder of sessions, a
    single session, or an exported dataset. ellipsoid: recording whose acceleration ellipses the report shows.
    protocol_name: protocol to analyse where sessions follow several. Raises StudyError where `out_folder` is a session,
    there is nothing to analyse, rows contradict their protocol, ellipses cannot be computed, files cannot be written,
    or a participant withdrew meanwhile."""
    data, out_folder, ellipsoid = Path(data), Path(out_folder), None if ellipsoid is None else Path(ellipsoid)
    _require_no_session(out_folder)
    collected_trials = collect_exported(data) if is_exported(data) else collect_sessions(data, protocol_name)
    try:
        analysis = analyse_study(collected_trials.trials, collected_trials.protocol, collected_trials.exclusions)
    except InconsistentTrialsError as error:
        raise StudyError(
            "The data contradict their protocol", f"{error}.", "Nothing was written; look at the sessions named."
        ) from error
    ellipses = _compute_ellipses(ellipsoid)
    input_paths = [*collected_trials.input_paths, *([ellipsoid] if ellipsoid else [])]
    provenance = gather_provenance(
        protocol_hash=collected_trials.protocol_hash,
        seeds={
            folder.name: seed for folder, seed in zip(collected_trials.sessions, collected_trials.seeds, strict=True)
        },
        parents=input_paths,
    )
    pictures = draw_study_pictures(analysis, ellipses)
    _create_private_folder(out_folder, data)
    for source in (data, *list_linked_sessions(collected_trials.sessions)):
        note_written_folder(source, out_folder)
    try:
        _write_files(out_folder, analysis, pictures, ellipses, provenance, collected_trials)
    finally:  # also after an error: the withdrawal may have erased a folder that was being written
        _remove_if_withdrawn(out_folder, collected_trials)
    return WrittenAnalysis(
        thresholds=analysis.thresholds,
        table=tuple(format_threshold_lines(analysis)),
        warnings=(*collected_trials.result_file_notes, *collected_trials.exclusions, *analysis.warnings),
        report=out_folder / PAGE_NAME,
    )


def _require_no_session(out_folder: Path) -> None:
    """Raise WrongUseError where the output folder is a session, whose own tables have the same names."""
    if holds_session(out_folder.resolve()):
        raise WrongUseError(
            "Results cannot be written into a session",
            f"{out_folder} is the folder of a session, and the analysis would replace its tables.",
            f"Give another folder with --out; by default it is '{ANALYSIS_NAME}' in the analysed folder.",
            saved="Nothing was written.",
        )


def format_threshold_lines(analysis: StudyAnalysis) -> list[str]:
    """Format the table of thresholds for the terminal: one line per frequency with the mean (N), then medians and the
    declared contrast; a single line where no test run is complete. Detection thresholds follow where a detection run is
    complete."""
    lines = ["No complete test run: there is no threshold yet."]
    if any(row.complete for row in analysis.thresholds):
        declared_lines = describe_declared(analysis.declared_result)
        lines = [*_format_frequency_lines(analysis.table, "threshold"), *_format_model_lines(analysis), *declared_lines]
    if any(row.complete for row in analysis.detection):
        lines += _format_frequency_lines(analysis.detection_table, "felt from")
    return lines


def _format_frequency_lines(table: ThresholdTable, heading: str) -> list[str]:
    """Format one line per frequency: mean threshold over participants in N (values limited by the force cap are
    included), number of these (censored) values, and number of participants with a value. heading: of the column of
    means."""
    lines = [f"{'frequency':>10}  {heading:>10}  {'cut by cap':>10}  participants"]
    for column, frequency_hz in enumerate(table.frequencies_hz):
        thresholds_n = [threshold_n for row in table.values if (threshold_n := row[column]) is not None]
        censored_count = sum(row[column] for row in table.censored)
        mean_text = f"{format_newtons(sum(thresholds_n) / len(thresholds_n), 3)} N" if thresholds_n else "-"
        lines.append(f"{frequency_hz:7g} Hz  {mean_text:>10}  {censored_count:>10}  {len(thresholds_n):>12}")
    return lines


def _format_model_lines(analysis: StudyAnalysis) -> list[str]:
    """Format lines on the medians (N) of the hierarchical model with their 95 % intervals, on what its fit does not
    determine, on the direction limit and on the comparison of the analyses; empty where it was not fitted."""
    if analysis.primary is None:
        return []
    lines = [f"{'frequency':>10}  {'median':>10}  95 % interval, all answers in one model"]
    for median in analysis.primary.medians:
        median_text = "above cap" if median.above_cap else f"{format_newtons(median.newton, 3)} N"
        unit_text = " N" if median.lower_n is not None else ""
        format_limit = partial(format_newtons, least=3)
        interval_text = (
            format_median_interval(median.lower_n, median.upper_n, median.above_cap, format_limit) + unit_text
        )
        lines.append(f"{median.frequency_hz:7g} Hz  {median_text:>10}  {interval_text}")
    lines += filter(None, [describe_undetermined(analysis.primary).strip()])
    return [*lines, describe_direction_limit(analysis.primary), analysis.comparison_text]


def _compute_ellipses(path: Path | None) -> tuple[EllipsoidResult, ...]:
    """Compute the acceleration ellipses of a recording; empty without a path. Raises StudyError where they cannot be
    computed."""
    if path is None:
        return ()
    recording = read_recording(path)
    try:
        return compute_ellipsoids(recording, read_sensor_frame(recording))
    except ValueError as error:
        raise StudyError(
            "No ellipsoids can be computed",
            f"{path.name}: {error}.",
            "Give a recording made with: hapteq record ellipsoid",
            saved="Nothing was written.",
        ) from error


def _create_private_folder(folder: Path, data: Path) -> None:
    """Create an output folder inside the folder of sessions, readable only by this account. An output folder elsewhere
    is created by `_write_files`. Raises CannotWriteError."""
    if not folder.resolve().is_relative_to(data.resolve()):
        return
    with convert_write_errors(folder):
        make_folder(folder, private=True)
    if folder.resolve() != data.resolve():
        restrict_to_owner(folder, recursive=True)


def _write_files(
    folder: Path,
    analysis: StudyAnalysis,
    pictures: tuple[Picture, ...],
    ellipses: tuple[EllipsoidResult, ...],
    provenance: Provenance,
    collected_trials: CollectedTrials,
) -> None:
    """Remove figures, detection.csv and report of an earlier analysis, then write all files. Raises
    CannotWriteError."""
    figure_folder = folder / "figures"
    with convert_write_errors(figure_folder):
        make_folder(figure_folder)
        if figure_folder.is_symlink():
            raise NotADirectoryError(errno.ENOTDIR, "it is a link, which is not followed")
        # The report is removed first and written last: without it, files may be of different runs.
        (folder / PAGE_NAME).unlink(missing_ok=True)
        for outdated_path in list_analysis_outputs(folder):
            if outdated_path.parent == figure_folder or outdated_path.name == DETECTION_NAME:
                outdated_path.unlink()
    write_thresholds(folder / THRESHOLDS_NAME, analysis.thresholds)
    if analysis.detection:
        write_thresholds(folder / DETECTION_NAME, analysis.detection)
    document = make_anova_document(analysis)
    format_name, version = document.pop("format"), document.pop("version")
    write_json(folder / STATISTICS_NAME, format_name, version, document, provenance, overwrite=True)
    write_pictures(figure_folder, pictures)
    origin = _list_origin(provenance, collected_trials)
    report_html = render_study_report(
        analysis, pictures, origin, format_local_now(), ellipses, collected_trials.model_qualities
    )
    write_text(folder / PAGE_NAME, report_html, overwrite=True)


def _remove_if_withdrawn(folder: Path, collected_trials: CollectedTrials) -> None:
    """Remove the files of the analysis, and raise StudyError, where a participant withdrew since the sessions were
    collected; it names the files that cannot be removed."""
    try:
        require_consent(collected_trials.sessions)
    except StudyError as error:
        for path in list_analysis_outputs(folder):
            with suppress(OSError):
                path.unlink()
        for emptied_folder in (folder / "figures", folder):
            with suppress(OSError):  # it holds files of others
                emptied_folder.rmdir()
        if remaining_paths := list_analysis_outputs(folder):
            error.saved = f"Could not be removed, erase them: {', '.join(str(path) for path in remaining_paths)}."
        raise


def _list_origin(provenance: Provenance, collected_trials: CollectedTrials) -> dict[str, str]:
    """List label and text of the entries of the report's last section, on the origin of the results."""
    return {
        "protocol": f"{collected_trials.protocol.name}, hash {collected_trials.protocol_hash}",
        "locked before the data": collected_trials.lock_statement,
        "device": ", ".join(collected_trials.devices) or "none",
        "participants": ", ".join(collected_trials.observers) or "people",
        "sessions": ", ".join(folder.name for folder in collected_trials.sessions) or "none",
        "left out": " ".join(collected_trials.exclusions) or "nothing",
        "seeds": ", ".join(str(seed) for seed in collected_trials.seeds) or "none",
        "versions": ", ".join(f"{name} {version}" for name, version in provenance.versions.items()),
        "command": " ".join(provenance.command),
    }
