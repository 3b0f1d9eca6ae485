"""The plan of each study in a data folder: planned, finished and excluded participants, and the order of frequencies
that the next participant receives. Only reads files.

A participant may have several sessions; the session with the most progress counts. The design is computed by
`protocols.procedure.study_plan`.
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
from study.workflows.session.participant_number import participant_number, read_begun_participant
from study.workflows.views.session_line import session_line

PROGRESS: dict[str, Progress] = {"finished": "done", "unfinished": "begun", "running": "begun"}
"""Progress of a participant, by the standing of the best session; with any other standing a participant is left out."""
BEST_FIRST = ("finished", "running", "unfinished")
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
    """A session that a participant has begun."""

    folder: SessionFolder
    protocol: str
    """Name of the protocol."""
    number: int | None
    """Place of the participant in the balanced order; None where none was assigned."""
    line: SessionLine
    protocol_text: str | None
    """Text of the protocol from the log; None where the log was withdrawn or is damaged."""


def list_planned_studies(data: Path, protocol: str | None, simulated: bool) -> tuple[PlannedStudy, ...]:
    """The plans of studies in a data folder. protocol: name or file of a protocol; None = all protocols with sessions
    in `data`. simulated: plan for simulated participants, who are counted separately from people. Raises StudyError
    where the protocol cannot be read, or there is no session."""
    started_sessions = _find_started_sessions(data, simulated)
    if protocol is not None:
        chosen = read_study_protocol(protocol, data).protocol
        return (
            _plan_from_sessions(
                data, chosen, [session for session in started_sessions if session.protocol == chosen.name], simulated
            ),
        )
    studies = []
    for name, sessions in groupby(
        sorted(started_sessions, key=lambda session: session.protocol), key=lambda session: session.protocol
    ):
        protocol_sessions = list(sessions)
        studies.append(
            _plan_from_sessions(data, _latest_protocol(name, protocol_sessions), protocol_sessions, simulated)
        )
    if not studies:
        raise WrongUseError(
            "There is no study to plan",
            f"{data} holds no session of {'simulated participants' if simulated else 'people'}.",
            "Name the protocol with --protocol, or the folder of the sessions.",
        )
    return tuple(studies)


def _find_started_sessions(data: Path, simulated: bool) -> list[_StartedSession]:
    """All sessions of simulated participants, or of people, whose protocol is known."""
    started_sessions = []
    for folder in list_session_folders(data):
        participant = read_begun_participant(folder)
        if participant is not None and participant.protocol and participant.simulated == simulated:
            started_sessions.append(
                _StartedSession(
                    folder, participant.protocol, participant.number, session_line(folder), _protocol_text(folder)
                )
            )
    return started_sessions


def _protocol_text(folder: SessionFolder) -> str | None:
    """Text of the protocol from a session's log; None where it cannot be read."""
    try:
        session_opened = read_opening(folder.log)
    except (StudyError, OSError, ValueError):
        return None
    return session_opened.protocol_text if isinstance(session_opened, SessionOpened) else None


def _plan_from_sessions(
    data: Path, protocol: StudyProtocol, started_sessions: Sequence[_StartedSession], simulated: bool
) -> PlannedStudy:
    """The plan of one study from its sessions."""
    people: dict[str, list[_StartedSession]] = {}
    for session in sorted(started_sessions, key=_by_number):
        people.setdefault(session.folder.subject, []).append(session)
    # The number that a new participant would receive: the empty code belongs to no session folder.
    number = participant_number(data, "", protocol.name, simulated)
    plan = plan_study(protocol, [_participant(code, sessions) for code, sessions in people.items()], number)
    return PlannedStudy(plan, _free_code(data, tuple(reversed(people))), _remarks(started_sessions))


def _free_code(data: Path, study_codes: tuple[str, ...]) -> str:
    """An unused code that continues those of this study. study_codes: codes of this study, the latest first."""
    used_codes = tuple(folder.subject for folder in list_session_folders(data))
    return suggest_code((*study_codes, *used_codes)) if study_codes or "P01" in used_codes else suggest_code(())


