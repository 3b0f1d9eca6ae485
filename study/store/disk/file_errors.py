"""Errors for files that cannot be read, used or written, each with cause and remedy.

They are shown to the user without further text.
"""

import csv
import errno
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path

from equalizer.signals.listed_problems import ListedProblemsError
from study.errors import StudyError
from study.regular_file import RefusedFileError

HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""Signature of HDF5: the first bytes of a file without a user block."""

VALIDATE_ADVICE = "Correct it, or make it again; `hapteq validate` checks it."
"""Remedy for a file whose content is invalid."""

DAMAGE_ERRORS = (
    OSError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RuntimeError, EOFError, MemoryError,
    AssertionError, SystemError, SyntaxError, csv.Error, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
    struct.error,
)  # fmt: skip
"""Exceptions that libraries raise for damaged files and for files of another format."""

_MAX_PROBLEM_CHARACTERS = 600
"""Largest number of characters of a problem that are shown. Chosen: about eight lines of a terminal."""
_MAX_LISTED_PROBLEMS = 40
"""Largest number of problems that are listed; of further ones the number is stated. Chosen: a list that can still be
read."""


class UnusableFileError(StudyError):
    """A file was read, and its content is invalid.

    kind: expected kind of the file, for the title; `problems`: a clause for each problem, without a full stop, cut in
    number and length by `_shorten_problems`; `sentences`: the same as sentences; do_now: remedy.
    """

    def __init__(self, path: Path, kind: str, problems: tuple[str, ...], do_now: str = VALIDATE_ADVICE) -> None:
        self.kind = kind
        self.problems = _shorten_problems(problems)
        self.sentences = tuple(_format_sentence(problem) for problem in self.problems)
        super().__init__(
            title=f"{path.name} is not a usable {kind}",
            happened=" ".join(self.sentences),
            do_now=do_now,
        )


@contextmanager
def convert_problems(path: Path, kind: str) -> Iterator[None]:
    """Context that converts a ListedProblemsError to an UnusableFileError for this file with the same problems. kind:
    name of such files in messages."""
    try:
        yield
    except ListedProblemsError as error:
        raise UnusableFileError(path, kind, error.problems) from error


class CannotReadError(StudyError):
    """A file is missing, cannot be opened or read, or is no text in UTF-8 where text is expected."""

    def __init__(self, path: Path, problem: OSError | UnicodeDecodeError) -> None:
        super().__init__(
            title=f"{path.name} cannot be read",
            happened=_explain_read_failure(path, problem) + ".",
            do_now="Check the name and the folder.",
        )


class CannotWriteError(StudyError):
    """A file could not be written. To be raised only where an existing file of that name is unchanged."""

    def __init__(self, path: Path, problem: OSError) -> None:
        reason, remedy = _explain_write_failure(path, problem)
        super().__init__(
            title=f"{path.name} was not written",
            happened=reason + ".",
            saved="Nothing was changed: no half-written file remains, and existing files are unchanged.",
            do_now=remedy,
        )
        self.problem = problem


@contextmanager
def convert_write_errors(path: Path) -> Iterator[None]:
    """Context that converts an OSError to a CannotWriteError for this file or folder."""
    try:
        yield
    except OSError as problem:
        raise CannotWriteError(path, problem) from problem


class NotSyncedError(StudyError):
    """A file or folder is complete under its name, but the folder that holds it could not be synced to the disk."""

    def __init__(self, path: Path, problem: OSError) -> None:
        super().__init__(
            title=f"{path.name} may be lost at a power failure",
            happened=f"The entry in {path.parent} could not be synced to the disk: {problem.strerror or problem}.",
            saved=f"{path.name} is in place and complete.",
            do_now="Check the disk and the permissions of the folder, and keep a copy elsewhere.",
        )
        self.problem = problem


class AlreadyExistsError(StudyError):
    """A file exists under the name to be written, and overwriting was not requested."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            title=f"{path.name} already exists",
            happened="Nothing that exists is overwritten.",
            saved="The file is as it was.",
            do_now="Choose another name, or move the old file away.",
        )


_CAPITALIZED_WORDS = {
    "it",
    "its",
    "this",
    "the",
    "there",
    "line",
    "segment",
    "segments",
    "effect",
    "unknown",
    "column",
    "and",
}
"""First words of problems that are capitalized; any other first word is taken for a key or a name and keeps
its case."""


def _shorten_problems(problems: tuple[str, ...]) -> tuple[str, ...]:
    """Limit the problems in number and length: a damaged file may have a million problems or a name of a million
    letters. Of omitted problems the number is added."""
    unlisted_count = len(problems) - _MAX_LISTED_PROBLEMS
    omission_note = (f"and {unlisted_count} more problems",) if unlisted_count > 0 else ()
    shortened_problems = (
        text if len(text) <= _MAX_PROBLEM_CHARACTERS else f"{text[:_MAX_PROBLEM_CHARACTERS]}…" for text in problems
    )
    return (*islice(shortened_problems, _MAX_LISTED_PROBLEMS), *omission_note)


def _format_sentence(clause: str) -> str:
    """Format the clause of a problem as a sentence with capital letter and full stop; a key or name at its beginning
    keeps its case."""
    first_letter = clause[:1].upper() if clause.partition(" ")[0] in _CAPITALIZED_WORDS else clause[:1]
    return first_letter + clause[1:].rstrip(".") + "."


def _explain_read_failure(path: Path, error: OSError | UnicodeDecodeError) -> str:
    """Explain in words why a file cannot be read, without a full stop."""
    match error:
        case FileNotFoundError():
            return f"There is no file {path}"
        case IsADirectoryError():
            return f"{path} is a folder"
        case PermissionError():
            return f"You have no right to read {path}"
        case UnicodeDecodeError():
            if error.object.startswith(HDF5_SIGNATURE, error.start):  # a user block before it is text
                return "It is an HDF5 file, and text is expected here"
            return f"It is neither HDF5 nor text in UTF-8 (byte {error.start})"
        case RefusedFileError():
            return error.reason[:1].upper() + error.reason[1:]
    return f"The system says: {error.strerror or error}"


def _explain_write_failure(path: Path, error: OSError) -> tuple[str, str]:
    """Explain in words why a file cannot be written, without a full stop, and give a remedy."""
    match error.errno:
        case errno.ENOSPC | errno.EDQUOT:
            return "The disk is full", "Make room and do it again."
        case errno.EFBIG:
            return "It would be larger than the system allows for one file", "Raise the limit, or write less at once."
        case errno.EACCES | errno.EPERM | errno.EROFS:
            return f"You have no right to write in {path.parent}", "Choose another folder."
        case errno.ENOENT | errno.ENOTDIR:
            return f"There is no folder {path.parent}", "Make the folder first, or choose another."
        case errno.EEXIST:
            return f"{path} is there, and is no folder", "Choose another name for the folder."
        case errno.EISDIR:
            return f"{path} is a folder", "Choose a name for a file."
    return f"The system says: {error.strerror or error}", "Choose another folder, or correct this and try again."
