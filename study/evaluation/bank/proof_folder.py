"""The folder of a proof: what the diagnosis is given, what is sealed beside it, and what comes out."""

import json
from dataclasses import dataclass
from pathlib import Path

from study.errors import StudyError
from study.store.disk.json_document import parse_json
from study.store.disk.text_file import read_text, write_text


@dataclass(frozen=True, slots=True)
class ProofFolder:
    """bank.json: which bank. open: one folder per case, all that the diagnosis is given. sealed: the truths, one file
    each. labels.sha256: their hashes, as `sha256sum --check` reads them."""

    path: Path

    @property
    def open(self) -> Path:
        return self.path / "open"

    @property
    def sealed(self) -> Path:
        return self.path / "sealed"

    @property
    def seals(self) -> Path:
        return self.path / "labels.sha256"

    @property
    def log(self) -> Path:
        return self.path / "engine.log"

    def label(self, number: int) -> Path:
        return self.sealed / f"{number:05d}.json"


RECORDING, MODEL, SETTINGS, ANSWER = "recording.h5", "model.toml", "settings.json", "answer.json"
"""In a case's folder under `open`; the last is what the diagnosis adds."""
DIED = "died"
"""Key of an answer that no process gave."""
CLEAN = "clean"
"""A folder beside them, where the case has recordings of the device when it was in order."""


def opened(path: Path, seed: int, brief: bool, of: str = "") -> ProofFolder:
    """Made, or the one that is there already, to go on. of: what is concealed, where it is no effect of the catalogue.

    Raises StudyError where it holds something else.
    """
    folder, said = ProofFolder(path), path / "bank.json"
    bank = {"format": "hapteq-bank", "version": 1, "seed": seed, "brief": brief, **({"of": of} if of else {})}
    wanted = json.dumps(bank, indent=1) + "\n"
    if said.exists():
        if parse_json(said, read_text(said), "bank") != json.loads(wanted):
            raise StudyError(
                "This folder holds another bank",
                f"{path} was begun with another --seed, other options, or another length of its recordings.",
                "Choose another folder with --out, or the same options to go on.",
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
    for each in (folder.open, folder.sealed):
        each.mkdir(parents=True, exist_ok=True)
    write_text(said, wanted)
    return folder
