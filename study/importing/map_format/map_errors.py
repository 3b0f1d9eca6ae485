"""Errors of an import: what is wrong, and what to do about it."""

import re
from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice

from analysis.wording import as_sentence
from study.errors import StudyError, WrongUseError

_LONGEST_WORD = 60
"""Most characters of a name that are compared and shown."""
_LONGEST_SENTENCE = 2000
"""Most characters of a message."""
_MOST_NAMES = 500
"""Most known names with which an unknown name is compared."""
_QUOTED = re.compile(rf"(?<!\w)'([^']{{{_LONGEST_WORD}}})[^']+'(?!\w)")
"""A quotation that is longer than a message may show."""

NOTHING_WRITTEN = "Nothing was written."
"""Statement of import errors on what was saved."""


class ImportProblemError(ValueError):
    """One problem of an import: a clause that names the key, channel, array or file. `ImportRefusedError` reports
    it."""


class ImportRefusedError(StudyError):
    """An import that failed. what: the files; problem: a clause; do_now: remedy, by default to correct the map."""

    def __init__(self, what: str, problem: str, do_now: str = "") -> None:
        super().__init__(
            title=f"{what} cannot be imported",
            happened=_sentence(problem),
            saved=NOTHING_WRITTEN,
            do_now=do_now or "Correct the map (docs/importing.md lists its keys) and import again.",
        )


class MapNeededError(WrongUseError):
    """An import without a map of a file whose arrays are not all understood. why: what is open; skeleton: a map for
    this file, to be completed."""

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
    """The problem as a sentence. Long quotations and long lists are shortened: a name in a damaged file may have a
    million letters."""
    short = _QUOTED.sub(r"'\1…'", problem)
    if len(short) > _LONGEST_SENTENCE:
        short = f"{short[:_LONGEST_SENTENCE].rpartition('; ')[0] or short[:_LONGEST_SENTENCE]}; and more"
    return as_sentence(short)


def suggestion(word: str, known: Iterable[str]) -> str:
    """The clause "; did you mean 'x'" with the known name x that is most similar; empty without a similar name."""
    names = list(islice(known, _MOST_NAMES))  # comparing a name of a million letters would take minutes
    close = (
        get_close_matches(word[:_LONGEST_WORD], names, n=1)
        or [name for name in names if name.lower() == word.lower()][:1]
    )
    return f"; did you mean '{close[0]}'" if close else ""
