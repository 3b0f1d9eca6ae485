"""Plan of each study in a data folder (`hapteq study-plan`): planned, finished and excluded participants, and the
order of frequencies that the next participant receives. Only reads files.

A participant may have several sessions; the session with the most progress counts. The balanced design is computed by
`protocols.procedure.study_plan`; a cell of the design is an order of frequencies and a labelling of the answers.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from protocols.definition.study_protocol import StudyProtocol
from protocols.document.loading import ProtocolError, load_protocol
from protocols.procedure.study_plan import Cell, Participant, Progress, StudyPlan, plan_study
from study.errors import StudyError, WrongUseError
from study.session.facts.events import SessionOpened
from study.session.views.archive_views import SessionLine
from study.session.views.participant_codes import suggest_code
from study.store.formats.protocol_files import read_study_protocol
from study.store.sessions.archive import SessionFolder, list_session_folders
from study.store.sessions.event_log import read_opening
from study.workflows.session.participant_number import find_participant_number, read_begun_participant
from study.workflows.views.session_line import make_session_line

PROGRESS_BY_STANDING: dict[str, Progress] = {"finished": "done", "unfinished": "begun", "running": "begun"}
"""Progress of a participant, by the standing of the best session; with any other standing the participant is left
out."""
STANDINGS_BEST_FIRST = ("finished", "running", "unfinished")
"""Standings in the order in which the best session of a participant is chosen."""


@dataclass(frozen=True, slots=True)
class PlannedStudy:
    """Plan of a study from the sessions begun so far, and the code of the next participant."""

    plan: StudyPlan
    next_code: str
    """An unused participant code in the style of the latest one."""
    remarks: tuple[str, ...]
    """Warnings as sentences."""


@dataclass(frozen=True, slots=True)
class _StartedSession:
    """A session that a participant has begun, according to its log, or to its tombstone after a withdrawal."""

    folder: SessionFolder
    protocol: str
    """Name of the protocol."""
    number: int | None
    """Place of the participant in the balanced order; None where none was assigned."""
    line: SessionLine
    protocol_text: str | None
    """Text of the protocol from the log; None where the log was withdrawn or is damaged."""


def list_planned_studies(data: Path, protocol: str | None, simulated: bool) -> tuple[PlannedStudy, ...]:
    """Make the plans of the studies in a data folder. protocol: name or file of a protocol; None = all protocols with
    sessions in `data`. simulated: plan for simulated participants, who are counted separately from people. Raises
    StudyError where a protocol cannot be read, or where `protocol` is None and there is no session."""
    started_sessions = _find_started_sessions(data, simulated)
    if protocol is not None:
        study_protocol = read_study_protocol(protocol, data).protocol
        return (
            _plan_from_sessions(
                data,
                study_protocol,
                [session for session in started_sessions if session.protocol == study_protocol.name],
                simulated,
            ),
        )
    planned_studies = []
    for name, sessions in groupby(
        sorted(started_sessions, key=lambda session: session.protocol), key=lambda session: session.protocol
    ):
        protocol_sessions = list(sessions)
        planned_studies.append(
            _plan_from_sessions(data, _load_latest_protocol(name, protocol_sessions), protocol_sessions, simulated)
        )
    if not planned_studies:
        raise WrongUseError(
            "There is no study to plan",
            f"{data} holds no session of {'simulated participants' if simulated else 'people'}.",
            "Name the protocol with --protocol, or the folder of the sessions.",
        )
    return tuple(planned_studies)


def _find_started_sessions(data: Path, simulated: bool) -> list[_StartedSession]:
    """Find all sessions of simulated participants, or of people, whose protocol is known."""
    started_sessions = []
    for folder in list_session_folders(data):
        participant = read_begun_participant(folder)
        if participant is not None and participant.protocol and participant.simulated == simulated:
            started_sessions.append(
                _StartedSession(
                    folder,
                    participant.protocol,
                    participant.number,
                    make_session_line(folder),
                    _read_protocol_text(folder),
                )
            )
    return started_sessions


def _read_protocol_text(folder: SessionFolder) -> str | None:
    """Read the text of the protocol from a session's log; None where it cannot be read."""
    try:
        session_opened = read_opening(folder.log)
    except (StudyError, OSError, ValueError):
        return None
    return session_opened.protocol_text if isinstance(session_opened, SessionOpened) else None


