"""End of a sitting, after the device was closed: write the results of a finished session, or raise an error.

For an unfinished session the error states how to resume it; a withdrawal of consent erases the participant's data.
"""

from dataclasses import replace

from study.devices.device import Fault
from study.errors import DeviceError, StudyError, UserInterruptError
from study.session.facts.void_reasons import TOO_BUSY
from study.session.views.count_text import format_answer_count
from study.session.views.resume_command import format_resume_command
from study.store.sessions.archive import SessionFolder
from study.store.sessions.session_lock import hold_session_lock
from study.workflows.results.analysis_files import ANALYSIS_NAME, is_analysis_of
from study.workflows.results.fold_session import FoldedSession
from study.workflows.results.session_results import REPORT_NAME, finish_tables, list_due_results, write_tables
from study.workflows.results.write_results import write_results
from study.workflows.results.written_analysis import WrittenAnalysis
from study.workflows.session.conduct_session import ConductedSitting
from study.workflows.session.prepare_sitting import make_ineligible_error
from study.workflows.session.resume_session import make_finished_error
from study.workflows.session.withdraw_participant import list_remaining_copies, plan_withdrawal, withdraw

FAULTS_FOR_DOCTOR = frozenset(Fault) - {Fault.NONE, Fault.STALLED, Fault.HELD_TOO_LONG, Fault.STOPPED}
"""Faults for which `hapteq doctor` is recommended: all except those caused by the program's timing or by a person."""

CLOSE_PROGRAMS_ADVICE = "Close other programs, and measure with hapteq doctor whether that helps. "


def end_sitting(sitting: ConductedSitting, utc: str) -> WrittenAnalysis:
    """Write and return the results of a finished session. Raises StudyError for a withdrawal (after erasing the
    participant's data), for a participant who refused or was excluded, and for an unfinished session.

    sitting: how the sitting ended. utc: date and time of a withdrawal, ISO 8601."""
    if sitting.withdrawn:
        raise _erase_participant(sitting, utc)
    if sitting.state.is_finally_ineligible:
        write_tables(sitting.folder)
        raise make_ineligible_error(sitting.state)
    if sitting.end_reason:
        raise _make_unfinished_error(sitting)
    return write_results(sitting.folder)


def write_missing_results(folder: SessionFolder, folded_session: FoldedSession) -> WrittenAnalysis:
    """Write those results of a closed session that are missing or out of date, for example because the program was
    killed after the last run. Raises StudyError if all results are up to date, if the participant refused or was
    excluded, or if results cannot be written."""
    if folded_session.state.is_finally_ineligible:
        finish_tables(folder, folded_session)
        raise make_ineligible_error(folded_session.state)
    due_report_files = () if is_analysis_of(folder.path / ANALYSIS_NAME, folder.log) else (REPORT_NAME,)
    due_files = (*list_due_results(folder, folded_session), *due_report_files)
    if not due_files:
        raise make_finished_error(folded_session.state, folder)
    with hold_session_lock(folder.path):
        analysis = write_results(folder)
    remark = (
        f"{folder.name} had all its runs already; written now, because missing or out of date: {', '.join(due_files)}."
    )
    return replace(analysis, warnings=(remark, *analysis.warnings))


def _make_unfinished_error(sitting: ConductedSitting) -> StudyError:
    """Make the error of an unfinished session: DeviceError if the device had a fault, otherwise UserInterruptError. The
    advice names `hapteq doctor` for `FAULTS_FOR_DOCTOR`, or closing other programs if the computer was too busy."""
    error_type = UserInterruptError if sitting.fault is Fault.NONE else DeviceError
    device_advice = (
        f"Run hapteq doctor --device {sitting.device_name}, which says what is wrong with it, and correct that. "
    )
    advice = device_advice if sitting.fault in FAULTS_FOR_DOCTOR else ""
    if sitting.end_reason.startswith(TOO_BUSY):
        advice = CLOSE_PROGRAMS_ADVICE
    return error_type(
        "The session is not finished",
        f"The sitting ended: {sitting.end_reason}."
        f"{f' {sitting.fault_text[0].upper()}{sitting.fault_text[1:]}.' if sitting.fault_text else ''}",
        f"{advice}Continue with: {format_resume_command(str(sitting.folder.path), sitting.device_name)}",
        saved=f"{format_answer_count(sitting.state.answers)} on disk.",
    )


def _erase_participant(sitting: ConductedSitting, utc: str) -> StudyError:
    """Erase all data of the participant. Returns the error to raise, which lists the erased sessions."""
    data_folder = sitting.folder.path.parent
    erased = withdraw(data_folder, plan_withdrawal(sitting.folder), utc)
    return UserInterruptError(
        "The participant withdrew",
        f"Everything recorded of {erased.subject} was erased: {', '.join(erased.sessions)}.",
        " ".join((*erased.doubtful, *list_remaining_copies(data_folder, erased))),
    )
