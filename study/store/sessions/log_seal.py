"""Seal of the log of a closed session: a file `seal.json` with the length and hash of the log, in the same folder.

The hash chain of the log alone (`log_chain`) cannot show that lines are missing at the end, or that a log was rewritten
with its chain; the seal shows both. A seal is never rewritten: a note that is added after closing gets a further seal
(`seal-2.json`, ...). Each seal covers the log from its beginning to the length at which the seal was written. There is
no key: the replacement of both log and seal is not detected.
"""

import hashlib
import re
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field, TypeAdapter

from study.errors import StudyError
from study.session.facts.fact_types import Count, Sha256
from study.session.facts.log_chain import CHECKSUM_DIGITS, Chain, ChainBrokenError, verify_checksum
from study.store.disk.file_errors import AlreadyExistsError
from study.store.disk.json_document import read_record, write_json
from study.store.sessions.event_log import LOG_NAME, LogContents, read_log

SEAL_NAME = "seal.json"
"""Name of the first seal's file; later seals are named seal-2.json, seal-3.json and so on."""
SEAL_FORMAT, SEAL_VERSION = "hapteq-seal", 1
"""Name and version of the file format, written into every seal."""
_SEAL_NAME_PATTERN = re.compile(r"seal(-(?P<number>\d{1,6}))?\.json", re.ASCII)
"""Pattern of the file name of a seal; `number` is missing in the name of the first."""


@dataclass(frozen=True, slots=True)
class Seal:
    """Length and hash of the log when the seal was written. The fields are the keys of the file."""

    session: str
    """Name of the session's folder."""
    lines: Count
    """Number of lines of the log."""
    bytes: Count
    """Length of these lines in bytes, line ends included."""
    head: Annotated[str, Field(pattern=f"^[0-9a-f]{{{CHECKSUM_DIGITS}}}$")]
    """Head of the hash chain: the checksum of the last line, hexadecimal."""
    sha256: Sha256
    """SHA-256 of the first `bytes` bytes of `events.jsonl`, hexadecimal."""


SEAL_VALIDATOR: TypeAdapter[Seal] = TypeAdapter(Seal)
"""Validates the fields of a seal, and gives the JSON schema of docs/formats.md."""


def find_seals(folder: Path) -> dict[int, Path]:
    """Find the seals in a session's folder: paths by number (from 1), in ascending order."""
    matches = ((_SEAL_NAME_PATTERN.fullmatch(path.name), path) for path in folder.glob("seal*.json"))
    return dict(sorted((int(match["number"] or 1), path) for match, path in matches if match))


def write_seal(folder: Path, log_contents: LogContents) -> bool:
    """Write the next seal, and return True; return False where a seal covers the whole log already. log_contents: of a
    closed session, with checksums. Raises StudyError where an existing seal is unreadable or does not match the log, or
    where the seal cannot be written."""
    if check_seals(folder, log_contents) == log_contents.chain.lines:
        return False
    seal = Seal(
        session=folder.name,
        lines=log_contents.chain.lines,
        bytes=len(log_contents.complete_lines),
        head=log_contents.chain.head,
        sha256=hashlib.sha256(log_contents.complete_lines).hexdigest(),
    )
    number = max(find_seals(folder), default=0) + 1
    path = folder / (SEAL_NAME if number == 1 else f"seal-{number}.json")
    with suppress(AlreadyExistsError):  # another program has just written the same seal
        write_json(path, SEAL_FORMAT, SEAL_VERSION, asdict(seal))
    return True


def seal_log(log_path: Path) -> None:
    """Seal the log of a session that was just closed. Never raises StudyError: a seal that cannot be written now is
    written when the results of the session are written (`hapteq resume`, `hapteq analyze`)."""
    with suppress(StudyError):
        write_seal(log_path.parent, read_log(log_path))


def read_seal(path: Path) -> Seal:
    """Read and validate a seal. Raises CannotReadError where the file cannot be read, UnusableFileError where its
    format, version or a field is invalid."""
    return read_record(path, SEAL_FORMAT, SEAL_VERSION, "seal of a session log", SEAL_VALIDATOR)


def check_seals(folder: Path, log_contents: LogContents) -> int:
    """Check the log against all its seals, and return the number of lines that they cover; 0 without a seal. Raises
    StudyError where a seal is unreadable or does not match the log, or the log is shorter than a seal states."""
    sealed_lines = 0
    for path in find_seals(folder).values():
        try:
            seal = read_seal(path)
        except StudyError as problem:
            raise _make_contradiction_error(
                folder, log_contents, f"{path.name} cannot be used: {problem.happened}"
            ) from problem
        if len(log_contents.complete_lines) < seal.bytes:
            raise StudyError(
                "The end of this session's log is missing",
                f"{folder.name} was closed with {seal.lines} lines in {LOG_NAME}, and {log_contents.chain.lines} whole "
                "ones are there.",
                f"Restore {LOG_NAME} from a copy.",
                saved="Nothing was changed.",
            )
        if not _is_sealed_prefix(folder, seal, log_contents.complete_lines[: seal.bytes]):
            raise _make_contradiction_error(folder, log_contents, f"{path.name} does not match {LOG_NAME}.")
        sealed_lines = max(sealed_lines, seal.lines)
    return sealed_lines


def is_sealed(folder: Path, log_bytes: bytes) -> bool:
    """Whether there is a seal, all lines are complete, and none contradicts the hash chain; events are not parsed.
    log_bytes: content of the log. Raises StudyError as `check_seals`."""
    *lines, incomplete_line = log_bytes.split(b"\n")
    chain = Chain()
    try:
        for line in lines:
            chain, _ = verify_checksum(chain, line)
    except ChainBrokenError:
        return False
    return not incomplete_line and check_seals(folder, LogContents((), "", 0, chain, log_bytes)) > 0


def _is_sealed_prefix(folder: Path, seal: Seal, prefix: bytes) -> bool:
    """Whether the first `seal.bytes` bytes of a log agree with the seal in session, hash, number of lines and checksum
    of the last line."""
    return (
        seal.session == folder.name
        and seal.sha256 == hashlib.sha256(prefix).hexdigest()
        and seal.lines == prefix.count(b"\n")
        and prefix.endswith(f'"{seal.head}"}}\n'.encode())
    )


def _make_contradiction_error(folder: Path, log_contents: LogContents, reason: str) -> StudyError:
    """Make the error for a seal that does not match its log. reason: continues the sentence "In <folder>, ...". Moving
    the seal away is advised only for a log with checksums, which then still detect damage."""
    remedy = f"Restore {LOG_NAME} and the seal from a copy."
    if log_contents.chain.first_checksum_line:
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