def _plan_from_sessions(
    data: Path, protocol: StudyProtocol, started_sessions: Sequence[_StartedSession], simulated: bool
) -> PlannedStudy:
    """Plan one study from its sessions."""
    sessions_by_code: dict[str, list[_StartedSession]] = {}
    for session in sorted(started_sessions, key=_make_sort_key):
        sessions_by_code.setdefault(session.folder.subject, []).append(session)
    # The number that a new participant would receive: the empty code belongs to no session folder.
    next_number = find_participant_number(data, "", protocol.name, simulated)
    plan = plan_study(
        protocol, [_make_participant(code, sessions) for code, sessions in sessions_by_code.items()], next_number
    )
    return PlannedStudy(
        plan, _suggest_unused_code(data, tuple(reversed(sessions_by_code))), _warn_of_different_texts(started_sessions)
    )


def _suggest_unused_code(data: Path, study_codes: tuple[str, ...]) -> str:
    """Suggest an unused participant code that continues those of this study. study_codes: codes of this study, the
    latest first; without any, the first code of a new study, or one after the others in the folder if "P01" is used."""
    all_codes = tuple(folder.subject for folder in list_session_folders(data))
    return suggest_code((*study_codes, *all_codes)) if study_codes or "P01" in all_codes else suggest_code(())


def _make_sort_key(session: _StartedSession) -> tuple[float, str]:
    """Make the sorting key of a session: participant number, then name of the folder; sessions without a number come
    last. The time of the start is not used, because it is erased from a withdrawn session."""
    return (float("inf") if session.number is None else session.number, session.folder.name)


def _make_participant(code: str, sessions: Sequence[_StartedSession]) -> Participant:
    """Make the participant with the progress of the best session by `STANDINGS_BEST_FIRST`; where no standing is in it,
    of the last. sessions: at least one."""
    standings = [session.line.standing for session in sessions]
    numbers = [session.number for session in sessions if session.number is not None]
    best_standing = next((standing for standing in STANDINGS_BEST_FIRST if standing in standings), standings[-1])
    progress = PROGRESS_BY_STANDING.get(best_standing, "left out")
    reason = "" if best_standing in ("finished", "unfinished") else best_standing
    return Participant(code, numbers[0] if numbers else None, progress, reason)


def _load_latest_protocol(name: str, sessions: Sequence[_StartedSession]) -> StudyProtocol:
    """Load the study protocol of the latest session whose log can be read. Raises WrongUseError where there is none."""
    for session in sorted(sessions, key=lambda session: session.line.begun_utc, reverse=True):
        if session.protocol_text is None:
            continue
        try:
            protocol = load_protocol(session.protocol_text, "the log")
        except ProtocolError:
            continue
        if isinstance(protocol, StudyProtocol):
            return protocol
    raise WrongUseError(
        "The protocol cannot be read",
        f"No session of '{name}' has a log that says what its protocol was: all are withdrawn or damaged.",
        "Give the protocol's file with --protocol.",
    )


def _warn_of_different_texts(sessions: Sequence[_StartedSession]) -> tuple[str, ...]:
    """Warn if sessions of this protocol used different texts of it: their orders are counted together although they may
    differ. Empty without a difference."""
    protocol_texts = {session.protocol_text for session in sessions if session.protocol_text is not None}
    if len(protocol_texts) < 2:
        return ()
    return (f"{len(protocol_texts)} different texts of this protocol were used. Lock it: hapteq protocol lock.",)


