"""Export a study's trials for other tools (`hapteq export`), and read exported datasets for an analysis.

Four forms can be written: Psych-DS, BIDS behaviour, MATLAB (.mat) and tidy CSV, each with protocol, seeds and versions;
Psych-DS and tidy CSV can be read back.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from protocols.definition.study_protocol import StudyProtocol
from protocols.document.dumping import dump_protocol
from protocols.document.hashing import hash_protocol
from protocols.document.loading import ProtocolError, load_protocol
from protocols.trial import Trial
from study.errors import StudyError
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.new_folder import create_new_folder, require_new_folder
from study.store.disk.provenance import gather_provenance
from study.store.formats import tidy_csv
from study.store.formats.answer_table import make_answer_table
from study.store.formats.bids_behaviour import write_bids
from study.store.formats.psych_ds import (
    DESCRIPTION_NAME,
    KIND,
    PROTOCOL_PATH,
    is_psych_ds,
    read_psych_ds,
    write_psych_ds,
)
from study.store.formats.trials_mat import write_trials_mat
from study.store.sessions.archive import SessionFolder, list_linked_sessions, require_consent
from study.store.sessions.written_elsewhere import note_written_folder
from study.workflows.results.collected_trials import CollectedTrials

FORMAT, VERSION = "hapteq-export", 1
"""Name and version of the format of the metadata; datasets of an earlier hapteq state none."""
MAX_LEFT_OUT = 10_000
"""Largest plausible number of excluded items in a dataset; a larger one is ignored as an error of editing. Chosen."""
EXPORT_AGAIN = "Export the study again, or restore the file from a copy."
"""Remedy for a damaged or edited dataset, for messages."""
Form = Literal["psych-ds", "bids", "mat", "csv"]
"""Form of an export, as the command line takes it."""
WRITERS: dict[str, Callable[..., tuple[Path, ...]]] = {
    "psych-ds": write_psych_ds,
    "bids": write_bids,
    "mat": write_trials_mat,
    "csv": tidy_csv.write_tidy_csv,
}
"""Functions that write a dataset, by form, and return the written files."""


@dataclass(frozen=True, slots=True)
class ExportResult:
    """Result of an export."""

    out: Path
    files: tuple[str, ...]
    """Paths relative to `out`."""
    trials: int
    left_out: tuple[str, ...]
    """Sentences on what was excluded, and why."""


def export_study(
    collected: CollectedTrials, data: Path, out_folder: Path, form: Form, free_text: bool = False
) -> ExportResult:
    """Write the dataset atomically into `out_folder`, new or empty. collected: the sessions of the data folder `data`
    that belong together. free_text: include answers that participants wrote in their own words. Raises StudyError where
    `out_folder` exists and is not an empty folder, or cannot be written, and where a participant withdrew meanwhile."""
    require_new_folder(out_folder)
    metadata, answers = _gather_metadata(collected), make_answer_table(collected.protocol, collected.forms, free_text)
    # Before the folder exists, so that a withdrawal names it even if the program ends here.
    for source in (data, *list_linked_sessions(collected.sessions)):
        note_written_folder(source, out_folder, even_if_searched=True)
    with create_new_folder(out_folder) as folder:
        files = WRITERS[form](
            folder, collected.protocol.name, collected.trials, dump_protocol(collected.protocol), metadata, answers
        )
        names = tuple(path.relative_to(folder).as_posix() for path in files)
        require_consent(collected.sessions)  # again: a withdrawal may have begun since they were collected
    return ExportResult(out_folder, names, len(collected.trials), collected.exclusions)


def _gather_metadata(collected: CollectedTrials) -> dict[str, Any]:
    """Gather the metadata of the dataset: provenance, seeds, devices, observers, lock of the protocol, number of
    exclusions, and quality of the models."""
    names = [folder.name for folder in collected.sessions]
    return {
        "format": FORMAT,
        "version": VERSION,
        **gather_provenance(protocol_hash=collected.protocol_hash).as_dict(),
        "protocol_hash": collected.protocol_hash,
        "seeds": dict(zip(names, collected.seeds, strict=True)),
        "devices": list(collected.devices),
        "observers": list(collected.observers),
        "locked": collected.lock_statement,
        # Only the number: the sentences would name sessions of people who withdrew.
        "left_out_count": len(collected.exclusions),
        "model_qualities": [list(quality) for quality in collected.model_qualities],
    }


def _check_rows(folder: Path, trials: Sequence[Trial], kind: str) -> None:
    """Raise StudyError for a dataset without trials, UnusableFileError where a presentation occurs more than once."""
    if not trials:
        raise StudyError("There is nothing to analyse", f"{folder} holds no trial.", "Export the study again.")
    presentation_counts = Counter((trial.session, trial.run, trial.trial, trial.attempt) for trial in trials)
    duplicates = [
        f"session {session}, run {run}, trial {trial}, attempt {attempt} is there {count} times"
        for (session, run, trial, attempt), count in presentation_counts.items()
        if count > 1
    ]
    if duplicates:
        raise UnusableFileError(folder, kind, tuple(duplicates))


def _write_exclusion_sentences(metadata: Mapping[str, Any]) -> tuple[str, ...]:
    """Write a sentence for each item that was excluded before the export; none where the metadata state no number, or
    one that is not plausible (`MAX_LEFT_OUT`)."""
    count = metadata.get("left_out_count", 0)
    if not isinstance(count, int) or not 0 <= count <= MAX_LEFT_OUT:
        return ()
    return tuple(f"Before the export, {number} of {count} was left out." for number in range(1, count + 1))


def _read_qualities(metadata: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    """Read, for each model, its sessions and a sentence on its quality; malformed entries are ignored."""
    entries = metadata.get("model_qualities", [])
    rows = entries if isinstance(entries, list) else []
    return tuple((str(row[0]), str(row[1])) for row in rows if isinstance(row, list) and len(row) == 2)


def _require_version(metadata: Mapping[str, Any], path: Path, kind: str) -> None:
    """Raise UnusableFileError for metadata of another version, such as of a newer hapteq."""
    if (version := metadata.get("version", VERSION)) != VERSION:
        reason = f"its version is {version}; this program reads version {VERSION}"
        raise UnusableFileError(path, kind, (reason,), "Use the hapteq that exported it, or a newer one.")


def _read_seeds(metadata: Mapping[str, Any], path: Path, kind: str) -> dict[str, int]:
    """Read the seeds by session; empty where the metadata state none. Raises UnusableFileError for values that are no
    seeds."""
    seeds = metadata.get("seeds", {})
    if not isinstance(seeds, dict) or any(type(seed) is not int for seed in seeds.values()):
        raise UnusableFileError(path, kind, ("its seeds are no whole numbers by session",), EXPORT_AGAIN)
    return seeds


def _read_names(metadata: Mapping[str, Any], key: str, path: Path, kind: str) -> tuple[str, ...]:
    """Read the texts under a key of the metadata; empty without that key. Raises UnusableFileError for another type."""
    names = metadata.get(key, [])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise UnusableFileError(path, kind, (f"its {key} are no list of texts",), EXPORT_AGAIN)
    return tuple(names)


def is_exported(folder: Path) -> bool:
    """Whether the folder is a Psych-DS or tidy CSV dataset, which `collect_exported` can read."""
    return is_psych_ds(folder) or tidy_csv.is_tidy_csv(folder)


def collect_exported(folder: Path) -> CollectedTrials:
    """Read a dataset that `export_study` wrote as Psych-DS or tidy CSV. A session without a seed in the metadata gets
    the seed 0. Raises StudyError, for example where the protocol was changed after the export."""
    has_psych_ds = is_psych_ds(folder)
    dataset = read_psych_ds(folder) if has_psych_ds else tidy_csv.read_tidy_csv(folder)
    path, kind = (
        folder / (PROTOCOL_PATH if has_psych_ds else tidy_csv.PROTOCOL_NAME),
        KIND if has_psych_ds else tidy_csv.KIND,
    )
    metadata_path = folder / (DESCRIPTION_NAME if has_psych_ds else tidy_csv.FACTS_NAME)
    _require_version(dataset.facts, metadata_path, kind)
    try:
        protocol = load_protocol(dataset.protocol_text, path.name)
    except ProtocolError as error:
        raise UnusableFileError(path, kind, tuple(str(problem) for problem in error.problems)) from error
    if not isinstance(protocol, StudyProtocol):
        raise UnusableFileError(path, kind, ("it is no protocol of a study",))
    if dataset.facts.get("protocol_hash", hash_protocol(protocol)) != hash_protocol(protocol):
        raise UnusableFileError(
            path,
            kind,
            (f"it was changed since the export: its hash is not that of {metadata_path.name}",),
            EXPORT_AGAIN,
        )
    _check_rows(folder, dataset.trials, kind)
    seeds = _read_seeds(dataset.facts, metadata_path, kind)
    sessions = tuple(dict.fromkeys(trial.session for trial in dataset.trials))
    return CollectedTrials(
        protocol=protocol,
        protocol_hash=hash_protocol(protocol),
        trials=dataset.trials,
        sessions=tuple(SessionFolder(folder / name) for name in sessions),
        seeds=tuple(seeds.get(name, 0) for name in sessions),
        devices=_read_names(dataset.facts, "devices", metadata_path, kind),
        observers=_read_names(dataset.facts, "observers", metadata_path, kind),
        exclusions=_write_exclusion_sentences(dataset.facts),
        model_qualities=_read_qualities(dataset.facts),
        lock_statement=str(dataset.facts.get("locked", "not known")),
        result_file_notes=(),
        input_paths=(*dataset.files, path),
    )
