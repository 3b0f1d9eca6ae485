"""Folder layout of a blind test of the diagnosis: its inputs, the sealed labels (ground truth), and the results.

Layout: bank.json (settings of the bank), open/CASE/ (all that the diagnosis gets, and its answer), sealed/NUMBER.json
(labels), labels.sha256 (seals), engine.log, and begun/ while cases are written. The random name of a case does not
reveal its number, so that the diagnosis cannot find its label.
"""

import json
from dataclasses import dataclass
from pathlib import Path

from study.errors import StudyError
from study.store.disk.json_document import parse_json
from study.store.disk.text_file import read_text, write_text


@dataclass(frozen=True, slots=True)
class ProofFolder:
    """Paths in the folder of a bank."""

    path: Path

    @property
    def open(self) -> Path:
        """Folder of the cases, one folder each, as the diagnosis gets them."""
        return self.path / "open"

    @property
    def unfinished(self) -> Path:
        """Folder of the cases that are being written."""
        return self.path / "begun"

    @property
    def sealed(self) -> Path:
        """Folder of the labels, a file each."""
        return self.path / "sealed"

    @property
    def seals_file(self) -> Path:
        """File with the SHA-256 of each label, in the format of `sha256sum --check`."""
        return self.path / "labels.sha256"

    @property
    def log_file(self) -> Path:
        """File with what the processes of the diagnosis wrote to stderr."""
        return self.path / "engine.log"

    def label_file(self, number: int) -> Path:
        """File of the label of a case, by its number."""
        return self.sealed / f"{number:05d}.json"


RECORDING, MODEL, SETTINGS, ANSWER = "recording.h5", "model.toml", "settings.json", "answer.json"
"""Files in a case's folder under `open`; the last is written by the diagnosis."""
FURTHER_RECORDING = "recording_{}.h5"
"""File of a further recording of a case, by its number."""
WORKER_DIED = "died"
"""Key in an answer that marks that the worker process ended before it answered."""
CLEAN_FOLDER = "clean"
"""Sub-folder of a case with reference recordings of the intact device, where it has any."""


def open_proof_folder(path: Path, seed: int, short_recordings: bool, bank_kind: str = "") -> ProofFolder:
    """Create the folder of a bank, or open an existing folder to continue. short_recordings:
    whether the recordings are short, for tests. bank_kind: kind of the bank; empty where effects of the catalogue are
    concealed.

    Raises StudyError where the folder holds something else or a bank with other settings.
    """
    folder, plan_path = ProofFolder(path), path / "bank.json"
    bank = {
        "format": "hapteq-bank",
        "version": 1,
        "seed": seed,
        "brief": short_recordings,
        **({"of": bank_kind} if bank_kind else {}),
    }
    document_text = json.dumps(bank, indent=1) + "\n"
    if plan_path.exists():
        if parse_json(plan_path, read_text(plan_path), "bank") != json.loads(document_text):
            raise StudyError(
                "This folder holds another bank",
                f"{path} was begun with another --seed, other options, or another length of its recordings.",
                "Choose another folder with --out, or the same options to continue.",
                saved="Nothing was changed.",
            )
        return folder
    if path.is_dir() and any(path.iterdir()):
        raise StudyError(
            "A bank needs a folder of its own",
            f"{path} holds other files.",
            "Choose another name with --out, or empty it.",
            saved="Nothing was written.",
        )
    for subfolder in (folder.open, folder.sealed):
        subfolder.mkdir(parents=True, exist_ok=True)
    write_text(plan_path, document_text)
    return folder
