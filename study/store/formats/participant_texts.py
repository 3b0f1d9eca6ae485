"""Read and print tables of the texts that participants see: one TOML file per language, with a text for every key of
`ENGLISH`.

A protocol selects a shipped language by its code ("de"), or a laboratory's own table by the path of a file. Texts other
than the English ones are copied into the protocol, so that its hash and the logs depend on them.
"""

import json
import tomllib
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from protocols.definition.new_use import find_new_use_problems
from protocols.definition.problem import Problem
from protocols.document.dumping import dump_protocol
from protocols.document.loading import Protocol, ProtocolError, load_protocol, protocol_from_values
from protocols.wording.english import ENGLISH, LANGUAGES
from protocols.wording.translation import (
    find_language,
    find_stated_texts,
    find_table_problems,
    list_languages,
    translate_protocol,
)
from study.errors import WrongUseError
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.text_file import read_toml_text

KIND = "table of texts"
"""Name of such a file in messages."""


def read_language(
    language: str, folder: Path | None = None, locked_words: Mapping[str, str] = MappingProxyType({})
) -> tuple[str, dict[str, str]]:
    """Read a language's name (code, or name of the file without suffix), and its texts by key. language: a code such as
    "de", or the path of a .toml file, relative to folder (None: the current one). locked_words: texts of the protocol's
    lock, empty without one; they replace those of a shipped language, which a version of the program may have changed,
    and their keys are those that are taken from a file. Raises WrongUseError (neither of these), CannotReadError, and
    UnusableFileError (not TOML, or texts that are missing or wrong)."""
    if language == "en":
        return language, dict(ENGLISH)
    if language in LANGUAGES and locked_words:
        return language, dict(locked_words)
    if language in LANGUAGES:
        shipped = files("protocols").joinpath("wording", f"{language}.toml")
        return language, tomllib.loads(shipped.read_text("utf-8"))
    path = (folder or Path()) / language
    if not language.endswith(".toml"):
        raise WrongUseError(
            "There is no such language",
            f"'{language}' is neither a shipped language nor a .toml file.",
            f"Use one of {list_languages()}, or the path of a file; `hapteq protocol texts` prints one to translate.",
        )
    text = read_toml_text(path, KIND)
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise UnusableFileError(path, KIND, (f"it is not TOML: {error}",)) from error
    if locked_words:  # the lock's hash decides whether they are those that were locked
        return path.stem, {key: table[key] for key in locked_words if key in table}
    if problems := find_table_problems(table, require_all=True):
        raise UnusableFileError(path, KIND, tuple(map(str, problems)))
    return path.stem, table


def load_in_language(
    text: str, source: str, folder: Path | None, locked_words: Mapping[str, str] = MappingProxyType({})
) -> tuple[Protocol, str]:
    """Load a protocol file and fill in the participants' texts of its language. Returns the protocol and its TOML text:
    `text` itself where no texts had to be filled in.

    text: content of the protocol file; source: its name for messages; folder: that of the file, None for a shipped
    protocol; locked_words: as of `read_language`. Raises ProtocolError (invalid protocol, refused for new use, unknown
    language or text), CannotReadError, UnusableFileError.
    """
    protocol, protocol_text = _fill_in_texts(text, source, folder, locked_words)
    if problems := find_new_use_problems(protocol):
        raise ProtocolError(source, problems)
    return protocol, protocol_text


def _fill_in_texts(
    text: str, source: str, folder: Path | None, locked_words: Mapping[str, str]
) -> tuple[Protocol, str]:
    """Load a protocol with the texts of its language. Arguments, result and errors as of `load_in_language`."""
    try:
        values = tomllib.loads(text)
    except (ValueError, RecursionError):
        return load_protocol(text, source), text  # raises ProtocolError with the cause
    language, stated_texts = find_language(values), find_stated_texts(values)
    if problems := find_table_problems(stated_texts, require_all=False):
        raise ProtocolError(source, tuple(problem.prefix_key("text.words") for problem in problems))
    if language == "en" or stated_texts.keys() >= (locked_words or ENGLISH).keys():
        return load_protocol(text, source), text
    try:
        language_name, table = read_language(language, folder, locked_words)
    except WrongUseError as error:
        allowed_text = f"{list_languages()}, or the path of a .toml file"
        raise ProtocolError(source, (Problem("text.language", f'is "{language}"', allowed_text),)) from error
    if not locked_words and (problems := find_table_problems({**table, **stated_texts}, require_all=False)):
        raise ProtocolError(source, tuple(problem.prefix_key("text.words") for problem in problems))
    protocol = protocol_from_values(translate_protocol(values, table, language_name), source)
    return protocol, dump_protocol(protocol)


def make_language_template(language: str) -> str:
    """Make a language's table as TOML text, as a template for a translation. A comment above each text that differs
    from the English one states the English text. Raises as `read_language`."""
    name, table = read_language(language)
    lines = [f"# Participants' texts of hapteq, {LANGUAGES.get(name, name)}. What stands in braces is filled in."]
    for key, english_text in ENGLISH.items():
        if table[key] != english_text:
            lines.append("# " + " ".join(english_text.split()))
        lines.append(f"{key} = {json.dumps(table[key], ensure_ascii=False)}")
    return "\n".join(lines) + "\n"