def summarise_plans(studies: Sequence[PlannedStudy]) -> dict[str, Any]:
    """Convert plans to plain values, for a JSON document."""
    return {
        "studies": [
            {
                "protocol": study.plan.protocol,
                "planned": study.plan.planned,
                "done": study.plan.count("done"),
                "begun": study.plan.count("begun"),
                "left_out": study.plan.count("left out"),
                "participants": [
                    {
                        "code": participant.code,
                        "number": participant.number,
                        "progress": participant.progress.replace(" ", "_"),
                        "why": participant.reason,
                    }
                    for participant in study.plan.participants
                ],
                "orders": [
                    {
                        "frequencies_hz": list(cell.frequencies_hz),
                        "swapped": cell.swapped,
                        "wanted": cell.required,
                        "done": cell.done,
                        "begun": cell.begun,
                        "needed": cell.needed,
                    }
                    for cell in study.plan.cells
                ],
                "next": {
                    "code": study.next_code,
                    "number": study.plan.next_number,
                    **_summarise_next_order(study.plan.next_cell),
                },
                "remarks": list(study.remarks),
            }
            for study in studies
        ]
    }


def _summarise_next_order(cell: Cell | None) -> dict[str, Any]:
    """Convert order and labelling of the next participant to plain values; empty where nothing is balanced."""
    return {} if cell is None else {"frequencies_hz": list(cell.frequencies_hz), "swapped": cell.swapped}


def format_plan_lines(study: PlannedStudy) -> list[str]:
    """Format a plan as lines of text for the terminal: progress, participants to resume, running or left out, orders
    that lack participants, next participant, warnings."""
    plan = study.plan
    done_count, begun_count, left_out_count = (plan.count(progress) for progress in ("done", "begun", "left out"))
    planned_text = f" of {plan.planned} planned" if plan.planned else ""
    lines = [f"{plan.protocol}: {done_count} done{planned_text}, {begun_count} begun, {left_out_count} left out"]
    begun = [participant for participant in plan.participants if participant.progress == "begun"]
    lines += _format_codes("to resume", [participant.code for participant in begun if not participant.reason])
    lines += _format_codes("running", [participant.code for participant in begun if participant.reason])
    lines += _format_codes(
        "left out",
        [
            f"{participant.code} ({participant.reason})"
            for participant in plan.participants
            if participant.progress == "left out"
        ],
    )
    if plan.planned and plan.planned % plan.cycle_length:
        lines.append(f"{plan.planned} participants do not balance the orders: multiples of {plan.cycle_length} would.")
    if not plan.planned:
        lines.append("No sample size is declared: analysis.participants in the protocol says how many are planned.")
    if not plan.cells:
        lines.append("No orders have to be balanced: they are drawn by lot, or the same for all.")
    else:
        incomplete_cells = [cell_index for cell_index, cell in enumerate(plan.cells) if cell.needed]
        incomplete_text = ", ".join(f"{cell_index + 1}" for cell_index in incomplete_cells)
        lines.append(f"orders still needed: {incomplete_text}" if incomplete_cells else "orders still needed: none")
    lines.append(f"next: {study.next_code}{_describe_next_order(plan)}")
    return [*lines, *study.remarks]


def _format_codes(title: str, codes: Sequence[str]) -> list[str]:
    """Format a line with participant codes after a title; empty without codes."""
    return [f"{title}: {', '.join(codes)}"] if codes else []


def _describe_next_order(plan: StudyPlan) -> str:
    """Describe the order of the next participant; empty where nothing is balanced."""
    cell = plan.next_cell
    if cell is None:
        return ""
    return f", order {plan.next_number % len(plan.cells) + 1}: {describe_order(cell)}"


def describe_order(cell: Cell) -> str:
    """Describe the order of a cell, such as "5, 45, 15, 35, 25 Hz, numbers swapped"; "by lot" where the order is random
    (no frequencies)."""
    frequencies_text = ", ".join(f"{frequency:g}" for frequency in cell.frequencies_hz)
    order_text = f"{frequencies_text} Hz" if frequencies_text else "by lot"
    return f"{order_text}, numbers swapped" if cell.swapped else order_text
