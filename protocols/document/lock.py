"""Lock of a protocol: its hash, stored before data are collected, and the check that the protocol is still the same.

With a lock, a change of the settings after the start of data collection is detected. A lock is a JSON document.
"""

import json
from dataclasses import dataclass
from typing import Any

from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.study_protocol import StudyProtocol
from protocols.document.hashing import protocol_hash

FORMAT = "hapteq-protocol-lock"
"""Value of the key `format`, by which a lock is recognised."""
VERSION = 1
"""Version of the lock's format."""


class LockError(ValueError):
    """A lock that cannot be read, or a protocol that is no longer the locked one."""


@dataclass(frozen=True, slots=True)
class ProtocolLock:
    """Name and hash of a protocol at the time when it was locked."""

    name: str
    hash: str
    """Hash of all settings (`protocols.document.hashing.protocol_hash`)."""
    locked_utc: str
    """Time of the lock, UTC, ISO 8601."""
    hapteq: str
    """Version of hapteq that locked it."""


def make_lock(protocol: StudyProtocol | RecordingProtocol, locked_utc: str, hapteq: str) -> ProtocolLock:
    """The lock of a protocol. locked_utc: ISO 8601; hapteq: version of the program."""
    return ProtocolLock(protocol.name, protocol_hash(protocol), locked_utc, hapteq)


def check_lock(lock: ProtocolLock, protocol: StudyProtocol | RecordingProtocol, locked: str) -> None:
    """Raise LockError unless `protocol` equals, value by value, the one that was locked.

    locked: time of the lock in words, for the message.
    """
    if protocol.name != lock.name:
        raise LockError(
            f"the lock is that of protocol {lock.name}, not of {protocol.name}; give the lock of this protocol"
        )
    current_hash = protocol_hash(protocol)
    if current_hash != lock.hash:
        raise LockError(
            f"protocol {lock.name} was locked on {locked} and has changed since: "
            f"its fingerprint is {current_hash[:12]}…, the locked one {lock.hash[:12]}…"
        )


def lock_to_json(lock: ProtocolLock) -> str:
    """JSON text of a lock."""
    document = {
        "format": FORMAT,
        "version": VERSION,
        "name": lock.name,
        "hash": lock.hash,
        "locked_utc": lock.locked_utc,
        "hapteq": lock.hapteq,
    }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def lock_from_json(text: str) -> ProtocolLock:
    """Parse a lock from JSON. Raises LockError for a document that is no lock of this version; its message says why."""
    try:
        document: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise LockError(f"a lock is a JSON document, but this is none: {error}") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise LockError(f'a lock contains "format": "{FORMAT}", and this document does not')
    if document.get("version") != VERSION:
        raise LockError(f"the lock is of version {document.get('version')}, and this hapteq reads version {VERSION}")
    wrong = [key for key in ("name", "hash", "locked_utc", "hapteq") if not isinstance(document.get(key), str)]
    if wrong:
        raise LockError(f"the lock lacks the text {', '.join(wrong)}")
    return ProtocolLock(document["name"], document["hash"], document["locked_utc"], document["hapteq"])
