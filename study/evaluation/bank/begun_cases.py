"""Cases of a bank appear under `open` complete and with a label, or not at all, wherever a sealing is killed.

A case is written into a folder of its own under `begun`; then its label is written, and last the folder renamed. What a
killed sealing left under `begun` has a label, and is renamed at the next run, or has none, and is drawn anew.
"""

import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from study.evaluation.bank.proof_folder import ProofFolder
from study.store.disk.atomic_write import sync_folder
from study.store.disk.text_file import read_text

NAME_BYTES = 6
"""Random bytes of a case's name, which says nothing of its number."""


def begin_case(folder: ProofFolder) -> Path:
    """A new folder for the files of a case; its name is the case's."""
    place = folder.begun / secrets.token_hex(NAME_BYTES)
    place.mkdir(parents=True)
    return place


def show_case(folder: ProofFolder, place: Path) -> None:
    """Rename the folder of a case into `open`, after its label was written."""
    sync_folder(place)
    place.rename(folder.open / place.name)
    sync_folder(folder.open)


@contextmanager
def finish_begun_cases(folder: ProofFolder) -> Iterator[None]:
    """Context of a sealing: on entry, finish or remove the cases of an earlier one that was killed; on exit, remove the
    folder `begun`."""
    _finish_begun(folder)
    yield
    with suppress(FileNotFoundError):
        folder.begun.rmdir()


def _finish_begun(folder: ProofFolder) -> None:
    begun = sorted(folder.begun.iterdir()) if folder.begun.exists() else []
    labels = [read_text(path) for path in sorted(folder.sealed.glob("*.json"))] if begun else []
    for place in begun:
        # A label of follow-ups names several cases, each by its quoted name.
        if any(f'"{place.name}"' in label for label in labels):
            show_case(folder, place)
        else:
            shutil.rmtree(place)
