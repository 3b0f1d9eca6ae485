"""Reads the text of a table in its character encoding, which is stated by the import map or detected from the bytes.

UTF-8 and UTF-16 are recognised by their structure. Legacy encodings accept nearly every byte sequence, so the content
decides: Windows-1252 where non-ASCII characters occur singly or in pairs within words, as in `µs`, `°` and `Größe`;
else the only encoding in which the text contains a known word for a quantity. If that is none or several, the error
names the candidates.
"""

import codecs
import re
from dataclasses import dataclass
from pathlib import Path

from study.importing.map_format.signal_words import FOREIGN_WORDS
from study.regular_file import TABLE_BYTES, read_regular
from study.store.disk.file_errors import CannotReadError

_SEARCHED_BYTES = 4096
"""Bytes searched for UTF-16 without a byte order mark, in which nearly every other byte of a table is zero."""
_READ_FOR_WORDS = 65536
"""Bytes of non-ASCII lines from which a legacy encoding is detected."""
_ENCODINGS = ("gb18030", "shift_jis", "euc_jp", "euc_kr", "big5", "cp1251", "koi8_r", "cp1250", "cp1253")
"""Encodings that are tried where a text is neither UTF-8 nor Western European."""
_BEYOND_ASCII = re.compile(r"[^\x00-\x7f]+")
"""A run of non-ASCII characters."""
_BYTE_BEYOND_ASCII = re.compile(rb"[\x80-\xff]")
_LINE_END = re.compile(rb"[\r\n]|\Z")
_MAX_SAMPLE = 24
"""Maximum number of characters in the sample of text that an error shows."""


@dataclass(frozen=True, slots=True)
class TableText:
    """Decoded text of a table's file."""

    text: str
    note: str
    """A sentence for the user where the encoding was detected from words; else empty."""


def read_text(path: Path, encoding: str) -> TableText:
    """Read the text of a table. encoding: as stated by the map; empty to detect it. Raises CannotReadError, and
    ValueError where the encoding is wrong, unknown or ambiguous (then with the key of the map that states it)."""
    try:
        data = read_regular(path, TABLE_BYTES)
    except OSError as problem:
        raise CannotReadError(path, problem) from problem
    if encoding:
        return TableText(_decode(data, encoding), "")
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return TableText(_decode(data, "utf-16"), "")
    if b"\0" in data[:_SEARCHED_BYTES]:
        high_bytes = data[1:_SEARCHED_BYTES:2], data[:_SEARCHED_BYTES:2]
        for zeros, name in zip(high_bytes, ("utf-16-le", "utf-16-be"), strict=True):
            if 2 * zeros.count(0) > len(zeros):
                return TableText(_decode(data, name), "")
        raise ValueError("it holds bytes of zero, as no text does; is it a table?")
    try:
        return TableText(data.decode("utf-8-sig"), "")
    except UnicodeDecodeError:
        return _decode_other_encoding(data)


def _decode(data: bytes, encoding: str) -> str:
    """Decode strictly. Raises ValueError for an unknown encoding or bytes that are invalid in it."""
    try:
        return data.decode(encoding)
    except LookupError as problem:
        raise ValueError(f"there is no encoding '{encoding}'; usual are utf-8, cp1252, {', '.join(_ENCODINGS)}") from (
            problem
        )
    except UnicodeDecodeError as problem:
        raise ValueError(f"it is no whole {encoding} text") from problem


def _decode_other_encoding(data: bytes) -> TableText:
    """Detect a legacy encoding from the non-ASCII lines that are not comments (# or %), and decode. Raises ValueError
    where no encoding, or more than one, fits."""
    non_ascii = b"\n".join(_find_lines_beyond_ascii(data))
    if _is_western(non_ascii):
        return TableText(data.decode("cp1252", errors="replace"), "")
    readings = {encoding: text for encoding in _ENCODINGS if (text := _readable(non_ascii, encoding))}
    recognised = {
        encoding: text for encoding, text in readings.items() if any(word in text.lower() for word in FOREIGN_WORDS)
    }
    distinct = {text: encoding for encoding, text in reversed(recognised.items())}
    if len(distinct) == 1:
        encoding = next(iter(distinct.values()))
        return TableText(
            _decode(data, encoding), f"Read in the encoding {encoding}, in which its words are understood."
        )
    samples = ", ".join(f"{name}: '{_beyond_ascii(text)}'" for name, text in (recognised or readings).items())
    raise ValueError(
        f"it is no UTF-8 text, and its encoding is ambiguous ({samples}); save it as UTF-8, or state the encoding in "
        f'the map: under [csv], encoding = "{next(iter(recognised or readings), "cp1252")}"'
    )


def _find_lines_beyond_ascii(data: bytes) -> list[bytes]:
    """The first non-ASCII lines that are not comments, up to about `_READ_FOR_WORDS` bytes. Lines are
    kept whole: a cut within a character would make the right encoding invalid."""
    lines, size, line_end = list[bytes](), 0, 0
    while size < _READ_FOR_WORDS and (match := _BYTE_BEYOND_ASCII.search(data, line_end)):
        position = match.start()
        line_start = max(data.rfind(b"\n", line_end, position), data.rfind(b"\r", line_end, position), line_end - 1) + 1
        end = _LINE_END.search(data, position)
        line_end = end.start() if end else len(data)
        line = data[line_start:line_end]
        if not line.lstrip().startswith((b"#", b"%")):
            lines.append(line)
            size += len(line)
    return lines


def _is_western(data: bytes) -> bool:
    """Whether the text is plausible as Windows-1252: single non-ASCII characters, or two letters within a word."""
    text = data.decode("cp1252", errors="replace")
    for match in _BEYOND_ASCII.finditer(text):
        neighbours = text[match.start() - 1 : match.start()] + text[match.end() : match.end() + 1]
        is_word = len(match[0]) == 2 and match[0].isalpha() and any(letter.isalpha() for letter in neighbours)
        if not is_word and (len(match[0]) > 1 or match[0] == "\ufffd"):
            return False
    return True


def _readable(data: bytes, encoding: str) -> str:
    """The decoded text; empty where the bytes are not valid in this encoding."""
    try:
        return data.decode(encoding)
    except UnicodeDecodeError:
        return ""


def _beyond_ascii(text: str) -> str:
    """Sample of the text for an error: its non-ASCII characters."""
    return " ".join(_BEYOND_ASCII.findall(text))[:_MAX_SAMPLE]
