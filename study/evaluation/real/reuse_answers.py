"""Reuse of answers of an earlier run of `hapteq real`.

An answer is reused if the hashes of its input files and its settings are unchanged. If any of them has changed, the
whole run is refused before any work, with a list of the changes.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from analysis.diagnosis.real_answer.real_answer import RealAnswer
from study.errors import StudyError
from study.evaluation.real.real_folder import RealRecording
from study.store.disk.provenance import Provenance, gather_provenance
from study.store.formats.real_answer_file import read_answer_and_provenance

ANSWER_NAME, INJECTED_NAME = "answer.json", "injected"
"""File with the answer to a recording, and folder with the answers to injected faults."""


def locate_answer_folder(out: Path, real_recording: RealRecording) -> Path:
    """Return the folder with the results of one recording, in the output folder `out`."""
    return out / real_recording.folder.name / real_recording.name


def gather_answer_provenance(real_recording: RealRecording, seconds: float | None) -> Provenance:
    """Gather the provenance of an answer: SHA-256 of all input files, and settings, on which it depends. seconds: time
    limit of a diagnosis (--seconds); None if left out. Raises CannotReadError where an input cannot be read."""
    input_files = tuple(dict.fromkeys((*real_recording.parents, *real_recording.tested_on)))
    return gather_provenance(parents=input_files, settings={"seconds": seconds})


def find_reusable_answers(
    out: Path, recordings: Sequence[RealRecording], seconds: float | None
) -> dict[Path, RealAnswer]:
    """Find earlier answers, by the folder of their results; nothing is written. seconds: as in
    `gather_answer_provenance`. Raises StudyError where an answer is damaged or was given for other inputs or settings,
    and CannotReadError where an input cannot be read."""
    answers, changes = dict[Path, RealAnswer](), dict[Path, tuple[str, ...]]()
    for recording in recordings:
        folder = locate_answer_folder(out, recording)
        if (folder / ANSWER_NAME).is_file():
            answers[folder], changes[folder] = _read_earlier_answer(folder, recording, seconds)
    if any(changes.values()):
        raise _make_inputs_changed_error(out, {folder: clauses for folder, clauses in changes.items() if clauses})
    return answers


def _read_earlier_answer(
    folder: Path, real_recording: RealRecording, seconds: float | None
) -> tuple[RealAnswer, tuple[str, ...]]:
    """Read the answer in a folder of results, and the changes of its inputs and settings since, as clauses; empty if it
    can be reused. Raises StudyError where it is damaged."""
    try:
        answer, stored_provenance = read_answer_and_provenance(folder / ANSWER_NAME)
    except StudyError as error:
        raise StudyError(
            f"{real_recording.folder.name}/{real_recording.name}/{error.title}",
            error.happened,
            f"Move {folder} away to diagnose it again, or choose another --out.",
            saved="Nothing was written.",
        ) from error
    current_provenance = gather_answer_provenance(real_recording, seconds)
    current_files = {(parent.file, parent.sha256) for parent in current_provenance.parents}
    return answer, (
        *_compare_files(_read_parents(stored_provenance), current_files),
        *_compare_settings(stored_provenance, seconds),
    )


def _read_parents(provenance: Mapping[str, Any]) -> set[tuple[str, str]]:
    """Read (name, SHA-256) of all input files from a stored provenance; empty where it lists none."""
    stored_parents = provenance.get("parents")
    parents = stored_parents if isinstance(stored_parents, list) else []
    return {(str(parent.get("file")), str(parent.get("sha256"))) for parent in parents if isinstance(parent, dict)}


def _compare_files(earlier_files: set[tuple[str, str]], current_files: set[tuple[str, str]]) -> Iterator[str]:
    """Yield a clause for each input file that was added, changed or removed. earlier_files, current_files: (name,
    SHA-256)."""
    earlier_names, current_names = ({name for name, _ in files} for files in (earlier_files, current_files))
    for name in sorted({name for name, _ in earlier_files ^ current_files}):
        if name not in earlier_names:
            yield f"{name} is not among its recorded inputs"
        else:
            yield f"{name} has changed" if name in current_names else f"{name} is gone"


def _compare_settings(provenance: Mapping[str, Any], seconds: float | None) -> Iterator[str]:
    """Yield a clause where --seconds, the only setting, has changed or was not recorded."""
    settings = provenance.get("settings")
    earlier_s = settings.get("seconds", "") if isinstance(settings, dict) else ""
    if not isinstance(earlier_s, int | float | None):
        yield "its --seconds is not recorded"
    elif earlier_s != seconds:
        yield f"--seconds was {_format_seconds(earlier_s)}, and is {_format_seconds(seconds)}"


def _format_seconds(limit_s: float | None) -> str:
    """Format a value of --seconds; "left out" for None."""
    return "left out" if limit_s is None else f"{limit_s:g}"


def _make_inputs_changed_error(out: Path, changes: Mapping[Path, tuple[str, ...]]) -> StudyError:
    """Make the error that lists the changes of all outdated answers, by their folders, which are to be moved away."""
    change_texts = (f"{path.relative_to(out) / ANSWER_NAME}: {', '.join(texts)}." for path, texts in changes.items())
    paths_to_move = [str(folder) for folder in changes]
    if (injected_folder := out / INJECTED_NAME).exists():
        paths_to_move.append(f"{injected_folder}, which was computed from them")
    return StudyError(
        "Inputs of existing answers have changed",
        " ".join(change_texts),
        f"Choose another --out; or, to diagnose them again, move away {'; '.join(paths_to_move)}.",
        saved="The existing answers are unchanged, and nothing was written.",
    )
