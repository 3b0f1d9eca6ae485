"""Folder layout of a blind test of the diagnosis: its inputs, the sealed labels (ground truth), and the results.

Layout: bank.json (settings of the bank), open/CASE/ (all that the diagnosis gets, and its answer), sealed/NUMBER.json
(labels), labels.sha256 (seals), engine.log, bank.lock, and begun/ while cases are written. The random name of a case
does not reveal its number. next/ is the bank of follow-up cases, with the same layout; controls/SEED/ has cases in
open/, but no labels; a bank of laws has the test motions of each case beside its label."""

import json
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from study.errors import StudyError
from study.store.disk.file_lock import hold_file_lock
from study.store.disk.json_document import parse_json
from study.store.disk.text_file import read_text, write_text


@dataclass(frozen=True, slots=True)
class ProofFolder:
    """Paths in the folder of a bank."""

    path: Path

    @property
    def open(self) -> Path:
        """Folder of the complete cases, one folder each, as the diagnosis gets them."""
        return self.path / "open"

    @property
    def unfinished(self) -> Path:
        """Folder of the cases that are being written."""
        return self.path / "begun"

    @property
    def sealed(self) -> Path:
        """Folder of the labels, one file for each number."""
        return self.path / "sealed"

    @property
    def labels(self) -> list[Path]:
        """Paths of the labels, sorted by number. A file of another name, such as a copy, is none of them."""
        return sorted(self.sealed.glob("[0-9][0-9][0-9][0-9][0-9].json"))

    @property
    def seals_file(self) -> Path:
        """File with the SHA-256 of each label, in the format of `sha256sum --check`."""
        return self.path / "labels.sha256"

    @property
    def lock_file(self) -> Path:
        """File that is locked while a process works on the bank."""
        return self.path / "bank.lock"

    @property
    def log_file(self) -> Path:
        """File with what the processes of the diagnosis wrote to stderr."""
        return self.path / "engine.log"

    def get_label_file(self, number: int) -> Path:
        """Path of the label with this number; a follow-up has one label for several cases."""
        return self.sealed / f"{number:05d}.json"


BANK_FILE = "bank.json"
"""File with the settings of a bank, in its folder."""
RECORDING_FILE, MODEL_FILE, SETTINGS_FILE, ANSWER_FILE = "recording.h5", "model.toml", "settings.json", "answer.json"
"""Files in a case's folder under `open`; the last holds the answer of the diagnosis."""
FURTHER_RECORDING_FILE = "recording_{}.h5"
"""File name of a further recording of a case; the braces stand for its number."""
WORKER_DIED_KEY = "died"
"""Key in an answer which states that the worker process ended before it answered."""
CLEAN_FOLDER = "clean"
"""Sub-folder of a case with reference recordings of the intact device, where it has any."""


def open_proof_folder(path: Path, seed: int, short_recordings: bool, bank_kind: str = "") -> ProofFolder:
    """Create the folder of a bank, or open an existing folder to continue. seed: of the bank's cases. short_recordings:
    whether the recordings are short, for tests. bank_kind: kind of the bank; empty where effects of the catalogue are
    concealed.

    Raises StudyError where the folder contains other files or a bank with other settings.
    """
    folder, bank_path = ProofFolder(path), path / BANK_FILE
    bank_settings = {
        "format": "hapteq-bank",
        "version": 1,
        "seed": seed,
        "brief": short_recordings,
        **({"of": bank_kind} if bank_kind else {}),
    }
    document_text = json.dumps(bank_settings, indent=1) + "\n"
    if bank_path.exists():
        if parse_json(bank_path, read_text(bank_path), "bank") != json.loads(document_text):
            raise StudyError(
                "This folder holds another bank",
                f"{path} was begun with another --seed, other options, or another length of its recordings.",
                "Choose another folder with --out, or the same options to continue.",
                saved="Nothing was changed.",
            )
    elif path.is_dir() and any(path.iterdir()):
        raise StudyError(
            "A bank needs a folder of its own",
            f"{path} holds other files.",
            "Choose another name with --out, or empty it.",
            saved="Nothing was written.",
        )
    else:
        path.mkdir(parents=True, exist_ok=True)
        write_text(bank_path, document_text)
    # After the file, without which the folder could not be opened again where its writing failed.
    for subfolder in (folder.open, folder.sealed):
        subfolder.mkdir(exist_ok=True)
    return folder


def hold_proof_folder(folder: ProofFolder) -> AbstractContextManager[None]:
    """Hold the lock of a bank within the context: a second process would remove cases that the first is writing.
    Raises StudyError, without waiting, where another process holds it or the folder is not writable."""
    held_error = StudyError(
        "Another process works on this bank",
        f"It holds {folder.lock_file}.",
        "Wait until it has ended, or choose another folder with --out.",
        saved="Nothing was changed.",
    )
    return hold_file_lock(folder.lock_file, held_error, "The bank's folder")
