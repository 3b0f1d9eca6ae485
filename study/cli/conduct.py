"""What `study` and `resume` share: who sits at the device, and what is shown at the end."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import typer

from study.cli.progress import answer_count
from study.cli.results import show
from study.devices.clock import Clock, RealClock, VirtualClock
from study.store.archive import SessionFolder, check_subject, find_session
from study.store.protocol_files import read_study_protocol
from study.tui.line_input import LineInput
from study.tui.plain import PlainDisplay
from study.workflows.conduct_session import Participant, conduct_new, conduct_resumed
from study.workflows.display import PersonsHand
from study.workflows.fold_session import fold_session
from study.workflows.open_session import SessionPlan, fresh_seed
from study.workflows.session_results import write_results
from study.workflows.simulated_participant import simulated_participant

SIMULATED_CODE = "SIM"


@dataclass(frozen=True, slots=True)
class Sitter:
    observer: str | None
    """Name of the simulated participant; None for a person."""
    subject: str | None


def begin(sitter: Sitter, protocol_name: str, device: str, data: Path, seed: int | None, as_json: bool) -> None:
    source = read_study_protocol(protocol_name, data)
    drawn = fresh_seed() if seed is None else seed
    plan = SessionPlan(
        protocol=source.protocol,
        protocol_text=source.text,
        protocol_locked=source.locked,
        subject=check_subject(sitter.subject or _ask_subject(sitter)),
        observer=sitter.observer,
        seed=drawn,
        data=data,
    )
    with _participant(sitter.observer, drawn) as participant:
        end = conduct_new(plan, device, participant)
    _finish(end.folder, as_json)


def go_on(session: str, device: str, data: Path, as_json: bool) -> None:
    folder = find_session(session, data)
    opened = fold_session(folder).state.opened
    with _participant(opened.observer, opened.seed) as participant:
        end = conduct_resumed(folder, device, participant)
    _finish(end.folder, as_json)


@contextmanager
def _participant(observer: str | None, seed: int) -> Iterator[Participant]:
    clock: Clock = RealClock() if observer is None else VirtualClock()
    if observer is None:
        display = PlainDisplay(LineInput(), sys.stdout, clock)
        yield Participant(display=display, hand=PersonsHand(), clock=clock)
        return
    with answer_count(f"simulated participant '{observer}'") as show_question:
        yield simulated_participant(observer, seed, clock, on_question=show_question)


def _ask_subject(sitter: Sitter) -> str:
    if sitter.observer is not None:
        return SIMULATED_CODE
    if not sys.stdin.isatty():
        return "P01"
    return str(typer.prompt("Participant code (letters and digits, such as P01)"))


def _finish(folder: SessionFolder, as_json: bool) -> None:
    state = fold_session(folder).state
    if state.closed:
        show(write_results(folder), as_json)
        return
    typer.echo(f"Not finished: {state.answers} answers are on disk.", err=True)
    typer.echo(f"Go on with: hapteq resume {folder.path}", err=True)
