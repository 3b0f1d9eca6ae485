"""Rehearse a whole study with simulated participants, several at once; begun sessions are resumed, finished ones
kept."""

import signal
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from protocols.definition.study_protocol import StudyProtocol
from study.devices.clock import VirtualClock
from study.errors import LeftError, StudyError
from study.participants.observer import Observer
from study.participants.observers import observer_named
from study.participants.population import KINDS, member
from study.store.disk.provenance import sha256_of
from study.store.sessions.archive import SessionFolder, session_folders
from study.workflows.results.fold_session import fold_session
from study.workflows.results.session_results import finish_tables, write_tables
from study.workflows.session.conduct_session import conduct_new, conduct_resumed
from study.workflows.session.open_session import SessionPlan
from study.workflows.session.simulated_participant import seat_observer

DEVICE = "simulated"


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """Protocol, number of participants, seed and output folder."""

    protocol: StudyProtocol
    protocol_text: str
    subjects: int
    seed: int
    data: Path
    model: Path | None = None
    """Identified model that equalizes the stimuli."""
    observer: str = "person"
    """A kind of population (`study.participants.population.KINDS`), or an observer that all of them are."""


def rehearsed_observer(rehearsal: Rehearsal, number: int) -> Observer:
    """Participant `number` (from 0). Raises StudyError for an unknown name."""
    kind = rehearsal.observer.replace("-", "_")
    if kind in KINDS:
        return member(kind, number + 1, rehearsal.seed)
    return observer_named(kind, rehearsal.seed)


def rehearse_study(rehearsal: Rehearsal, workers: int, on_finished: Callable[[int], None]) -> None:
    """Run all participants, calling `on_finished(count)`. After an interruption the same call continues.

    Raises StudyError where the folder holds a rehearsal of another protocol, seed or model.
    """
    _check_same(rehearsal)
    # Forking a process with numba's and the device's threads in it is not safe; a spawned one starts clean.
    context = get_context("spawn")
    with ProcessPoolExecutor(max_workers=workers, mp_context=context, initializer=_leave_ctrl_c_to_the_parent) as pool:
        futures = [pool.submit(_sit, rehearsal, number) for number in range(rehearsal.subjects)]
        try:
            for done, future in enumerate(as_completed(futures), start=1):
                future.result()
                on_finished(done)
        except KeyboardInterrupt as interruption:
            pool.shutdown(wait=True, cancel_futures=True)
            raise LeftError(
                "Interrupted",
                "The rehearsal is not finished.",
                "Run the same command again: it goes on where it stopped.",
                saved=f"All sessions begun so far are in {rehearsal.data}.",
            ) from interruption
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _leave_ctrl_c_to_the_parent() -> None:
    """Ignore Ctrl-C in a worker. Running sessions finish within seconds; no other is begun."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def subject_code(number: int) -> str:
    return f"S{number + 1:03d}"


def codes(subjects: int) -> set[str]:
    return {subject_code(number) for number in range(subjects)}


def subject_seed(seed: int, number: int) -> int:
    """Seed of one participant: hashed, so that neighbouring rehearsals share no participant."""
    from numpy.random import SeedSequence

    return int(SeedSequence(seed, spawn_key=(number,)).generate_state(1)[0])


def _sit(rehearsal: Rehearsal, number: int) -> None:
    observer = rehearsed_observer(rehearsal, number)
    seed = subject_seed(rehearsal.seed, number)
    if any(f.withdrawn for f in session_folders(rehearsal.data) if f.subject == subject_code(number)):
        return
    begun = _begun(rehearsal.data, subject_code(number))
    if begun is None:
        plan = SessionPlan(
            protocol=rehearsal.protocol,
            protocol_text=rehearsal.protocol_text,
            protocol_locked=False,
            subject=subject_code(number),
            observer=observer.name,
            seed=seed,
            data=rehearsal.data,
            participant_number=number,
            model=rehearsal.model,
        )
        conducted = conduct_new(plan, DEVICE, seat_observer(observer, seed, VirtualClock()))
    elif (folded := fold_session(begun)).state.closed:
        finish_tables(begun, folded)
        return
    else:
        clock = VirtualClock.not_before(folded.state.sitting.last.utc)
        conducted = conduct_resumed(begun, DEVICE, seat_observer(observer, seed, clock))
    write_tables(conducted.folder)
    if conducted.left:
        raise StudyError(
            "A simulated participant did not finish",
            f"{conducted.folder.name}: {conducted.left}.",
            "Change what stops it in the protocol, and rehearse in another folder.",
            saved="Everything so far is in the folder.",
        )


def _begun(data: Path, subject: str) -> SessionFolder | None:
    """The participant's last session with a first line; a crash at the start leaves an empty folder."""
    folders = [f for f in session_folders(data) if f.subject == subject and f.log.exists() and f.log.stat().st_size]
    return folders[-1] if folders else None


def _check_same(rehearsal: Rehearsal) -> None:
    more = [f.name for f in session_folders(rehearsal.data) if f.subject not in codes(rehearsal.subjects)]
    if more:
        raise StudyError(
            "This folder holds other sessions",
            f"Beside this rehearsal's participants there is {', '.join(more[:5])} in {rehearsal.data}.",
            "Choose another folder with --out, or at least as many --subjects as were begun.",
            saved="Nothing was changed.",
        )
    model = sha256_of(rehearsal.model) if rehearsal.model is not None and rehearsal.model.is_file() else None
    for number in range(rehearsal.subjects):
        folder = _begun(rehearsal.data, subject_code(number))
        if folder is None:
            continue
        opened = fold_session(folder).state.opened
        if opened.equalized is not None and opened.equalized.sha256 != model:
            raise StudyError(
                "This folder holds another rehearsal",
                f"{folder.name} in {rehearsal.data} was begun with another --model.",
                "Choose another folder with --out, or the same --model to go on.",
                saved="Nothing was changed.",
            )
        if opened.observer != rehearsed_observer(rehearsal, number).name:
            raise StudyError(
                "This folder holds another rehearsal",
                f"{folder.name} in {rehearsal.data} was begun with the observer {opened.observer}.",
                "Choose another folder with --out, or the same --observer and --seed to go on.",
                saved="Nothing was changed.",
            )
        if opened.seed != subject_seed(rehearsal.seed, number) or opened.protocol_text != rehearsal.protocol_text:
            raise StudyError(
                "This folder holds another rehearsal",
                f"{folder.name} in {rehearsal.data} was begun with another seed or protocol.",
                "Choose another folder with --out, or the same --seed and --protocol to go on.",
                saved="Nothing was changed.",
            )
