"""Seal of the log of a closed session: a file `seal.json` with the length and hash of the log, next to it.

The hash chain of the log alone cannot show that lines are missing at the end, or that a log was rewritten with its
chain; the seal shows both. A seal is never rewritten: a note that is added after closing gets a further seal
(`seal-2.json`, ...). Each seal covers the log from its beginning to the length at which the seal was written. There is
no key: a seal does not reveal that log and seal were replaced together.
"""

import hashlib
import json
import re
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field, TypeAdapter, ValidationError

from study.errors import StudyError
from study.session.facts.fact_types import Count, Sha256
from study.session.facts.log_chain import DIGITS, Chain, ChainBrokenError, read_chained
from study.store.disk.file_errors import AlreadyThereError, UnusableFileError
from study.store.disk.json_document import read_json, write_json
from study.store.sessions.event_log import LOG_NAME, LogContents, read_log

SEAL_NAME = "seal.json"
"""Name of the first seal's file; later seals are seal-2.json, seal-3.json and so on."""
SEAL_FORMAT, SEAL_VERSION = "hapteq-seal", 1
"""Name and version of the file format, written into every seal."""
_NAME = re.compile(r"seal(-(?P<number>\d{1,6}))?\.json", re.ASCII)
"""Pattern of the file name of any seal."""


@dataclass(frozen=True, slots=True)
class Seal:
    """Length and hash of the log when the seal was written."""

    session: str
    """Name of the session's folder."""
    lines: Count
    bytes: Count
    head: Annotated[str, Field(pattern=f"^[0-9a-f]{{{DIGITS}}}$")]
    """Checksum of the last line: the head of the hash chain."""
    sha256: Sha256
    """SHA-256 of the first `bytes` bytes of `events.jsonl`."""


SEAL: TypeAdapter[Seal] = TypeAdapter(Seal)
"""Validator and JSON schema of a seal."""


def find_seals(folder: Path) -> dict[int, Path]:
    """Files of the seals in a session's folder by number, in the order of writing."""
    matches = ((_NAME.fullmatch(path.name), path) for path in folder.glob("seal*.json"))
    return dict(sorted((int(match["number"] or 1), path) for match, path in matches if match))


def write_seal(folder: Path, contents: LogContents) -> bool:
    """Write a seal to the disk, unless a seal covers the whole log already: then returns False. contents: log of a
    closed session, with checksums. Raises StudyError where an existing seal does not match the log, or on a disk
    error."""
    if check_seals(folder, contents) == contents.chain.lines:
        return False
    seal = Seal(
        session=folder.name,
        lines=contents.chain.lines,
        bytes=len(contents.complete_lines),
        head=contents.chain.head,
        sha256=hashlib.sha256(contents.complete_lines).hexdigest(),
    )
    number = max(find_seals(folder), default=0) + 1
    path = folder / (SEAL_NAME if number == 1 else f"seal-{number}.json")
    with suppress(AlreadyThereError):  # another program has just written the same seal
        write_json(path, SEAL_FORMAT, SEAL_VERSION, asdict(seal))
    return True


def seal_log(log: Path) -> None:
    """Seal the log of a session that was just closed. Never raises StudyError: if the seal cannot be written now,
    `hapteq resume` and `hapteq analyze` write it later and report it."""
    with suppress(StudyError):
        write_seal(log.parent, read_log(log))


def read_seal(path: Path) -> Seal:
    """Read and validate a seal. Raises CannotReadError, and UnusableFileError for an invalid one."""
    document = read_json(path, SEAL_FORMAT, SEAL_VERSION)
    try:
        return SEAL.validate_json(json.dumps(document), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field_path = ".".join(map(str, first["loc"])) or "the document"
        raise UnusableFileError(path, "seal of a session log", (f"{field_path}: {first['msg']}",)) from error


def check_seals(folder: Path, contents: LogContents) -> int:
    """Number of lines of the log that seals cover; 0 without a seal. Raises StudyError if a seal is unreadable or does
    not match the log."""
    sealed = 0
    for path in find_seals(folder).values():
        try:
            seal = read_seal(path)
        except StudyError as problem:
            raise _contradiction_error(folder, contents, f"{path.name} cannot be used: {problem.happened}") from problem
        if len(contents.complete_lines) < seal.bytes:
            raise StudyError(
                "The end of this session's log is missing",
                f"{folder.name} was closed with {seal.lines} lines in {LOG_NAME}, and {contents.chain.lines} whole "
                "ones are there.",
                f"Restore {LOG_NAME} from a copy.",
                saved="Nothing was changed.",
            )
        if not _is_sealed_prefix(folder, seal, contents.complete_lines[: seal.bytes]):
            raise _contradiction_error(folder, contents, f"{path.name} does not match {LOG_NAME}.")
        sealed = max(sealed, seal.lines)
    return sealed


def is_sealed(folder: Path, content: bytes) -> bool:
    """Whether there is a seal, and every line matches its checksum; events are not parsed. content: of the log.

    Raises StudyError if a seal is unreadable or does not match the log.
    """
    *lines, incomplete = content.split(b"\n")
    chain = Chain()
    try:
        for line in lines:
            chain, _ = read_chained(chain, line)
    except ChainBrokenError:
        return False
    return not incomplete and check_seals(folder, LogContents((), "", 0, chain, content)) > 0


def _is_sealed_prefix(folder: Path, seal: Seal, prefix: bytes) -> bool:
    """Whether the beginning of a log is what a seal states: session, hash, number of lines, and last checksum."""
    return (
        seal.session == folder.name
        and seal.sha256 == hashlib.sha256(prefix).hexdigest()
        and seal.lines == prefix.count(b"\n")
        and prefix.endswith(f'"{seal.head}"}}\n'.encode())
    )


def _contradiction_error(folder: Path, contents: LogContents, reason: str) -> StudyError:
    """The error for a seal that does not match its log. reason: continues the sentence "In <folder>, ...". A seal
    may be deleted only where the log's own checksums still protect it."""
    remedy = f"Restore {LOG_NAME} and the seal from a copy."
    if contents.chain.since:
        remedy += (
            " The lines of the log match their own checksums: where there is no copy, move the seal out of the "
            "folder, and hapteq resume writes it again."
        )
    return StudyError(
        "The session log and its seal contradict each other",
        f"In {folder.name}, {reason}",
        remedy,
        saved="Nothing was changed.",
    )
