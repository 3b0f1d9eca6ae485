"""Atomic creation of a bank's cases: a case is in the folder `open` with all files and a label, or not at all, even if
the process that draws the cases is killed at any point.

The files of a case are written into a folder under `begun`; then the label is written; last, the folder is renamed into
`open`. After a kill, the next run renames the folders in `begun` that have a label, and removes the others, whose cases
are drawn again.
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
"""Random bytes in the name of a case, so that the name does not reveal the number. Chosen: equal names are
improbable."""


def begin_case(folder: ProofFolder) -> Path:
    """Make a folder under `begun` for the files of a new case; its random name is the name of the case."""
    case_folder = folder.unfinished / secrets.token_hex(NAME_BYTES)
    case_folder.mkdir(parents=True)
    return case_folder


def publish_case(folder: ProofFolder, case_folder: Path) -> None:
    """Move the folder of a case from `begun` to `open` and flush both to disk; its label must be written before."""
    sync_folder(case_folder)
    case_folder.rename(folder.open / case_folder.name)
    sync_folder(folder.open)


@contextmanager
def finish_begun_cases(folder: ProofFolder) -> Iterator[None]:
    """Context in which cases are drawn: on entry, finish or remove the cases of an earlier run that was killed; on
    normal exit, remove the folder `begun`. Raises OSError where it is not empty then."""
    _publish_or_remove(folder)
    yield
    with suppress(FileNotFoundError):
        folder.unfinished.rmdir()


def _publish_or_remove(folder: ProofFolder) -> None:
    """Move begun cases that have a label to `open`, and remove the others."""
    begun_folders = sorted(folder.unfinished.iterdir()) if folder.unfinished.exists() else []
    labels = [read_text(path) for path in folder.labels] if begun_folders else []
    for case_folder in begun_folders:
        # The label of a follow-up contains the names of several cases, each in quotation marks.
        if any(f'"{case_folder.name}"' in label for label in labels):
            publish_case(folder, case_folder)
        else:
            shutil.rmtree(case_folder)
