"""Errors of an import, with advice."""

import re
from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice

from analysis.wording import as_sentence
from study.errors import StudyError, WrongUseError

_LONGEST_WORD = 60
"""Characters of a name that are compared and shown."""
_LONGEST_SENTENCE = 2000
"""Characters of a message."""
_MOST_NAMES = 500
"""Known names with which an unknown one is compared."""
_QUOTED = re.compile(rf"(?<!\w)'([^']{{{_LONGEST_WORD}}})[^']+'(?!\w)")
"""A quotation longer than a message shows."""

NOTHING_WRITTEN = "Nothing was written."


class ImportProblemError(ValueError):
    """One problem: a sentence fragment that names the key, channel, array or file."""


class ImportRefusedError(StudyError):
    """An import that failed."""

    def __init__(self, what: str, problem: str, do_now: str = "") -> None:
        super().__init__(
            title=f"{what} cannot be imported",
            happened=_sentence(problem),
            saved=NOTHING_WRITTEN,
            do_now=do_now or "Correct the map (docs/importing.md lists its keys) and import again.",
        )


class MapNeededError(WrongUseError):
    """The meaning of the arrays is not known. `skeleton`: a map for this file, to be completed."""

    def __init__(self, file: str, why: str, skeleton: str) -> None:
        super().__init__(
            title=f"{file} needs a map",
            happened=_sentence(why),
            saved=NOTHING_WRITTEN,
            do_now="A map for this file follows on the standard output: keep it as MAP.toml, complete it, and import "
            "again with --map MAP.toml.",
        )
        self.skeleton = skeleton


def _sentence(problem: str) -> str:
    """Shorten names and fields: those of a damaged file may have a million letters."""
    short = _QUOTED.sub(r"'\1…'", problem)
    if len(short) > _LONGEST_SENTENCE:
        short = f"{short[:_LONGEST_SENTENCE].rpartition('; ')[0] or short[:_LONGEST_SENTENCE]}; and more"
    return as_sentence(short)


def suggestion(word: str, known: Iterable[str]) -> str:
    """ "; did you mean 'x'" for a similar name; else empty."""
    names = list(islice(known, _MOST_NAMES))  # for a name of a million letters it would take minutes
    close = (
        get_close_matches(word[:_LONGEST_WORD], names, n=1)
        or [name for name in names if name.lower() == word.lower()][:1]
    )
    return f"; did you mean '{close[0]}'" if close else ""
