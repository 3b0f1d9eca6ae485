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
from study.session.views.participant_codes import next_code
from study.store.formats.protocol_files import read_study_protocol
from study.store.sessions.archive import SessionFolder, session_folders
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
class _Begun:
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
    begun = _find_begun(data, simulated)
    if protocol is not None:
        chosen = read_study_protocol(protocol, data).protocol
        return (_plan_from_sessions(data, chosen, [each for each in begun if each.protocol == chosen.name], simulated),)
    found = []
    for name, sessions in groupby(sorted(begun, key=lambda each: each.protocol), key=lambda each: each.protocol):
        kept = list(sessions)
        found.append(_plan_from_sessions(data, _latest_protocol(name, kept), kept, simulated))
    if not found:
        raise WrongUseError(
            "There is no study to plan",
            f"{data} holds no session of {'simulated participants' if simulated else 'people'}.",
            "Name the protocol with --protocol, or the folder of the sessions.",
        )
    return tuple(found)


def _find_begun(data: Path, simulated: bool) -> list[_Begun]:
    """All sessions of simulated participants, or of people, whose protocol is known."""
    found = []
    for folder in session_folders(data):
        begun = read_begun_participant(folder)
        if begun is not None and begun.protocol and begun.simulated == simulated:
            found.append(_Begun(folder, begun.protocol, begun.number, session_line(folder), _protocol_text(folder)))
    return found


def _protocol_text(folder: SessionFolder) -> str | None:
    """Text of the protocol from a session's log; None where it cannot be read."""
    try:
        opening = read_opening(folder.log)
    except (StudyError, OSError, ValueError):
        return None
    return opening.protocol_text if isinstance(opening, SessionOpened) else None


def _plan_from_sessions(data: Path, protocol: StudyProtocol, begun: Sequence[_Begun], simulated: bool) -> PlannedStudy:
    """The plan of one study from its sessions."""
    people: dict[str, list[_Begun]] = {}
    for each in sorted(begun, key=_by_number):
        people.setdefault(each.folder.subject, []).append(each)
    # The number that a new participant would receive: the empty code belongs to no session folder.
    number = participant_number(data, "", protocol.name, simulated)
    plan = plan_study(protocol, [_participant(code, sessions) for code, sessions in people.items()], number)
    return PlannedStudy(plan, _free_code(data, tuple(reversed(people))), _remarks(begun))


def _free_code(data: Path, own: tuple[str, ...]) -> str:
    """An unused code that continues those of this study. own: codes of this study, the latest first."""
    others = tuple(folder.subject for folder in session_folders(data))
    return next_code((*own, *others)) if own or "P01" in others else next_code(())


def _by_number(each: _Begun) -> tuple[float, str]:
    """Sorting key of sessions: by number, then by name of the folder; those without a number last. The time of the
    start cannot be used, because it is erased from a withdrawn session."""
    return (float("inf") if each.number is None else each.number, each.folder.name)


def _participant(code: str, sessions: Sequence[_Begun]) -> Participant:
    """The participant, with the progress of the best session."""
    standings = [each.line.standing for each in sessions]
    numbers = [each.number for each in sessions if each.number is not None]
    best = next((standing for standing in BEST_FIRST if standing in standings), standings[-1])
    progress = PROGRESS.get(best, "left out")
    return Participant(code, numbers[0] if numbers else None, progress, "" if best in PROGRESS else best)


def _latest_protocol(name: str, begun: Sequence[_Begun]) -> StudyProtocol:
    """Protocol of the latest session whose log can be read. Raises WrongUseError where there is none."""
    for each in sorted(begun, key=lambda each: each.line.begun_utc, reverse=True):
        if each.protocol_text is None:
            continue
        try:
            protocol = load_protocol(each.protocol_text, "the log")
        except ProtocolError:
            continue
        if isinstance(protocol, StudyProtocol):
            return protocol
    raise WrongUseError(
        "The protocol cannot be read",
        f"No session of '{name}' has a log that says what its protocol was: all are withdrawn or damaged.",
        "Give the protocol's file with --protocol.",
    )


def _remarks(begun: Sequence[_Begun]) -> tuple[str, ...]:
    """Warning if sessions of this protocol used different texts of it: their orders would be counted together although
    they may differ."""
    texts = {each.protocol_text for each in begun if each.protocol_text is not None}
    if len(texts) < 2:
        return ()
    return (f"{len(texts)} different texts of this protocol were used. Lock it: hapteq protocol lock.",)


def document(studies: Sequence[PlannedStudy]) -> dict[str, Any]:
    """Plans as values that can be written as JSON, for other programs."""
    return {
        "studies": [
            {
                "protocol": each.plan.protocol,
                "planned": each.plan.planned,
                "done": each.plan.count("done"),
                "begun": each.plan.count("begun"),
                "left_out": each.plan.count("left out"),
                "participants": [
                    {"code": who.code, "number": who.number, "progress": who.progress.replace(" ", "_"), "why": who.why}
                    for who in each.plan.participants
                ],
                "orders": [
                    {
                        "frequencies_hz": list(cell.frequencies_hz),
                        "swapped": cell.swapped,
                        "wanted": cell.wanted,
                        "done": cell.done,
                        "begun": cell.begun,
                        "needed": cell.needed,
                    }
                    for cell in each.plan.cells
                ],
                "next": {"code": each.next_code, "number": each.plan.next_number, **_next_order(each.plan.next_cell)},
                "remarks": list(each.remarks),
            }
            for each in studies
        ]
    }


def _next_order(cell: Cell | None) -> dict[str, Any]:
    """Order and labelling of the next participant; empty where nothing is balanced."""
    return {} if cell is None else {"frequencies_hz": list(cell.frequencies_hz), "swapped": cell.swapped}


def lines(study: PlannedStudy) -> list[str]:
    """Lines of text for the terminal: progress, participants to resume or left out, cells that lack participants, next
    participant, warnings."""
    plan = study.plan
    done, begun, out = (plan.count(each) for each in ("done", "begun", "left out"))
    size = f" of {plan.planned} planned" if plan.planned else ""
    found = [f"{plan.protocol}: {done} done{size}, {begun} begun, {out} left out"]
    found += _list_with_title("to resume", [who.code for who in plan.participants if who.progress == "begun"])
    found += _list_with_title(
        "left out", [f"{who.code} ({who.why})" for who in plan.participants if who.progress == "left out"]
    )
    if plan.planned and plan.planned % plan.balanced_sizes:
        found.append(
            f"{plan.planned} participants do not balance the orders: multiples of {plan.balanced_sizes} would."
        )
    if not plan.planned:
        found.append("No sample size is declared: analysis.participants in the protocol says how many are planned.")
    if not plan.cells:
        found.append("No orders have to be balanced: they are drawn by lot, or the same for all.")
    else:
        short = [place for place, cell in enumerate(plan.cells) if cell.needed]
        places = ", ".join(f"{place + 1}" for place in short)
        found.append(f"orders still needed: {places}" if short else "orders still needed: none")
    found.append(f"next: {study.next_code}{_progress_text(plan)}")
    return [*found, *study.remarks]


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
