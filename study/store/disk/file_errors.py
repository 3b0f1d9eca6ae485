"""Errors of files that cannot be read, used or written, each with advice to the user.

They are shown to the user without further text, so that each states what happened and what to do.
"""

import csv
import errno
import struct
import tokenize
import zipfile
import zlib
from itertools import islice
from pathlib import Path

from study.errors import StudyError
from study.regular_file import RefusedFileError

CHECKED = "Correct it, or make it again; `hapteq validate` checks it."
"""Advice for a file whose content is wrong."""


DAMAGED = (
    OSError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RuntimeError, EOFError, MemoryError,
    AssertionError, SystemError, SyntaxError, csv.Error, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
    struct.error,
)  # fmt: skip
"""Exceptions that reading libraries raise for damaged or misnamed files."""

_LONGEST_PROBLEM = 600
"""Number of characters of a problem that are shown."""
_MOST_PROBLEMS = 40
"""Number of problems that are listed; the others are counted."""


class UnusableFileError(StudyError):
    """A file was read, and its content is invalid.

    `problems`: a sentence fragment for each problem, without a full stop; `sentences`: the same as whole sentences.
    kind: what the file should be, for the title; do_now: advice.
    """

    def __init__(self, path: Path, kind: str, problems: tuple[str, ...], do_now: str = CHECKED) -> None:
        self.kind = kind
        self.problems = _shorten_problems(problems)
        self.sentences = tuple(_sentence(problem) for problem in self.problems)
        super().__init__(
            title=f"{path.name} is not a usable {kind}",
            happened=" ".join(self.sentences),
            do_now=do_now,
        )


class CannotReadError(StudyError):
    """A file is missing or cannot be opened."""

    def __init__(self, path: Path, problem: OSError | UnicodeDecodeError) -> None:
        super().__init__(
            title=f"{path.name} cannot be read",
            happened=_explain_read_failure(path, problem) + ".",
            do_now="Check the name and the folder.",
        )


class CannotWriteError(StudyError):
    """A file could not be written. An existing file is untouched."""

    def __init__(self, path: Path, problem: OSError) -> None:
        reason, remedy = _explain_write_failure(path, problem)
        super().__init__(
            title=f"{path.name} was not written",
            happened=reason + ".",
            saved="Nothing was changed: no half-written file remains, and existing files are unchanged.",
            do_now=remedy,
        )


class AlreadyThereError(StudyError):
    """A file exists under the name to be written. Existing files are overwritten on request only."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            title=f"{path.name} already exists",
            happened="Nothing that exists is overwritten.",
            saved="The file is as it was.",
            do_now="Choose another name, or move the old file away.",
        )


_PROSE = {"it", "its", "this", "the", "there", "line", "segment", "segments", "effect", "unknown", "column", "and"}
"""First words of problems that get a capital letter; any other first word is a key or a name, which keeps its case."""


def _shorten_problems(problems: tuple[str, ...]) -> tuple[str, ...]:
    """The problems, limited in number and length: a damaged file may have a million problems or a name of a million
    letters."""
    unlisted = len(problems) - _MOST_PROBLEMS
    remainder = (f"and {unlisted} more problems",) if unlisted > 0 else ()
    shortened = (text if len(text) <= _LONGEST_PROBLEM else f"{text[:_LONGEST_PROBLEM]}…" for text in problems)
    return (*islice(shortened, _MOST_PROBLEMS), *remainder)


def _sentence(problem: str) -> str:
    """The problem as a sentence, with capital letter and full stop; a key or name at its beginning keeps its case."""
    capital = problem[:1].upper() if problem.partition(" ")[0] in _PROSE else problem[:1]
    return capital + problem[1:].rstrip(".") + "."


def _explain_read_failure(path: Path, problem: OSError | UnicodeDecodeError) -> str:
    """Reason in words, without a full stop."""
    match problem:
        case FileNotFoundError():
            return f"There is no file {path}"
        case IsADirectoryError():
            return f"{path} is a folder"
        case PermissionError():
            return f"You have no right to read {path}"
        case UnicodeDecodeError():
            return f"It is neither HDF5 nor text in UTF-8 (byte {problem.start})"
        case RefusedFileError():
            return problem.words[:1].upper() + problem.words[1:]
    return f"The system says: {problem.strerror or problem}"


def _explain_write_failure(path: Path, problem: OSError) -> tuple[str, str]:
    """Reason in words, without a full stop, and advice."""
    match problem.errno:
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
    return f"The system says: {problem.strerror or problem}", "Choose another folder, or correct this and try again."
