"""Hash chain of a log: each line carries a checksum of its own bytes and of all lines before it.

The checksum of line n is the first 128 bits of SHA-256(checksum of line n - 1, line feed, bytes of the event). A line
without checksum (of an older version) enters the hash, too, so that when such a log is continued, the first checksum
covers all lines before it. There is no key: the chain detects damage, and edits without recomputed checksums; it does
not prove who wrote a log.
"""

import hashlib
from dataclasses import dataclass

DIGITS = 32
"""Length of a checksum in hexadecimal digits: the first 128 bits of SHA-256."""
SEED = "0" * DIGITS
"""Checksum before the first line."""

_FIELD, _END = b',"chain":"', b'"}'
_LENGTH = len(_FIELD) + DIGITS + len(_END)
"""Length in bytes of the field with the checksum, at the end of a line."""
_HEXADECIMAL = frozenset(b"0123456789abcdef")
"""Bytes that a checksum may contain."""


@dataclass(frozen=True, slots=True)
class Chain:
    """State of the chain after the lines read or written so far."""

    head: str = SEED
    """Checksum of the last line."""
    lines: int = 0
    since: int = 0
    """Number of the first line with a checksum, from 1; 0 if there is none."""

    def in_words(self) -> str:
        """How much of the log has checksums, in words."""
        if not self.since:
            return "without checksums (an older version wrote it)"
        return "with checksums" if self.since == 1 else f"with checksums from line {self.since} on"


class ChainBrokenError(ValueError):
    """A line does not match its checksum, or lacks one."""


def write_chained(chain: Chain, event: bytes) -> tuple[Chain, bytes]:
    """Append an event (a JSON object without a line end). Returns the line with its checksum, line end included."""
    extended = _extend_chain(chain, event, has_checksum=True)
    return extended, event[:-1] + _FIELD + extended.head.encode() + _END + b"\n"


def read_chained(chain: Chain, line: bytes) -> tuple[Chain, bytes]:
    """Check a line without its end. Returns the chain and the event's own bytes. Raises ChainBrokenError."""
    event, head = _split_checksum(line)
    extended = _extend_chain(chain, event, has_checksum=head is not None)
    if head is None and chain.since:
        raise ChainBrokenError("has no checksum, although lines before it have")
    if head is not None and head != extended.head:
        raise ChainBrokenError("does not match its checksum")
    return extended, event


def _extend_chain(chain: Chain, event: bytes, has_checksum: bool) -> Chain:
    """The chain after one more event. has_checksum: whether its line has a checksum."""
    lines = chain.lines + 1
    head = hashlib.sha256(chain.head.encode() + b"\n" + event).hexdigest()[:DIGITS]
    return Chain(head, lines, chain.since or (lines if has_checksum else 0))


def _split_checksum(line: bytes) -> tuple[bytes, str | None]:
    """Bytes of the event, and its checksum or None. The raw bytes are split, so that nothing is parsed and written
    again."""
    digits = line[-len(_END) - DIGITS : -len(_END)]
    ends_so = line[-_LENGTH:].startswith(_FIELD) and line.endswith(_END)
    if not ends_so or len(line) <= _LENGTH or not _HEXADECIMAL.issuperset(digits):
        return line, None
    return line[:-_LENGTH] + b"}", digits.decode()
