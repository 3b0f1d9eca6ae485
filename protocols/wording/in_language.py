"""Inserts a language's table of texts into the values of a protocol, and checks such a table.

The texts become part of the protocol, and thereby of its hash and of every session log: what a participant read is
recorded.
"""

from collections.abc import Callable, Mapping
from typing import Any

from protocols.definition.problem import Problem
from protocols.wording.english import ENGLISH, LANGUAGES, placeholders
from protocols.wording.english_forms import PROTOCOLS

LONGEST = 4000
"""Largest length of a text, in characters."""


def find_language(values: Mapping[str, Any]) -> str:
    """Code of the language that unvalidated values of a protocol name; "en" without a valid one. Invalid values are
    refused by the validation of the protocol."""
    text = values.get("text")
    language = text.get("language", "en") if isinstance(text, dict) else "en"
    return language if isinstance(language, str) else "en"


def find_own_words(values: Mapping[str, Any]) -> dict[str, Any]:
    """Texts by key that a protocol itself contains; empty without a valid table."""
    text = values.get("text")
    words = text.get("words", {}) if isinstance(text, dict) else {}
    return dict(words) if isinstance(words, dict) else {}


def find_table_problems(table: Mapping[str, Any], require_all: bool) -> tuple[Problem, ...]:
    """Problems of a table of texts. require_all: every key is required, as for a language; False for a protocol's
    own texts."""
    problems = [problem for key, text in table.items() if (problem := _find_problem(key, text)) is not None]
    if require_all:
        problems += [Problem(key, "is missing", f'its translation of "{_shorten(ENGLISH[key])}"') for key in ENGLISH
                     if key not in table]  # fmt: skip
    return tuple(problems)


def translate_protocol(values: Mapping[str, Any], table: Mapping[str, str], name: str) -> dict[str, Any]:
    """The values of a protocol with all texts of a table; texts of the protocol itself have priority. Sentences of the
    shipped protocols (`PROTOCOLS`) are translated in place; a laboratory's own sentences are left unchanged. name: of
    the language."""
    sentences = {PROTOCOLS[key]: table[key] for key in PROTOCOLS if key in table}

    def translate(text: Any) -> Any:
        return sentences.get(text, text) if isinstance(text, str) else text

    resolved = {**values, "text": {"language": name, "words": {**table, **find_own_words(values)}}}
    resolved["title"] = translate(values.get("title"))
    for kind, key in (("consent", "statements"), ("consent", "exclusions"), ("setup", "grip")):
        if isinstance(values.get(kind), dict) and key in values[kind]:
            resolved[kind] = {**resolved[kind], key: _translate_each(values[kind][key], translate)}
    for kind in ("before", "debrief"):
        if isinstance(values.get(kind), list):
            resolved[kind] = [_translate_question(question, translate) for question in values[kind]]
    return {key: value for key, value in resolved.items() if value is not None}


def _translate_question(question: Any, translate: Callable[[Any], Any]) -> Any:
    """The question with its texts translated. Choices keep the texts of the protocol as their codes, so that the same
    answer is logged in every language."""
    if not isinstance(question, dict):
        return question
    translated = {key: _translate_each(value, translate) if key in ("question", "choices", "ends") else value
             for key, value in question.items()}  # fmt: skip
    if question.get("choices") and not question.get("codes") and translated["choices"] != question["choices"]:
        translated["codes"] = question["choices"]
    return translated


def _translate_each(value: Any, translate: Callable[[Any], Any]) -> Any:
    """Translate a value, or each entry of a list."""
    return [translate(entry) for entry in value] if isinstance(value, list) else translate(value)


def _find_problem(key: str, text: Any) -> Problem | None:
    """Problem of one text: unknown key, not a text of allowed length, or other placeholders than the English text."""
    if key not in ENGLISH:
        return Problem(key, "is no text of hapteq", "the keys that `hapteq protocol texts` lists")
    if not isinstance(text, str) or not text.strip() or len(text) > LONGEST:
        return Problem(key, "is no text", f"text in quotes, up to {LONGEST} characters")
    expected, used = placeholders(ENGLISH[key]) or frozenset(), placeholders(text)
    if used != expected:
        words = " ".join(f"{{{name}}}" for name in sorted(expected)) or "no braces"
        actual_text = (
            "braces that are not in pairs" if used is None else " ".join(f"{{{name}}}" for name in sorted(used))
        )
        return Problem(
            key, f"has {actual_text or 'no braces'}", f"each of {words}, and no other" if expected else words
        )
    return None


def _shorten(text: str) -> str:
    """A text on a single line of at most 60 characters."""
    line = " ".join(text.split())
    return line if len(line) <= 60 else f"{line[:59]}…"


def list_languages() -> str:
    """Codes and names of the supplied languages, for a message."""
    return ", ".join(f'"{code}" ({name})' for code, name in LANGUAGES.items())
