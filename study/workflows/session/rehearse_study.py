"""Rehearsal of a whole study with simulated participants in parallel processes (`hapteq rehearse`).

Sessions run on the simulated device in virtual time. The same call continues an interrupted rehearsal: unfinished
sessions are resumed, finished ones are kept. `number` is that of a participant, from 0.
"""

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from protocols.definition.study_protocol import StudyProtocol
from study.devices.clock import VirtualClock
from study.errors import StudyError, convert_interrupts
from study.participants.observer import Observer
from study.participants.observer_catalogue import find_observer
from study.participants.population import MEMBER_KINDS, make_member
from study.store.disk.folder_contents import FileContents, read_file, read_files, write_files
from study.store.disk.new_folder import create_new_folder
from study.store.disk.privacy import make_folder
from study.store.disk.provenance import compute_sha256
from study.store.sessions.archive import SessionFolder, list_session_folders
from study.workflows.results.fold_session import fold_session
from study.workflows.results.session_results import finish_tables, write_tables
from study.workflows.run_on_executor import run_tasks
from study.workflows.session.conduct_session import ConductedSitting, conduct_new, conduct_resumed
from study.workflows.session.open_session import SessionPlan
from study.workflows.session.simulated_participant import make_observer_participant
from study.workflows.worker_processes import open_worker_processes

DEVICE_NAME = "simulated"
"""Name under which the device of every rehearsal is opened."""


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """Settings of `rehearse_study`."""

    protocol: StudyProtocol
    protocol_text: str
    """The protocol in TOML, as it is written into the logs."""
    subjects: int
    """Number of simulated participants."""
    seed: int
    """Seed of the population and of all draws."""
    data: Path
    """Folder of the sessions."""
    model: Path | None = None
    """Identified model that equalizes the stimuli."""
    observer: str = "person"
    """A kind of population (`study.participants.population.MEMBER_KINDS`), or the name of an observer for all
    participants."""
    locked: bool = False
    """Whether the protocol was locked before the rehearsal began."""


def make_rehearsed_observer(rehearsal: Rehearsal, number: int) -> Observer:
    """Make the observer of participant `number`. Raises StudyError for an unknown name."""
    kind = rehearsal.observer.replace("-", "_")
    if kind in MEMBER_KINDS:
        return make_member(kind, number + 1, rehearsal.seed)
    return find_observer(kind, rehearsal.seed)


def rehearse_study(
    rehearsal: Rehearsal, workers: int | Executor = 1, on_finished: Callable[[int], None] = lambda count: None
) -> None:
    """Run the sessions of all participants. on_finished: called after each with the number of finished sessions.

    workers: a number of processes of this computer, or an executor, whose workers need not share a disk with it: they
    return the files of whole sessions. On an interruption no other session is begun; those that run in processes of
    this computer are finished.

    Raises StudyError where the folder holds sessions of other participants, or a rehearsal of another protocol, seed,
    observer or model, or where a simulated participant did not finish.
    """
    _require_same_rehearsal(rehearsal)
    saved_text = "begun so far" if isinstance(workers, int) else "finished so far"
    with convert_interrupts("The rehearsal is not finished.", f"All sessions {saved_text} are in {rehearsal.data}."):
        if isinstance(workers, Executor):
            _rehearse_on_executor(rehearsal, workers, on_finished)
            return
        tasks = ((number, (rehearsal, number)) for number in range(rehearsal.subjects))
        with open_worker_processes(workers) as pool:
            for finished_count, _ in enumerate(run_tasks(pool, _rehearse_sitting, tasks), start=1):
                on_finished(finished_count)


def _rehearse_on_executor(rehearsal: Rehearsal, executor: Executor, on_finished: Callable[[int], None]) -> None:
    """Run the sessions on an executor. Sessions that were begun in the folder are finished in this process first.
    Raises StudyError where a session does not finish."""
    folders = list_session_folders(rehearsal.data)
    begun_numbers = {
        number
        for number in range(rehearsal.subjects)
        if any(folder.subject == make_subject_code(number) for folder in folders)
    }
    model_files = {} if rehearsal.model is None else read_file(rehearsal.model)
    remaining_numbers = [number for number in range(rehearsal.subjects) if number not in begun_numbers]
    for finished_count, number in enumerate(sorted(begun_numbers), start=1):
        _rehearse_sitting(rehearsal, number)
        on_finished(finished_count)
    finished_sessions = run_tasks(
        executor,
        rehearse_on_worker,
        (
            (participant_number, (rehearsal, model_files, participant_number))
            for participant_number in remaining_numbers
        ),
    )
    for finished_count, (_, (session, files, end_reason)) in enumerate(finished_sessions, start=len(begun_numbers) + 1):
        make_folder(rehearsal.data, private=True)
        with create_new_folder(rehearsal.data / session) as session_folder:
            write_files(session_folder, files)
        _require_finished(session, end_reason)
        on_finished(finished_count)


def make_subject_code(number: int) -> str:
    """Make the code of a simulated participant: S001 for the number 0."""
    return f"S{number + 1:03d}"


def derive_subject_seed(seed: int, number: int) -> int:
    """Derive the 32-bit seed of one participant: a hash of the rehearsal's seed and the number, so that rehearsals with
    consecutive seeds have no participant in common."""
    from numpy.random import SeedSequence

    return int(SeedSequence(seed, spawn_key=(number,)).generate_state(1)[0])


