"""Prepare each sitting: consent, exclusion criteria, set-up, and the check of device and computer.

The state decides which step is due (`find_next_preparation`) and each result is logged at once.
"""

from dataclasses import replace

from study.errors import StudyError
from study.session.facts.events import DeviceChecked, FormFilled, SessionClosed
from study.session.state.machine import CheckDevice, EndSitting, FillIn, find_next_preparation
from study.session.state.state import SessionState
from study.session.views.archive_views import INELIGIBILITY_REASONS
from study.session.views.form_views import Form, FormKind
from study.session.views.forms import is_confirmed, judge_form, make_confirmation, make_words
from study.session.views.participant_views import DeviceFinding
from study.session.watching.requests import NoteAsked
from study.workflows.checks.check_device import check_device
from study.workflows.checks.check_timing import check_computer
from study.workflows.checks.computer_load import get_load_per_processor
from study.workflows.checks.daily_check import judge_last_check
from study.workflows.trial.sitting import Sitting, log_and_apply, write_notes


def prepare_sitting(state: SessionState, sitting: Sitting) -> tuple[SessionState, str]:
    """Run all steps of the preparation that are due. Returns the new state, and the reason why the sitting ends before
    the first trial; empty if it continues."""
    while (due_step := find_next_preparation(state)) is not None:
        match due_step:
            case EndSitting(reason=reason):
                return state, reason
            case FillIn(form=form):
                state = present_form(state, form, sitting)
            case CheckDevice():
                state = _check_device_and_computer(state, sitting)
        state = write_notes(state, sitting)
        if stop_reason := sitting.supervisor.stop_reason:
            return state, stop_reason
    return state, ""


def present_form(state: SessionState, form: Form, sitting: Sitting) -> SessionState:
    """Present a form, and log the outcome. A failed form must be confirmed, and is presented once more if it is not.
    Raises ValueError for the form on the handle, which is not logged as a form."""
    if form.kind is FormKind.HANDLE:
        raise ValueError("whether the handle is free is logged with the reference, not as a form")
    sitting.supervisor.start_activity("form")
    reply = sitting.display.fill_in(form)
    outcome = judge_form(state.protocol, form, reply)
    if not outcome.passed:
        confirmation = make_confirmation(form, reply, make_words(state.protocol))
        if not is_confirmed(confirmation, sitting.display.fill_in(confirmation)):
            # The answer may have been a slip: only the second one counts and is stored.
            outcome = judge_form(state.protocol, form, sitting.display.fill_in(form))
    event = FormFilled(
        utc=sitting.clock.utc(),
        form=form.kind.value,
        version=form.version,
        ethics_id=form.ethics_id,
        passed=outcome.passed,
        answers=outcome.kept,
    )
    state = log_and_apply(state, event, sitting)
    if outcome.reminder:
        sitting.display.trouble(outcome.reminder)
        sitting.supervisor.add_note(NoteAsked("program", outcome.reminder))
    return state


def close_ineligible_session(state: SessionState, sitting: Sitting) -> SessionState:
    """Close the session of a participant who refused or was excluded; pending notes and the outcome are logged."""
    state = write_notes(state, sitting)
    outcome = state.sitting.ineligibility or "refused"
    return log_and_apply(state, SessionClosed(utc=sitting.clock.utc(), outcome=outcome), sitting)


def make_ineligible_error(state: SessionState) -> StudyError:
    """Make the error for a person who refused or was excluded."""
    return StudyError(
        "This person does not take part",
        f"{state.opened.session} is over: {INELIGIBILITY_REASONS[state.sitting.ineligibility or 'refused']}.",
        "Begin a session for the next participant.",
        saved="Nothing was played. Only this outcome is kept, and no place in the order of conditions was taken.",
    )


def _check_device_and_computer(state: SessionState, sitting: Sitting) -> SessionState:
    """Check device and computer once, and log the findings and whether the experimenter continues. The preparation
    repeats the check until the experimenter does."""
    sitting.supervisor.start_activity("preparing")
    device, clock = sitting.device, sitting.clock
    safety = state.protocol.safety
    report = check_device(device, clock, sitting.place_m, safety.total_cap_n, safety)
    # In virtual time the load of the computer has no effect.
    load_per_processor = None if clock.virtual else get_load_per_processor()
    computer_findings = check_computer(clock, device.info.sample_rate_hz, device.info.simulated, load_per_processor)
    daily_check_findings = (
        () if device.info.simulated else (judge_last_check(device.info, state.protocol.setup.daily_check_needed),)
    )
    report = replace(report, findings=(*report.findings, *computer_findings, *daily_check_findings))
    is_accepted = sitting.display.device_checked(report)
    findings = tuple(f"{finding.name}: {finding.value}{_format_finding_mark(finding)}" for finding in report.findings)
    return log_and_apply(state, DeviceChecked(utc=sitting.clock.utc(), passed=is_accepted, findings=findings), sitting)


def _format_finding_mark(finding: DeviceFinding) -> str:
    """Format the mark of a finding in the log: empty if fine, " (warning)" or " (not fine)" otherwise."""
    if finding.fine:
        return ""
    return " (warning)" if finding.warning else " (not fine)"
