"""Errors of an import, with cause and remedy; raised throughout `study.importing`."""

import re
from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice

from analysis.wording import format_sentence
from study.errors import StudyError, WrongUseError

_MAX_WORD_LENGTH = 60
"""Largest number of characters of a name that are compared and shown: a damaged file may have a name of a million
letters, whose comparison would take minutes. Chosen."""
_MAX_SENTENCE_LENGTH = 2000
"""Approximate largest number of characters of a message. Chosen."""
_MAX_NAMES = 500
"""Largest number of known names with which an unknown name is compared. Chosen."""
_LONG_QUOTATION = re.compile(rf"(?<!\w)'([^']{{{_MAX_WORD_LENGTH}}})[^']+'(?!\w)")
"""A quotation that is longer than a message may show."""

NOTHING_WRITTEN = "Nothing was written."
"""Sentence on the saved files in every import error."""


class ImportProblemError(ValueError):
    """One problem of an import: a clause that names the key, channel, array or file. `ImportRefusedError` reports
    it."""


class ImportRefusedError(StudyError):
    """An import that failed. subject: the files, for the title; problem: what is wrong, a clause; remedy: what to do, a
    sentence, by default to correct the map."""

    def __init__(self, subject: str, problem: str, remedy: str = "") -> None:
        super().__init__(
            title=f"{subject} cannot be imported",
            happened=_format_problem(problem),
            saved=NOTHING_WRITTEN,
            do_now=remedy or "Correct the map (docs/importing.md lists its keys) and import again.",
        )


class MapNeededError(WrongUseError):
    """An import without a map of a file whose arrays are not all understood. file: its name; reason: what is not
    understood, a clause; skeleton: text of a map for this file, to be completed."""

    def __init__(self, file: str, reason: str, skeleton: str) -> None:
        super().__init__(
            title=f"{file} needs a map",
            happened=_format_problem(reason),
            saved=NOTHING_WRITTEN,
            do_now="A map for this file follows on the standard output: keep it as MAP.toml, complete it, and import "
            "again with --map MAP.toml.",
        )
        self.skeleton = skeleton


def _format_problem(problem: str) -> str:
    """Format a problem as a sentence. Long quotations and long lists are shortened."""
    text = _LONG_QUOTATION.sub(r"'\1…'", problem)
    if len(text) > _MAX_SENTENCE_LENGTH:
        text = f"{text[:_MAX_SENTENCE_LENGTH].rpartition('; ')[0] or text[:_MAX_SENTENCE_LENGTH]}; and more"
    return format_sentence(text)


def suggest_name(word: str, known_names: Iterable[str]) -> str:
    """Make the clause "; did you mean 'x'" with the most similar of the first `_MAX_NAMES` names; empty without one."""
    compared_names = list(islice(known_names, _MAX_NAMES))
    matches = (
        get_close_matches(word[:_MAX_WORD_LENGTH], compared_names, n=1)
        or [name for name in compared_names if name.lower() == word.lower()][:1]
    )
    return f"; did you mean '{matches[0]}'" if matches else ""
