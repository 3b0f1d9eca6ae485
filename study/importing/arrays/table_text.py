"""Decode the text of a table (CSV) whose character encoding the import map states, or detect it from the bytes.

UTF-8 and UTF-16 are recognised by their structure. Legacy encodings accept nearly every byte sequence, so that the
content decides: Windows-1252 if non-ASCII characters occur singly or in pairs within words, as in `µs`, `°` and
`Größe`; else the only encoding in which the text contains a known word for a quantity (`FOREIGN_WORDS`). If there is
none, or more than one, the error names the candidates.
"""

import codecs
import re
from dataclasses import dataclass
from pathlib import Path

from study.importing.map_format.signal_words import FOREIGN_WORDS
from study.regular_file import MAX_TABLE_BYTES, read_regular
from study.store.disk.file_errors import CannotReadError

_MAX_UTF16_SEARCH_BYTES = 4096
"""Number of bytes from the beginning searched for UTF-16 without a byte order mark, in which nearly every other byte of
a table is zero. Chosen."""
_MAX_DETECTION_BYTES = 65536
"""Approximate number of bytes, in non-ASCII lines, from which a legacy encoding is detected. Chosen."""
_LEGACY_ENCODINGS = ("gb18030", "shift_jis", "euc_jp", "euc_kr", "big5", "cp1251", "koi8_r", "cp1250", "cp1253")
"""Encodings, as Python names them, that are tried if a text is neither UTF-8, UTF-16 nor Windows-1252. If the bytes
decode to the same text in several of them, the first is used."""
_NON_ASCII_RUN = re.compile(r"[^\x00-\x7f]+")
"""A run of non-ASCII characters."""
_NON_ASCII_BYTE = re.compile(rb"[\x80-\xff]")
"""A byte of a non-ASCII character."""
_LINE_END = re.compile(rb"[\r\n]|\Z")
"""End of a line, or of the file."""
_MAX_SAMPLE_CHARACTERS = 24
"""Maximum number of characters in the sample of text that an error shows. Chosen."""


@dataclass(frozen=True, slots=True)
class TableText:
    """Decoded text of a table's file."""

    text: str
    note: str
    """A sentence for the user that names the encoding if it was detected from words; else empty."""


def read_text(path: Path, encoding: str) -> TableText:
    """Read the text of a table. encoding: Python's name of it, as stated by the map; empty = detect it. Raises
    CannotReadError if the file cannot be read; ValueError if the encoding is wrong, unknown or ambiguous (then with the
    map's key that would state it), or if the file has zero bytes but is no UTF-16 text."""
    try:
        data = read_regular(path, MAX_TABLE_BYTES)
    except OSError as error:
        raise CannotReadError(path, error) from error
    if encoding:
        return TableText(_decode(data, encoding), "")
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return TableText(_decode(data, "utf-16"), "")
    if b"\0" in data[:_MAX_UTF16_SEARCH_BYTES]:
        candidate_bytes = data[1:_MAX_UTF16_SEARCH_BYTES:2], data[:_MAX_UTF16_SEARCH_BYTES:2]
        for high_bytes, name in zip(candidate_bytes, ("utf-16-le", "utf-16-be"), strict=True):
            if 2 * high_bytes.count(0) > len(high_bytes):
                return TableText(_decode(data, name), "")
        raise ValueError("it holds bytes of zero, as no text does; is it a table?")
    try:
        return TableText(data.decode("utf-8-sig"), "")
    except UnicodeDecodeError:
        return _decode_legacy_encoding(data)


def _decode(data: bytes, encoding: str) -> str:
    """Decode strictly, without the byte order mark. Raises ValueError for an unknown encoding or bytes that are invalid
    in it."""
    try:
        return data.decode(encoding).removeprefix("\ufeff")
    except LookupError as error:
        raise ValueError(
            f"there is no encoding '{encoding}'; usual are utf-8, cp1252, {', '.join(_LEGACY_ENCODINGS)}"
        ) from error
    except UnicodeDecodeError as error:
        raise ValueError(f"it is no whole {encoding} text") from error


def _decode_legacy_encoding(data: bytes) -> TableText:
    """Detect a legacy encoding from the non-ASCII lines that are not comments (# or %), and decode all of `data`; as
    Windows-1252, undefined bytes become U+FFFD. Raises ValueError if no encoding fits, or more than one."""
    non_ascii = b"\n".join(_select_non_ascii_lines(data))
    if _is_western(non_ascii):
        return TableText(data.decode("cp1252", errors="replace"), "")
    decoded_texts = {
        encoding: text for encoding in _LEGACY_ENCODINGS if (text := _decode_or_empty(non_ascii, encoding))
    }
    recognised_texts = {
        encoding: text
        for encoding, text in decoded_texts.items()
        if any(word in text.lower() for word in FOREIGN_WORDS)
    }
    encoding_by_text = {text: encoding for encoding, text in reversed(recognised_texts.items())}
    if len(encoding_by_text) == 1:
        encoding = next(iter(encoding_by_text.values()))
        return TableText(
            _decode(data, encoding), f"Read in the encoding {encoding}, in which its words are understood."
        )
    samples = ", ".join(f"{name}: '{_make_sample(text)}'" for name, text in (recognised_texts or decoded_texts).items())
    raise ValueError(
        f"it is no UTF-8 text, and its encoding is ambiguous ({samples}); save it as UTF-8, or state the encoding in "
        f'the map: under [csv], encoding = "{next(iter(recognised_texts or decoded_texts), "cp1252")}"'
    )


def _select_non_ascii_lines(data: bytes) -> list[bytes]:
    """Select the first non-ASCII lines that are not comments, until they have `_MAX_DETECTION_BYTES` bytes together.
    Lines are complete: a cut within a multi-byte character would make the right encoding invalid."""
    lines, byte_count, line_end = list[bytes](), 0, 0
    while byte_count < _MAX_DETECTION_BYTES and (match := _NON_ASCII_BYTE.search(data, line_end)):
        position = match.start()
        line_start = max(data.rfind(b"\n", line_end, position), data.rfind(b"\r", line_end, position), line_end - 1) + 1
        end_match = _LINE_END.search(data, position)
        line_end = end_match.start() if end_match else len(data)
        line = data[line_start:line_end]
        if not line.lstrip().startswith((b"#", b"%")):
            lines.append(line)
            byte_count += len(line)
    return lines


def _is_western(data: bytes) -> bool:
    """Whether the bytes are plausible as Windows-1252: each run of non-ASCII characters is a single defined character,
    or two letters next to another letter. True without non-ASCII bytes."""
    text = data.decode("cp1252", errors="replace")
    for match in _NON_ASCII_RUN.finditer(text):
        neighbours = text[match.start() - 1 : match.start()] + text[match.end() : match.end() + 1]
        is_word = len(match[0]) == 2 and match[0].isalpha() and any(letter.isalpha() for letter in neighbours)
        if not is_word and (len(match[0]) > 1 or match[0] == "\ufffd"):
            return False
    return True


def _decode_or_empty(data: bytes, encoding: str) -> str:
    """Decode strictly; empty if the bytes are not valid in this encoding."""
    try:
        return data.decode(encoding)
    except UnicodeDecodeError:
        return ""


def _make_sample(text: str) -> str:
    """Make a sample of the text for an error: its first runs of non-ASCII characters, `_MAX_SAMPLE_CHARACTERS` at
    most."""
    return " ".join(_NON_ASCII_RUN.findall(text))[:_MAX_SAMPLE_CHARACTERS]
