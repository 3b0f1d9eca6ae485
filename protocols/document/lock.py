"""Lock of a protocol: its hash, stored before data are collected, and the check that the protocol is unchanged.

With a lock, a change of the settings after the start of data collection is detected. A lock is a JSON document.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.study_protocol import StudyProtocol
from protocols.document.hashing import hash_protocol

LOCK_FORMAT = "hapteq-protocol-lock"
"""Value of the key `format`, which identifies a JSON document as a lock."""
LOCK_VERSION = 1
"""Version of the lock's JSON format; a lock of another version is refused."""


class LockError(ValueError):
    """A lock that cannot be read, or a protocol that is no longer the locked one."""


@dataclass(frozen=True, slots=True)
class ProtocolLock:
    """Name and hash of a protocol at the time when it was locked."""

    name: str
    hash: str
    """Hash of all settings (`protocols.document.hashing.hash_protocol`)."""
    locked_utc: str
    """Time of the lock, UTC, ISO 8601."""
    hapteq: str
    """Version of the program hapteq that made the lock."""
    words: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Texts of a protocol by key, which a later version of the program may have changed; empty for the English of the
    program, and in locks of earlier versions."""


def make_lock(protocol: StudyProtocol | RecordingProtocol, locked_utc: str, hapteq_version: str) -> ProtocolLock:
    """Make the lock of a protocol. locked_utc: time, ISO 8601; hapteq_version: version of the program that makes it."""
    words = protocol.text.words if isinstance(protocol, StudyProtocol) else {}
    return ProtocolLock(protocol.name, hash_protocol(protocol), locked_utc, hapteq_version, words)


def check_lock(lock: ProtocolLock, protocol: StudyProtocol | RecordingProtocol, locked_time: str) -> None:
    """Raise LockError unless `protocol` has the name and the hash that were locked.

    locked_time: time of the lock as readable text, for the message.
    """
    if protocol.name != lock.name:
        raise LockError(
            f"the lock is that of protocol {lock.name}, not of {protocol.name}; give the lock of this protocol"
        )
    current_hash = hash_protocol(protocol)
    if current_hash != lock.hash:
        raise LockError(
            f"protocol {lock.name} was locked on {locked_time} and has changed since: "
            f"its fingerprint is {current_hash[:12]}…, the locked one {lock.hash[:12]}…"
        )


def lock_to_json(lock: ProtocolLock) -> str:
    """Convert a lock to JSON text; inverse: `lock_from_json`."""
    document = {
        "format": LOCK_FORMAT,
        "version": LOCK_VERSION,
        "name": lock.name,
        "hash": lock.hash,
        "locked_utc": lock.locked_utc,
        "hapteq": lock.hapteq,
        **({"words": dict(lock.words)} if lock.words else {}),
    }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def lock_from_json(text: str) -> ProtocolLock:
    """Parse a lock from JSON text. Raises LockError, with the cause, for text that is no lock of this version."""
    try:
        document: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise LockError(f"a lock is a JSON document, but this is none: {error}") from error
    if not isinstance(document, dict) or document.get("format") != LOCK_FORMAT:
        raise LockError(f'a lock contains "format": "{LOCK_FORMAT}", and this document does not')
    if document.get("version") != LOCK_VERSION:
        raise LockError(
            f"the lock is of version {document.get('version')}, and this hapteq reads version {LOCK_VERSION}"
        )
    missing_keys = [key for key in ("name", "hash", "locked_utc", "hapteq") if not isinstance(document.get(key), str)]
    if missing_keys:
        raise LockError(f"the lock lacks the text {', '.join(missing_keys)}")
    words = document.get("words", {})
    if not isinstance(words, dict) or not all(isinstance(text, str) for text in words.values()):
        raise LockError("the lock's words are no texts by key")
    return ProtocolLock(document["name"], document["hash"], document["locked_utc"], document["hapteq"], words)
