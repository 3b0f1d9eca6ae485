"""What every sealed bank does: its open cases are answered, its seals checked, its labels revealed."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from study.errors import LeftError
from study.evaluation.bank.ask_engine import ask_engine, forget_recording, is_answered
from study.evaluation.bank.proof_folder import ANSWER, ProofFolder
from study.evaluation.bank.proof_seals import answer_at, broken_seal, is_of, label_at, seals_of
from study.store.disk.provenance import sha256_of

Progress = Callable[[str, int, int], None]
"""What is being done; how many are done, of how many."""
Found = TypeVar("Found")


@dataclass(frozen=True, slots=True)
class Wishes:
    workers: int = 2
    keep: bool = False
    """Recordings stay once they are answered."""
    controls: bool = False
    """What must change, or must not, is asked too."""


@contextmanager
def resumable(path: Path) -> Iterator[None]:
    """Raises LeftError for an interruption: the same call goes on."""
    try:
        yield
    except KeyboardInterrupt as interruption:
        raise LeftError(
            "Interrupted",
            "The bank is not finished.",
            "Run the same command again: it goes on where it stopped.",
            saved=f"All that is sealed and answered so far is in {path}.",
        ) from interruption


def answer_bank(
    folder: ProofFolder, names: Iterable[str], asked: Sequence[str], wishes: Wishes, on_progress: Progress
) -> None:
    """names: of all cases. asked: of those that the engine is handed; it leaves out what is answered."""
    every = tuple(names)
    done = sum(is_answered(folder.open / name) for name in every)
    on_progress("diagnosing", done, len(every))

    def on_answered(name: str) -> None:
        nonlocal done
        done += 1
        if not wishes.keep:
            forget_recording(folder.open / name)
        on_progress("diagnosing", done, len(every))

    ask_engine(folder, asked, wishes.workers, on_answered)


def reveal_bank(
    folder: ProofFolder,
    cases: int,
    outcome_of: Callable[[dict[str, Any], dict[str, Any]], Found],
    is_whole: Callable[[dict[str, Any]], bool] = lambda label: True,
) -> tuple[Found, ...]:
    """Of the first so many numbers, all that are answered. outcome_of: what a label and its answer come to. is_whole:
    whether what a label seals beside itself is as it was. Raises StudyError where a seal is broken."""
    seals = seals_of(folder)
    found: list[Found] = []
    broken: list[str] = []
    for path in sorted(folder.sealed.glob("*.json")):
        if seals.get(f"sealed/{path.name}") != sha256_of(path):
            broken.append(path.name)
            continue
        label = label_at(path)
        if not is_whole(label):
            broken.append(path.name)
            continue
        place = folder.open / label["name"]
        if label["number"] >= cases or not (place / ANSWER).exists():
            continue
        said = answer_at(place)
        if not is_of(label, said):
            broken.append(path.name)
        found.append(outcome_of(label, said))
    if broken:
        raise broken_seal(broken, folder.path)
    return tuple(found)


def engines(folder: ProofFolder, names: Iterable[str]) -> tuple[str, ...]:
    """Digests of the code that gave the answers; more than one where it changed on the way."""
    answers = [answer_at(folder.open / name) for name in names if (folder.open / name / ANSWER).exists()]
    return tuple(sorted({answer["engine"] for answer in answers if "engine" in answer}))
