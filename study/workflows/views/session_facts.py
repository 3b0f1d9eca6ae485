"""Facts about a session as text: pairs (label, value) in display order, for `view_session`.

They are taken from the session's verified log (`FoldedSession`). Empty values are left out.
"""

from equalizer.plant.model_quality import NOT_STORED
from study.session.facts.events import FormFilled, SessionClosed, SessionOpened, SessionResumed, TrialSpoiled
from study.session.facts.void_reasons import is_computer_busy
from study.session.state.state import SessionState
from study.session.views.local_time import Zone, format_time_in_zone
from study.workflows.results.collect_sessions import HASH_DIGITS
from study.workflows.results.fold_session import FoldedSession


def list_session_facts(folded_session: FoldedSession, zone: Zone) -> tuple[tuple[str, str], ...]:
    """List pairs (label, value) in display order. zone: time zone of the displayed times."""
    state, events = folded_session.state, folded_session.log_contents.events
    session_opened = state.opened
    participant_text = f"simulated ({session_opened.observer})" if session_opened.observer else "a person"
    lock_text = "locked" if session_opened.protocol_locked else "not locked"
    # A simulated participant runs faster than real time, so that the log may end in the future.
    time_remark = ", in simulated time, which runs ahead of the clock" if session_opened.observer else ""
    facts = [
        ("participant", f"{session_opened.subject}, {participant_text}, {_describe_number(state)}"),
        ("protocol", f"{state.protocol.name} ({session_opened.protocol_hash[:HASH_DIGITS]}, {lock_text})"),
        ("title", state.protocol.title),
        ("device", _describe_device(session_opened)),
        ("equalizer", session_opened.equalizer),
        ("its quality", "" if session_opened.equalized is None else session_opened.equalized.quality or NOT_STORED),
        ("within reach", _format_reachable_levels(session_opened)),
        ("begun", format_time_in_zone(session_opened.utc, zone, "seconds")),
        (_name_end_time(state), format_time_in_zone(_find_last_utc(folded_session), zone, "seconds") + time_remark),
        ("sittings", str(1 + sum(isinstance(event, SessionResumed) for event in events))),
        ("runs", f"{state.run} of {len(state.runs)}"),
        ("answers", _describe_answers(folded_session)),
        *_list_form_answers(folded_session),
        ("log", _describe_log(folded_session)),
        ("seed", str(session_opened.seed)),
        ("versions", ", ".join(f"{name} {version}" for name, version in session_opened.versions.items())),
    ]
    return tuple((label, value) for label, value in facts if value)


def _name_end_time(state: SessionState) -> str:
    """Name the time of the log's last event: of a participant turned away, a finished session, or an unfinished one."""
    if state.sitting.ineligibility:
        return "ended"
    return "finished" if state.closed else "last entry"


def _describe_number(state: SessionState) -> str:
    """Describe the number of the participant in the counterbalanced order of the protocol, from 1; in words where none
    is assigned yet."""
    if not state.has_final_place:
        return "without a place in the order of this protocol"
    return f"number {state.opened.participant_number + 1} of this protocol"


def _format_reachable_levels(session_opened: SessionOpened) -> str:
    """Format the acceleration (m/s²) that both directions reach at the cap, by frequency; "" without an equalizer."""
    if session_opened.equalized is None:
        return ""
    return ", ".join(
        f"{level.reachable_mps2:.1f} m/s² at {level.frequency_hz:g} Hz" for level in session_opened.equalized.levels
    )


def _describe_device(session_opened: SessionOpened) -> str:
    """Describe the device: its name, whether it is simulated, and its sample rate (Hz)."""
    device = session_opened.device
    simulated_text = ", simulated: nothing moves" if device.simulated else ""
    return f"{device.name}{simulated_text}, {device.sample_rate_hz:g} Hz"


def _describe_answers(folded_session: FoldedSession) -> str:
    """Describe the number of answers and of void presentations; a presentation that still waits for its answer is not
    void."""
    state = folded_session.state
    void_count = len(state.trials) - state.answers - (state.presented is not None and state.answered is None)
    if not void_count:
        return str(state.answers)
    reasons = [event.reason for event in folded_session.log_contents.events if isinstance(event, TrialSpoiled)]
    busy_count = sum(map(is_computer_busy, reasons))
    busy_text = f", {busy_count} of them because the computer was too busy" if busy_count else ""
    return f"{state.answers}, and {void_count} void presentations{busy_text}"


def _find_last_utc(folded_session: FoldedSession) -> str:
    """Find the UTC time of the session's end, or else of the last event."""
    closing_utc = next(
        (event.utc for event in folded_session.log_contents.events if isinstance(event, SessionClosed)), ""
    )
    return closing_utc or folded_session.log_contents.events[-1].utc


def _describe_log(folded_session: FoldedSession) -> str:
    """Describe the log: number of lines, and the evidence that it is unchanged: checksums and seals."""
    length_text = f"{folded_session.log_contents.chain.lines} lines"
    seal_text = f", sealed to line {folded_session.sealed_lines}" if folded_session.sealed_lines else ""
    return f"{length_text}, {folded_session.log_contents.chain.describe()}{seal_text}"


def _list_form_answers(folded_session: FoldedSession) -> tuple[tuple[str, str], ...]:
    """List pairs (label, value) of consent and answers to questions. Free text is left out, because it may concern
    health."""
    protocol = folded_session.state.protocol
    questions_by_form = {"questionnaire": protocol.before, "debrief": protocol.debrief}
    answer_facts = []
    for event in folded_session.log_contents.events:
        if isinstance(event, FormFilled) and event.form == "consent":
            answer_facts.append(("consent", f"{'given' if event.passed else 'not given'}, version {event.version}"))
        if isinstance(event, FormFilled) and event.form in questions_by_form:
            answer_facts += [
                ("said", f"{question.question} {event.answers[question.key]}")
                for question in questions_by_form[event.form]
                if question.key in event.answers and not question.is_free_text
            ]
    return tuple(answer_facts)
