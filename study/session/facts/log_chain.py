"""Hash chain of a session's log: each line contains a checksum over its event and all lines before it.

The checksum of line n is the first 128 bits of SHA-256(checksum of line n - 1, line feed, bytes of the event). A line
without checksum (of an older version) enters the hash, too, so that when such a log is continued, the first checksum
covers all lines before it. There is no key: the chain detects damage, and edits without recomputed checksums; it does
not prove who wrote a log.
"""

import hashlib
from dataclasses import dataclass

CHECKSUM_DIGITS = 32
"""Length of a checksum in hexadecimal digits: the first 128 bits of SHA-256."""
INITIAL_CHECKSUM = "0" * CHECKSUM_DIGITS
"""Checksum before the first line."""

_FIELD_START, _FIELD_END = b',"chain":"', b'"}'
"""Bytes around the checksum at the end of a line; the second closes the JSON object."""
_FIELD_BYTES = len(_FIELD_START) + CHECKSUM_DIGITS + len(_FIELD_END)
"""Length of the field with the checksum, at the end of a line, in bytes."""
_HEXADECIMAL_DIGITS = frozenset(b"0123456789abcdef")
"""Bytes that a checksum may contain."""


@dataclass(frozen=True, slots=True)
class Chain:
    """State of the hash chain after the lines that were read or written."""

    head: str = INITIAL_CHECKSUM
    """Checksum of the last line."""
    lines: int = 0
    """Number of lines."""
    first_checksum_line: int = 0
    """Number of the first line with a checksum, from 1; 0 if there is none."""

    def describe(self) -> str:
        """Describe in words which lines of the log have checksums; "without checksums" also for a log without lines."""
        if not self.first_checksum_line:
            return "without checksums (an older version wrote it)"
        return (
            "with checksums"
            if self.first_checksum_line == 1
            else f"with checksums from line {self.first_checksum_line} on"
        )


class ChainBrokenError(ValueError):
    """A line does not match its checksum, or has none although an earlier line has. The message is a predicate, whose
    subject is the line."""


def append_checksum(chain: Chain, event: bytes) -> tuple[Chain, bytes]:
    """Append a checksum to an event (a JSON object, not empty, without a line end). Returns the extended chain, and the
    line with checksum and line end."""
    extended_chain = _extend_chain(chain, event, has_checksum=True)
    return extended_chain, event[:-1] + _FIELD_START + extended_chain.head.encode() + _FIELD_END + b"\n"


def verify_checksum(chain: Chain, line: bytes) -> tuple[Chain, bytes]:
    """Verify the checksum of a line (without its line end). Returns the extended chain, and the event without the
    checksum. Raises ChainBrokenError where the checksum is wrong, or missing although an earlier line has one."""
    event, head = _split_checksum(line)
    extended_chain = _extend_chain(chain, event, has_checksum=head is not None)
    if head is None and chain.first_checksum_line:
        raise ChainBrokenError("has no checksum, although lines before it have")
    if head is not None and head != extended_chain.head:
        raise ChainBrokenError("does not match its checksum")
    return extended_chain, event


def _extend_chain(chain: Chain, event: bytes, has_checksum: bool) -> Chain:
    """Extend the chain by one event. has_checksum: whether its line has a checksum."""
    line_count = chain.lines + 1
    head = hashlib.sha256(chain.head.encode() + b"\n" + event).hexdigest()[:CHECKSUM_DIGITS]
    return Chain(head, line_count, chain.first_checksum_line or (line_count if has_checksum else 0))


def _split_checksum(line: bytes) -> tuple[bytes, str | None]:
    """Split a line into the event and its checksum; None where the line does not end in a checksum field. The bytes are
    split unparsed, so that the event keeps exactly the bytes that were hashed."""
    checksum = line[-len(_FIELD_END) - CHECKSUM_DIGITS : -len(_FIELD_END)]
    has_field = line[-_FIELD_BYTES:].startswith(_FIELD_START) and line.endswith(_FIELD_END)
    if not has_field or len(line) <= _FIELD_BYTES or not _HEXADECIMAL_DIGITS.issuperset(checksum):
        return line, None
    return line[:-_FIELD_BYTES] + b"}", checksum.decode()