def _by_number(session: _StartedSession) -> tuple[float, str]:
    """Sorting key of sessions: by number, then by name of the folder; those without a number last. The time of the
    start cannot be used, because it is erased from a withdrawn session."""
    return (float("inf") if session.number is None else session.number, session.folder.name)


def _participant(code: str, sessions: Sequence[_StartedSession]) -> Participant:
    """The participant, with the progress of the best session."""
    standings = [session.line.standing for session in sessions]
    numbers = [session.number for session in sessions if session.number is not None]
    best = next((standing for standing in BEST_FIRST if standing in standings), standings[-1])
    progress = PROGRESS.get(best, "left out")
    return Participant(code, numbers[0] if numbers else None, progress, "" if best in PROGRESS else best)


def _latest_protocol(name: str, sessions: Sequence[_StartedSession]) -> StudyProtocol:
    """Protocol of the latest session whose log can be read. Raises WrongUseError where there is none."""
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


def _remarks(sessions: Sequence[_StartedSession]) -> tuple[str, ...]:
    """Warning if sessions of this protocol used different texts of it: their orders would be counted together although
    they may differ."""
    texts = {session.protocol_text for session in sessions if session.protocol_text is not None}
    if len(texts) < 2:
        return ()
    return (f"{len(texts)} different texts of this protocol were used. Lock it: hapteq protocol lock.",)


def document(studies: Sequence[PlannedStudy]) -> dict[str, Any]:
    """Plans as values that can be written as JSON, for other programs."""
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
                    **_next_order(study.plan.next_cell),
                },
                "remarks": list(study.remarks),
            }
            for study in studies
        ]
    }


def _next_order(cell: Cell | None) -> dict[str, Any]:
    """Order and labelling of the next participant; empty where nothing is balanced."""
    return {} if cell is None else {"frequencies_hz": list(cell.frequencies_hz), "swapped": cell.swapped}


def lines(study: PlannedStudy) -> list[str]:
    """Lines of text for the terminal: progress, participants to resume or left out, cells that lack participants, next
    participant, warnings."""
    plan = study.plan
    done, begun_count, left_out_count = (plan.count(progress) for progress in ("done", "begun", "left out"))
    size = f" of {plan.planned} planned" if plan.planned else ""
    lines_of_text = [f"{plan.protocol}: {done} done{size}, {begun_count} begun, {left_out_count} left out"]
    lines_of_text += _list_with_title(
        "to resume", [participant.code for participant in plan.participants if participant.progress == "begun"]
    )
    lines_of_text += _list_with_title(
        "left out",
        [
            f"{participant.code} ({participant.reason})"
            for participant in plan.participants
            if participant.progress == "left out"
        ],
    )
    if plan.planned and plan.planned % plan.cycle_length:
        lines_of_text.append(
            f"{plan.planned} participants do not balance the orders: multiples of {plan.cycle_length} would."
        )
    if not plan.planned:
        lines_of_text.append(
            "No sample size is declared: analysis.participants in the protocol says how many are planned."
        )
    if not plan.cells:
        lines_of_text.append("No orders have to be balanced: they are drawn by lot, or the same for all.")
    else:
        incomplete_cells = [place for place, cell in enumerate(plan.cells) if cell.needed]
        places = ", ".join(f"{place + 1}" for place in incomplete_cells)
        lines_of_text.append(f"orders still needed: {places}" if incomplete_cells else "orders still needed: none")
    lines_of_text.append(f"next: {study.next_code}{_progress_text(plan)}")
    return [*lines_of_text, *study.remarks]


def _list_with_title(title: str, codes: Sequence[str]) -> list[str]:
    return [f"{title}: {', '.join(codes)}"] if codes else []


def _progress_text(plan: StudyPlan) -> str:
    """Order of the next participant in words; empty where nothing is balanced."""
    cell = plan.next_cell
    if cell is None:
        return ""
    return f", order {plan.next_number % len(plan.cells) + 1}: {order_words(cell)}"


def order_words(cell: Cell) -> str:
    """The order of a cell in words, such as "5, 45, 15, 35, 25 Hz, numbers swapped"."""
    hertz = ", ".join(f"{frequency:g}" for frequency in cell.frequencies_hz)
    words = f"{hertz} Hz" if hertz else "by lot"
    return f"{words}, numbers swapped" if cell.swapped else words
