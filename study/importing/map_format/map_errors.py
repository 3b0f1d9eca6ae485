"""Errors of an import: what is wrong, and what to do about it."""

import re
from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice

from analysis.wording import format_sentence
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
    """An import that failed. subject: the files; problem: a clause; remedy: remedy, by default to correct the map."""

    def __init__(self, subject: str, problem: str, remedy: str = "") -> None:
        super().__init__(
            title=f"{subject} cannot be imported",
            happened=_sentence(problem),
            saved=NOTHING_WRITTEN,
            do_now=remedy or "Correct the map (docs/importing.md lists its keys) and import again.",
        )


class MapNeededError(WrongUseError):
    """An import without a map of a file whose arrays are not all understood. reason: what is open; skeleton: a map for
    this file, to be completed."""

    def __init__(self, file: str, reason: str, skeleton: str) -> None:
        super().__init__(
            title=f"{file} needs a map",
            happened=_sentence(reason),
            saved=NOTHING_WRITTEN,
            do_now="A map for this file follows on the standard output: keep it as MAP.toml, complete it, and import "
            "again with --map MAP.toml.",
        )
        self.skeleton = skeleton


def _sentence(problem: str) -> str:
    """The problem as a sentence. Long quotations and long lists are shortened: a name in a damaged file may have a
    million letters."""
    text = _QUOTED.sub(r"'\1…'", problem)
    if len(text) > _LONGEST_SENTENCE:
        text = f"{text[:_LONGEST_SENTENCE].rpartition('; ')[0] or text[:_LONGEST_SENTENCE]}; and more"
    return format_sentence(text)


def suggestion(word: str, known_names: Iterable[str]) -> str:
    """The clause "; did you mean 'x'" with the known name x that is most similar; empty without a similar name."""
    names = list(islice(known_names, _MOST_NAMES))  # comparing a name of a million letters would take minutes
    matches = (
        get_close_matches(word[:_LONGEST_WORD], names, n=1)
        or [name for name in names if name.lower() == word.lower()][:1]
    )
    return f"; did you mean '{matches[0]}'" if matches else ""
