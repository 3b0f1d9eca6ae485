"""Insertion of a language's texts into the values of a protocol, and validation of a table of such texts.

The texts become part of the protocol, and thereby of its hash and of every session log: what a participant read is
recorded.
"""

from collections.abc import Callable, Mapping
from typing import Any

from protocols.definition.problem import Problem
from protocols.wording.english import ENGLISH, LANGUAGES, list_placeholders
from protocols.wording.english_forms import PROTOCOL_TEXTS

MAX_TEXT_LENGTH = 4000
"""Largest accepted length of a text, in characters. Chosen: more than six times the longest English text (607)."""


def find_language(values: Mapping[str, Any]) -> str:
    """Find the language that unvalidated values of a protocol state: a code such as "de", or the path of a table; "en"
    where none is stated. An invalid value gives "en", too: the validation of the protocol refuses it later."""
    text_table = values.get("text")
    language = text_table.get("language", "en") if isinstance(text_table, dict) else "en"
    return language if isinstance(language, str) else "en"


def find_stated_texts(values: Mapping[str, Any]) -> dict[str, Any]:
    """Find the texts by key that unvalidated values of a protocol state in `text.words`; empty without a valid
    table."""
    text_table = values.get("text")
    stated_texts = text_table.get("words", {}) if isinstance(text_table, dict) else {}
    return dict(stated_texts) if isinstance(stated_texts, dict) else {}


def find_table_problems(table: Mapping[str, Any], require_all: bool) -> tuple[Problem, ...]:
    """Find the problems of a table of texts by key. require_all: whether every key is required, as for a language;
    False for the texts that a protocol contains."""
    problems = [problem for key, text in table.items() if (problem := _find_text_problem(key, text)) is not None]
    if require_all:
        problems += [Problem(key, "is missing", f'its translation of "{_shorten(ENGLISH[key])}"') for key in ENGLISH
                     if key not in table]  # fmt: skip
    yes, no = (str({**ENGLISH, **table}[key]).strip().casefold() for key in ("yes", "no"))
    if yes == no:  # a refusal would be logged as a consent
        problems.append(Problem("no", "is the text of yes", "two different texts"))
    return tuple(problems)


def translate_protocol(values: Mapping[str, Any], table: Mapping[str, str], language: str) -> dict[str, Any]:
    """Insert all texts of a table into the values of a protocol; texts that the protocol states itself have priority.
    Sentences of the shipped protocols (`PROTOCOL_TEXTS`) are replaced by their translation, other sentences stay;
    top-level keys whose value is None are left out. language: its name, as returned by
    `participant_texts.read_language`."""
    translation_by_sentence = {PROTOCOL_TEXTS[key]: table[key] for key in PROTOCOL_TEXTS if key in table}

    def translate(text: Any) -> Any:
        """Replace a sentence of the shipped protocols by its translation; return any other value unchanged."""
        return translation_by_sentence.get(text, text) if isinstance(text, str) else text

    translated_values = {**values, "text": {"language": language, "words": {**table, **find_stated_texts(values)}}}
    translated_values["title"] = translate(values.get("title"))
    for table_key, key in (("consent", "statements"), ("consent", "exclusions"), ("setup", "grip")):
        if isinstance(values.get(table_key), dict) and key in values[table_key]:
            translated_values[table_key] = {
                **translated_values[table_key],
                key: _translate_each(values[table_key][key], translate),
            }
    for table_key in ("before", "debrief"):
        if isinstance(values.get(table_key), list):
            translated_values[table_key] = [_translate_question(question, translate) for question in values[table_key]]
    return {key: value for key, value in translated_values.items() if value is not None}


def _translate_question(question: Any, translate: Callable[[Any], Any]) -> Any:
    """Translate the texts of a question. Translated choices get the texts of the protocol as their codes, so that the
    same answer is logged in every language. A value that is no table is returned unchanged."""
    if not isinstance(question, dict):
        return question
    translated_question = {key: _translate_each(value, translate) if key in ("question", "choices", "ends") else value
             for key, value in question.items()}  # fmt: skip
    if question.get("choices") and not question.get("codes") and translated_question["choices"] != question["choices"]:
        translated_question["codes"] = question["choices"]
    return translated_question


def _translate_each(value: Any, translate: Callable[[Any], Any]) -> Any:
    """Translate a text, or each text of a list; other values are returned unchanged."""
    return [translate(entry) for entry in value] if isinstance(value, list) else translate(value)


def _find_text_problem(key: str, text: Any) -> Problem | None:
    """Find the problem of one text: an unknown key, no text of an allowed length, or other placeholders than the
    English text; None without a problem."""
    if key not in ENGLISH:
        return Problem(key, "is no text of hapteq", "the keys that `hapteq protocol texts` lists")
    if not isinstance(text, str) or not text.strip() or len(text) > MAX_TEXT_LENGTH:
        return Problem(key, "is no text", f"text in quotes, up to {MAX_TEXT_LENGTH} characters")
    expected_names, used_names = list_placeholders(ENGLISH[key]) or frozenset(), list_placeholders(text)
    if used_names != expected_names:
        expected_text = " ".join(f"{{{name}}}" for name in sorted(expected_names)) or "no braces"
        actual_text = (
            "braces that are not in pairs or hold no plain name"
            if used_names is None
            else " ".join(f"{{{name}}}" for name in sorted(used_names))
        )
        return Problem(
            key,
            f"has {actual_text or 'no braces'}",
            f"each of {expected_text}, and no other" if expected_names else expected_text,
        )
    return None


def _shorten(text: str) -> str:
    """Shorten a text to a single line of at most 60 characters."""
    line = " ".join(text.split())
    return line if len(line) <= 60 else f"{line[:59]}…"


def list_languages() -> str:
    """List codes and names of the supplied languages, for a message."""
    return ", ".join(f'"{code}" ({name})' for code, name in LANGUAGES.items())
