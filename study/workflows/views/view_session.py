"""View of one session for screen and command line: facts, thresholds, staircases, and the log as sentences.

Nothing is changed. A damaged session is shown as far as it can be read, with warnings, not raised as a StudyError.
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.psychophysics.thresholds import RunEnd, Threshold
from analysis.wording import MISSING, format_newtons
from protocols.procedure.schedule import Run
from protocols.trial import Phase
from study.errors import StudyError
from study.session.facts.event_words import describe_log
from study.session.state.state import SessionState
from study.session.views.archive_views import SessionLine, SessionView, Staircase
from study.session.views.local_time import Zone, format_time_in_zone, to_utc
from study.session.views.printable import make_printable
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import read_valid_events
from study.workflows.results.analysis_files import ANALYSIS_NAME, PAGE_NAME
from study.workflows.results.fold_session import FoldedSession, fold_session
from study.workflows.results.session_results import list_due_results
from study.workflows.views.session_facts import list_session_facts
from study.workflows.views.session_line import make_line_from_state, make_session_line, mark_running

if TYPE_CHECKING:
    from analysis.psychophysics.study_analysis import StudyAnalysis

THRESHOLD_HEADER = ("run", "phase", "at", "threshold", "delivered", "rev.", "trials", "right", "remark")
"""Columns of the table of thresholds; at: frequency, rev.: number of reversals, right: percentage of right answers."""


def make_session_view(path: Path, zone: Zone = to_utc) -> SessionView:
    """Make the view of the session in the folder `path`. zone: time zone of the displayed times, UTC by default; a
    screen for a person takes `study.local_clock.convert_to_machine_zone`."""
    view = _make_view(SessionFolder(path.absolute()), zone)
    # The session is resumed, analysed or withdrawn by its path, which is not shown.
    return replace(make_printable(view), line=replace(make_printable(view.line), path=view.line.path))


def _make_view(folder: SessionFolder, zone: Zone) -> SessionView:
    """Make the view of a session, in which unprintable characters are not replaced yet."""
    try:
        folded_session = None if folder.withdrawn else fold_session(folder)
    except StudyError as error:
        return _make_damaged_view(folder, error, zone)
    if folded_session is None:
        return _make_minimal_view(folder, make_session_line(folder))
    return _make_full_view(folder, folded_session, zone)


def _make_full_view(folder: SessionFolder, folded_session: FoldedSession, zone: Zone) -> SessionView:
    """Make the view of a session whose log was read without damage."""
    state = folded_session.state
    analysis, analysis_problem = _analyse_session(state)
    clock_remarks = (
        f"Before {format_time_in_zone(step.utc, zone)}: {step.sentence}" for step in state.sitting.clock_steps
    )
    return SessionView(
        line=mark_running(make_line_from_state(state, folder), folder),
        facts=list_session_facts(folded_session, zone),
        thresholds=_tabulate_thresholds(state, analysis),
        warnings=(
            *_list_log_remarks(folder, folded_session),
            *clock_remarks,
            *analysis_problem,
            *(analysis.warnings if analysis else ()),
        ),
        staircases=_list_staircases(state, analysis),
        events=describe_log(folded_session.log_contents.events, zone),
        report=_find_report(folder),
        figures=_list_figures(folder),
    )


def _list_log_remarks(folder: SessionFolder, folded_session: FoldedSession) -> tuple[str, ...]:
    """List sentences on an incomplete last line, on results that are missing or out of date, and on missing
    checksums."""
    due_files_text = ", ".join(list_due_results(folder, folded_session))
    remarks = (
        (
            folded_session.log_contents.torn_bytes,
            "A crash left the last line of the log incomplete; it is removed when the session is resumed.",
        ),
        (due_files_text, f"Missing or not as the log gives it: {due_files_text}. hapteq resume writes it."),
        (
            not folded_session.log_contents.chain.first_checksum_line,
            "The log contains no checksums: an older version wrote it.",
        ),
    )
    return tuple(text for has_problem, text in remarks if has_problem)


def _make_damaged_view(folder: SessionFolder, error: StudyError, zone: Zone) -> SessionView:
    """Make the view of a damaged session: its line in the list of sessions, the problem, and the events that can be
    read."""
    line = make_session_line(folder)
    if line.standing != "unreadable":  # the line reads only parts of the log, and did not find the damage
        line = SessionLine(
            line.name, line.path, line.subject, line.protocol, line.begun_utc, line.observer,
            line.answers, 0, line.runs, "unreadable", error.happened,
        )  # fmt: skip
    sentences = tuple(part for part in (error.happened, error.saved, error.do_now) if part)
    events = describe_log(read_valid_events(folder.log), zone)
    return _make_minimal_view(folder, line, warnings=(f"{error.title}.", *sentences), events=events)


def _make_minimal_view(
    folder: SessionFolder, line: SessionLine, warnings: tuple[str, ...] = (), events: tuple[str, ...] = ()
) -> SessionView:
    """Make the view of a withdrawn or damaged session, without thresholds and staircases."""
    facts = (("participant", line.subject), ("folder", str(folder.path)))
    shown_warnings = warnings or ((line.remark,) if line.remark else ())
    return SessionView(line, facts, (), shown_warnings, (), events, _find_report(folder), _list_figures(folder))


def _analyse_session(state: SessionState) -> "tuple[StudyAnalysis | None, tuple[str, ...]]":
    """Analyse this session alone. Returns the analysis and no sentence, or None and a sentence on why there is none."""
    # Imported here: statistics load slowly, and programs that import this module must start at once.
    from analysis.psychophysics.runs import InconsistentTrialsError
    from analysis.psychophysics.study_analysis import analyse_study

    try:
        return analyse_study(state.trials, state.protocol), ()
    except InconsistentTrialsError as error:
        return None, (f"No thresholds: {error}.",)


def _tabulate_thresholds(state: SessionState, analysis: "StudyAnalysis | None") -> tuple[tuple[str, ...], ...]:
    """Tabulate the thresholds below their header; empty while no run is complete."""
    thresholds = (*analysis.thresholds, *analysis.detection) if analysis else ()
    if not any(threshold.complete for threshold in thresholds):
        return ()
    return (
        THRESHOLD_HEADER,
        *(_format_threshold_row(threshold, state.runs[threshold.run]) for threshold in thresholds),
    )


def _format_threshold_row(threshold: Threshold, run: Run) -> tuple[str, ...]:
    """Format the row of a run under `THRESHOLD_HEADER`: threshold in N and, where it was measured, in m/s²."""
    remark = "cut by the cap" if threshold.censored else ""
    if not threshold.complete:
        remark = "trial limit" if threshold.ended is RunEnd.TRIAL_LIMIT else "not complete"
    threshold_text = f"{format_newtons(threshold.threshold_n, 3)} N" if threshold.complete else MISSING
    return (
        str(threshold.run + 1),
        run.phase.value,
        f"{threshold.frequency_hz:g} Hz",
        threshold_text,
        MISSING if threshold.threshold_mps2 is None else f"{threshold.threshold_mps2:.2f} m/s²",
        str(threshold.reversals),
        str(threshold.trials),
        MISSING if threshold.percent_correct is None else f"{threshold.percent_correct:.0f} %",
        remark,
    )


def _list_staircases(state: SessionState, analysis: "StudyAnalysis | None") -> tuple[Staircase, ...]:
    """List the staircases of all runs with counted trials, except practice."""
    thresholds_by_run = (
        {threshold.run: threshold for threshold in (*analysis.thresholds, *analysis.detection)} if analysis else {}
    )
    shown_runs = (run for run in state.runs if not run.practice)
    staircases = (_make_staircase(state, run, thresholds_by_run.get(run.index)) for run in shown_runs)
    return tuple(staircase for staircase in staircases if staircase.levels_n)


def _make_staircase(state: SessionState, run: Run, threshold: Threshold | None) -> Staircase:
    """Make the staircase of a run: levels (N), answers and reversals of its counted trials, without catch trials."""
    counted_trials = [
        presented_trial
        for presented_trial in state.trials
        if presented_trial.run == run.index and presented_trial.is_valid and presented_trial.phase is not Phase.CATCH
    ]
    ending = "" if run.index < state.run else ", not complete"
    return Staircase(
        title=f"Run {run.index + 1}: {run.frequency_hz:g} Hz, {run.phase.value}{ending}",
        levels_n=tuple(trial.staircase_n for trial in counted_trials),
        correct=tuple(bool(trial.correct) for trial in counted_trials),
        reversals=tuple(trial.reversal for trial in counted_trials),
        threshold_n=threshold.threshold_n if threshold is not None else None,
        cap_n=state.protocol.staircase.cap_n,
    )


def _find_report(folder: SessionFolder) -> str:
    """Find the path of the report of the session's analysis; empty if there is none."""
    report_path = folder.path / ANALYSIS_NAME / PAGE_NAME
    return str(report_path) if report_path.is_file() else ""


def _list_figures(folder: SessionFolder) -> tuple[str, ...]:
    """List the paths of the PNG figures of the session's analysis, by name; empty without any."""
    return tuple(str(path) for path in sorted((folder.path / ANALYSIS_NAME / "figures").glob("*.png")))
