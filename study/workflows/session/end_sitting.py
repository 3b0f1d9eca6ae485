"""End of a sitting, after the device was closed: write the results of a finished session, or raise why there are none.

An unfinished session gives an error that states how to resume it; a withdrawal erases the participant's data.
"""

from dataclasses import replace

from study.devices.device import Fault
from study.devices.opening import SIMULATED
from study.errors import DeviceError, StudyError, UserInterruptError
from study.session.facts.void_reasons import TOO_BUSY
from study.session.views.count_text import answers_are
from study.store.sessions.archive import SessionFolder
from study.store.sessions.session_lock import hold_session_lock
from study.workflows.results.analysis_files import ANALYSIS_NAME, is_analysis_of
from study.workflows.results.fold_session import FoldedSession
from study.workflows.results.session_results import REPORT_NAME, finish_tables, list_due_results, write_tables
from study.workflows.results.write_results import write_results
from study.workflows.results.written_analysis import WrittenAnalysis
from study.workflows.session.conduct_session import ConductedSitting
from study.workflows.session.prepare_sitting import does_not_take_part
from study.workflows.session.resume_session import already_finished
from study.workflows.session.withdraw_participant import copies_elsewhere, plan_withdrawal, withdraw

DEVICE_FAULTS = frozenset(Fault) - {Fault.NONE, Fault.STALLED, Fault.HELD_TOO_LONG, Fault.STOPPED}
"""Faults that `hapteq doctor` may explain: all except those due to the timing of the program or to a person."""

BUSY_ADVICE = "Close other programs, and measure with hapteq doctor whether that helps. "
"""Remedy where a sitting ended because the computer was too busy, for messages."""


def end_sitting(end: ConductedSitting, utc: str) -> WrittenAnalysis:
    """Write and return the results. Raises StudyError after erasing the data of a participant who withdrew, for a
    participant who does not take part, and for an unfinished session, with the command to continue."""
    if end.withdrawn:
        raise _erase_withdrawn(end, utc)
    if end.state.is_finally_ineligible:
        write_tables(end.folder)
        raise does_not_take_part(end.state)
    if end.end_reason:
        raise _not_finished(end)
    return write_results(end.folder)


def finish_closed(folder: SessionFolder, folded_session: FoldedSession) -> WrittenAnalysis:
    """Write the results of a closed session that are missing or out of date, for example because the program was killed
    after the last run. Raises StudyError where none is, or where they cannot be written."""
    if folded_session.state.is_finally_ineligible:
        finish_tables(folder, folded_session)
        raise does_not_take_part(folded_session.state)
    report = () if is_analysis_of(folder.path / ANALYSIS_NAME, folder.log) else (REPORT_NAME,)
    due_files = (*list_due_results(folder, folded_session), *report)
    if not due_files:
        raise already_finished(folded_session.state, folder)
    with hold_session_lock(folder.path):
        analysis = write_results(folder)
    text = (
        f"{folder.name} had all its runs already; written now, because missing or out of date: {', '.join(due_files)}."
    )
    return replace(analysis, warnings=(text, *analysis.warnings))


def _not_finished(end: ConductedSitting) -> StudyError:
    """Error for an unfinished session: UserInterruptError without a fault of the device, else DeviceError."""
    kind = UserInterruptError if end.fault is Fault.NONE else DeviceError
    device_advice = (
        f"Run hapteq doctor --device {end.device_name}, which says what is wrong with it, and correct that. "
    )
    advice = device_advice if end.fault in DEVICE_FAULTS else ""
    if end.end_reason.startswith(TOO_BUSY):
        advice = BUSY_ADVICE
    option = "" if end.device_name == SIMULATED else f" --device {end.device_name}"
    return kind(
        "The session is not finished",
        f"The sitting ended: {end.end_reason}."
        f"{f' {end.fault_text[0].upper()}{end.fault_text[1:]}.' if end.fault_text else ''}",
        f"{advice}Continue with: hapteq resume {end.folder.path}{option}",
        saved=f"{answers_are(end.state.answers)} on disk.",
    )


def _erase_withdrawn(end: ConductedSitting, utc: str) -> StudyError:
    """Erase everything recorded of the participant; returns the error to raise, which lists the erased sessions."""
    data, plan = end.folder.path.parent, plan_withdrawal(end.folder)
    external_copies = copies_elsewhere(data, plan)
    withdraw(data, plan, utc)
    return UserInterruptError(
        "The participant withdrew",
        f"Everything recorded of {plan.subject} was erased: {', '.join(plan.sessions)}.",
        " ".join((*plan.doubtful, *external_copies)),
    )
