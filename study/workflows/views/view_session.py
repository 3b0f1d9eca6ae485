"""View of one session for screen and command line: facts, thresholds, staircases, and the log in words.

Nothing is changed. A damaged session is shown as far as it can be read, with warnings; it never raises an error.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from analysis.psychophysics.thresholds import RunEnd, Threshold
from analysis.wording import MISSING, format_number
from protocols.procedure.schedule import Run
from protocols.trial import Phase
from study.errors import StudyError
from study.session.facts.event_words import describe_log
from study.session.state.state import SessionState
from study.session.views.archive_views import SessionLine, SessionView, Staircase
from study.session.views.local_time import Zone, in_utc, local_time
from study.session.views.printable import printable
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import read_valid_events
from study.workflows.results.analysis_files import ANALYSIS_NAME
from study.workflows.results.fold_session import FoldedSession, fold_session
from study.workflows.results.session_results import list_due_results
from study.workflows.views.session_facts import session_facts
from study.workflows.views.session_line import line_of, session_line, with_writer

if TYPE_CHECKING:
    from analysis.psychophysics.study_analysis import StudyAnalysis

THRESHOLD_HEADER = ("run", "phase", "at", "threshold", "delivered", "rev.", "trials", "right", "remark")
"""Columns of the table of thresholds."""


def session_view(path: Path, zone: Zone = in_utc) -> SessionView:
    """The view of the session in the folder `path`. zone: time zone of the displayed times, UTC by default; a screen
    for a person takes `study.local_clock.machine_zone`.
    """
    folder = SessionFolder(path.absolute())
    try:
        folded_session = None if folder.withdrawn else fold_session(folder)
    except StudyError as problem:
        return printable(_view_damaged(folder, problem, zone))
    return printable(
        _minimal_view(folder, session_line(folder))
        if folded_session is None
        else _full_view(folder, folded_session, zone)
    )


def _full_view(folder: SessionFolder, folded_session: FoldedSession, zone: Zone) -> SessionView:
    """View of a session whose log was read without damage."""
    state = folded_session.state
    analysis, problem = _analysis(state)
    clock = (f"Before {local_time(step.utc, zone)}: {step.sentence}" for step in state.sitting.clock_steps)
    return SessionView(
        line=with_writer(line_of(state, folder), folder),
        facts=session_facts(folded_session, zone),
        thresholds=_threshold_rows(state, analysis),
        warnings=(*_log_remarks(folder, folded_session), *clock, *problem, *(analysis.warnings if analysis else ())),
        staircases=_staircases(state, analysis),
        events=describe_log(folded_session.log_contents.events, zone),
        report=_report(folder),
        figures=_figures(folder),
    )


def _log_remarks(folder: SessionFolder, folded_session: FoldedSession) -> tuple[str, ...]:
    """Sentences on an incomplete last line, results that are missing or out of date, and missing checksums."""
    due_files = ", ".join(list_due_results(folder, folded_session))
    remarks = (
        (
            folded_session.log_contents.torn_bytes,
            "A crash left the last line of the log incomplete; it is removed when the session is resumed.",
        ),
        (due_files, f"Missing or not as the log gives it: {due_files}. hapteq resume writes it."),
        (not folded_session.log_contents.chain.since, "The log contains no checksums: an older version wrote it."),
    )
    return tuple(text for applies, text in remarks if applies)


def _view_damaged(folder: SessionFolder, problem: StudyError, zone: Zone) -> SessionView:
    """View of a damaged session: its line, the problem, and the events that can be read."""
    line = session_line(folder)
    if line.standing != "unreadable":  # the line reads only parts of the log, and did not find the damage
        line = SessionLine(
            line.name, line.path, line.subject, line.protocol, line.begun_utc, line.observer,
            line.answers, 0, line.runs, "unreadable", problem.happened,
        )  # fmt: skip
    sentences = tuple(part for part in (problem.happened, problem.saved, problem.do_now) if part)
    events = describe_log(read_valid_events(folder.log), zone)
    return _minimal_view(folder, line, warnings=(f"{problem.title}.", *sentences), events=events)


def _minimal_view(
    folder: SessionFolder, line: SessionLine, warnings: tuple[str, ...] = (), events: tuple[str, ...] = ()
) -> SessionView:
    """View of a withdrawn or damaged session, without thresholds and staircases."""
    facts = (("participant", line.subject), ("folder", str(folder.path)))
    notes = warnings or ((line.remark,) if line.remark else ())
    return SessionView(line, facts, (), notes, (), events, _report(folder), _figures(folder))


def _analysis(state: SessionState) -> "tuple[StudyAnalysis | None, tuple[str, ...]]":
    """Analysis of the session alone, or None with a sentence on why there is none."""
    # Imported here: statistics load slowly, and programs that import this module must start at once.
    from analysis.psychophysics.study_analysis import analyse_study

    try:
        return analyse_study(state.trials, state.protocol), ()
    except ValueError as problem:
        return None, (f"No thresholds: {problem}.",)


def _threshold_rows(state: SessionState, analysis: "StudyAnalysis | None") -> tuple[tuple[str, ...], ...]:
    """Table of thresholds with its header; empty while no run is complete."""
    rows = (*analysis.thresholds, *analysis.detection) if analysis else ()
    if not any(row.complete for row in rows):
        return ()
    return (THRESHOLD_HEADER, *(_threshold_row(row, state.runs[row.run]) for row in rows))


def _threshold_row(row: Threshold, run: Run) -> tuple[str, ...]:
    """Row of a run under `THRESHOLD_HEADER`: threshold in N and, where it was measured, in m/s²."""
    remark = "cut by the cap" if row.censored else ""
    if not row.complete:
        remark = "trial limit" if row.ended is RunEnd.TRIAL_LIMIT else "not complete"
    threshold = f"{format_number(row.threshold_n, 3)} N" if row.complete else MISSING
    return (
        str(row.run + 1),
        run.phase.value,
        f"{row.frequency_hz:g} Hz",
        threshold,
        MISSING if row.threshold_mps2 is None else f"{row.threshold_mps2:.2f} m/s²",
        str(row.reversals),
        str(row.trials),
        MISSING if row.percent_correct is None else f"{row.percent_correct:.0f} %",
        remark,
    )


def _staircases(state: SessionState, analysis: "StudyAnalysis | None") -> tuple[Staircase, ...]:
    """Staircases of all runs with counted trials, except practice."""
    rows = {row.run: row for row in (*analysis.thresholds, *analysis.detection)} if analysis else {}
    shown_runs = (run for run in state.runs if not run.practice)
    staircases = (_staircase(state, run, rows.get(run.index)) for run in shown_runs)
    return tuple(staircase for staircase in staircases if staircase.levels_n)


def _staircase(state: SessionState, run: Run, row: Threshold | None) -> Staircase:
    """Levels (N), answers and reversals of the counted trials of a run, without catch trials."""
    counted_trials = [t for t in state.trials if t.run == run.index and t.counts and t.phase is not Phase.CATCH]
    is_complete = run.index < state.run
    return Staircase(
        title=f"Run {run.index + 1}: {run.frequency_hz:g} Hz, {run.phase.value}"
        f"{'' if is_complete else ', not complete'}",
        levels_n=tuple(trial.staircase_n for trial in counted_trials),
        correct=tuple(bool(trial.correct) for trial in counted_trials),
        reversals=tuple(trial.reversal for trial in counted_trials),
        threshold_n=row.threshold_n if row is not None else None,
        cap_n=state.protocol.staircase.cap_n,
    )


def _report(folder: SessionFolder) -> str:
    """Path of the report of the session's analysis; empty if there is none."""
    report = folder.path / ANALYSIS_NAME / "report.html"
    return str(report) if report.is_file() else ""


def _figures(folder: SessionFolder) -> tuple[str, ...]:
    """Paths of the PNG figures of the session's analysis."""
    return tuple(str(path) for path in sorted((folder.path / ANALYSIS_NAME / "figures").glob("*.png")))