def _rehearse_sitting(rehearsal: Rehearsal, number: int) -> None:
    """Run or resume the session of one participant and write its tables; nothing is done for a withdrawn participant.
    Raises StudyError where it does not finish."""
    observer = make_rehearsed_observer(rehearsal, number)
    seed = derive_subject_seed(rehearsal.seed, number)
    if any(
        folder.withdrawn
        for folder in list_session_folders(rehearsal.data)
        if folder.subject == make_subject_code(number)
    ):
        return
    begun_session = _find_begun_session(rehearsal.data, make_subject_code(number))
    if begun_session is None:
        conducted = _run_new_session(rehearsal, number)
    elif (folded_session := fold_session(begun_session)).state.closed:
        finish_tables(begun_session, folded_session)
        return
    else:
        clock = VirtualClock.resume_at(folded_session.state.sitting.last_moment.utc)
        conducted = conduct_resumed(begun_session, DEVICE_NAME, make_observer_participant(observer, seed, clock))
    write_tables(conducted.folder)
    _require_finished(conducted.folder.name, conducted.end_reason)


def rehearse_on_worker(rehearsal: Rehearsal, model_files: FileContents, number: int) -> tuple[str, FileContents, str]:
    """Run a new session in a temporary folder of a worker process. model_files: content of the model's file by name,
    empty without a model. Returns the session's name, its files, and why it ended early (empty if it finished)."""
    with TemporaryDirectory() as temporary_folder:
        write_files(Path(temporary_folder), model_files)
        model_path = None if rehearsal.model is None else Path(temporary_folder) / rehearsal.model.name
        conducted = _run_new_session(replace(rehearsal, data=Path(temporary_folder) / "data", model=model_path), number)
        write_tables(conducted.folder)
        return conducted.folder.name, read_files(conducted.folder.path), conducted.end_reason


def _run_new_session(rehearsal: Rehearsal, number: int) -> ConductedSitting:
    """Run a new session of participant `number` on the simulated device. Raises StudyError."""
    observer, seed = make_rehearsed_observer(rehearsal, number), derive_subject_seed(rehearsal.seed, number)
    plan = SessionPlan(
        protocol=rehearsal.protocol,
        protocol_text=rehearsal.protocol_text,
        protocol_locked=rehearsal.locked,
        subject=make_subject_code(number),
        observer=observer.name,
        seed=seed,
        data_folder=rehearsal.data,
        participant_number=number,
        model=rehearsal.model,
    )
    return conduct_new(plan, DEVICE_NAME, make_observer_participant(observer, seed, VirtualClock()))


def _require_finished(session: str, end_reason: str) -> None:
    """Raise StudyError for a session that ended early. end_reason: empty if it finished."""
    if end_reason:
        raise StudyError(
            "A simulated participant did not finish",
            f"{session}: {end_reason}.",
            "Change what stops it in the protocol, and rehearse in another folder.",
            saved="Everything so far is in the folder.",
        )


def _find_begun_session(data: Path, subject: str) -> SessionFolder | None:
    """Find the participant's last session whose log is not empty; None without any. A crash at the start leaves an
    empty log or none."""
    folders = [
        folder
        for folder in list_session_folders(data)
        if folder.subject == subject and folder.log.exists() and folder.log.stat().st_size
    ]
    return folders[-1] if folders else None


def _require_same_rehearsal(rehearsal: Rehearsal) -> None:
    """Raise StudyError where the folder holds other participants, or sessions with another model, observer, seed or
    protocol."""
    codes = {make_subject_code(number) for number in range(rehearsal.subjects)}
    other_sessions = [
        session_folder.name
        for session_folder in list_session_folders(rehearsal.data)
        if session_folder.subject not in codes
    ]
    if other_sessions:  # the error names five of them: enough to recognise the other study
        raise StudyError(
            "This folder holds other sessions",
            f"In addition to this rehearsal's participants there is {', '.join(other_sessions[:5])} in "
            f"{rehearsal.data}.",
            "Choose another folder with --out, or at least as many --subjects as were begun.",
            saved="Nothing was changed.",
        )
    model_path = rehearsal.model
    model_sha256 = compute_sha256(model_path) if model_path is not None and model_path.is_file() else None
    for number in range(rehearsal.subjects):
        folder = _find_begun_session(rehearsal.data, make_subject_code(number))
        if folder is None:
            continue
        session_opened = fold_session(folder).state.opened
        place = f"{folder.name} in {rehearsal.data}"
        if session_opened.equalized is not None and session_opened.equalized.sha256 != model_sha256:
            raise _make_other_rehearsal_error(place, "another --model", "--model")
        if session_opened.observer != make_rehearsed_observer(rehearsal, number).name:
            raise _make_other_rehearsal_error(place, f"the observer {session_opened.observer}", "--observer and --seed")
        is_same_seed = session_opened.seed == derive_subject_seed(rehearsal.seed, number)
        if not is_same_seed or session_opened.protocol_text != rehearsal.protocol_text:
            raise _make_other_rehearsal_error(place, "another seed or protocol", "--seed and --protocol")


def _make_other_rehearsal_error(place: str, difference: str, options: str) -> StudyError:
    """Make the error for a session of another rehearsal. place: its folders; difference: what it was begun with;
    options: of the command, that must be the same to continue."""
    return StudyError(
        "This folder holds another rehearsal",
        f"{place} was begun with {difference}.",
        f"Choose another folder with --out, or the same {options} to continue.",
        saved="Nothing was changed.",
    )
