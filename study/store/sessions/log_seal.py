"""`seal.json` beside the log of a closed session: its length and hash. Written once.

A log grows after closing if something is noted later; a further seal (`seal-2.json`, ...) then covers that too. A seal
holds for the beginning of the log that it was written for.
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
"""File of the first seal; later ones are seal-2.json, seal-3.json and so on."""
SEAL_FORMAT, SEAL_VERSION = "hapteq-seal", 1
_NAME = re.compile(r"seal(-(?P<number>\d{1,6}))?\.json", re.ASCII)
"""Name of any seal."""


@dataclass(frozen=True, slots=True)
class Seal:
    """Length of the log when the seal was written."""

    session: str
    lines: Count
    bytes: Count
    head: Annotated[str, Field(pattern=f"^[0-9a-f]{{{DIGITS}}}$")]
    """Checksum of the last line: the head of the hash chain."""
    sha256: Sha256
    """SHA-256 of these bytes of `events.jsonl`."""


SEAL: TypeAdapter[Seal] = TypeAdapter(Seal)
"""Checks and writes a seal."""


def seal_paths(folder: Path) -> dict[int, Path]:
    """Seals by number, in the order of writing."""
    found = ((_NAME.fullmatch(path.name), path) for path in folder.glob("seal*.json"))
    return dict(sorted((int(match["number"] or 1), path) for match, path in found if match))


def write_seal(folder: Path, contents: LogContents) -> bool:
    """Write the seal; on return it is on the disk. False if a seal covers the whole log already. contents: of a closed
    session whose log has checksums. Raises StudyError."""
    if check_seals(folder, contents) == contents.chain.lines:
        return False
    seal = Seal(
        session=folder.name,
        lines=contents.chain.lines,
        bytes=len(contents.whole),
        head=contents.chain.head,
        sha256=hashlib.sha256(contents.whole).hexdigest(),
    )
    number = max(seal_paths(folder), default=0) + 1
    path = folder / (SEAL_NAME if number == 1 else f"seal-{number}.json")
    with suppress(AlreadyThereError):  # another program was first, with the same
        write_json(path, SEAL_FORMAT, SEAL_VERSION, asdict(seal))
    return True


def seal_log(log: Path) -> None:
    """Seal right after the last line of a closed session. If that fails, the seal stays due: `hapteq resume` and
    `hapteq analyze` write it and say so."""
    with suppress(StudyError):
        write_seal(log.parent, read_log(log))


def read_seal(path: Path) -> Seal:
    """Read a seal. Raises CannotReadError, UnusableFileError."""
    document = read_json(path, SEAL_FORMAT, SEAL_VERSION)
    try:
        return SEAL.validate_json(json.dumps(document), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "the document"
        raise UnusableFileError(path, "seal of a session log", (f"{where}: {first['msg']}",)) from error


def check_seals(folder: Path, contents: LogContents) -> int:
    """Number of sealed lines; 0 without a seal. Raises StudyError if one does not hold."""
    sealed = 0
    for path in seal_paths(folder).values():
        try:
            seal = read_seal(path)
        except StudyError as problem:
            raise _contradiction(folder, contents, f"{path.name} cannot be used: {problem.happened}") from problem
        if len(contents.whole) < seal.bytes:
            raise StudyError(
                "The end of this session's log is missing",
                f"{folder.name} was closed with {seal.lines} lines in {LOG_NAME}, and {contents.chain.lines} whole "
                "ones are there.",
                f"Restore {LOG_NAME} from a copy.",
                saved="Nothing was changed.",
            )
        if not _is_sealed_prefix(folder, seal, contents.whole[: seal.bytes]):
            raise _contradiction(folder, contents, f"{path.name} says something else than {LOG_NAME}.")
        sealed = max(sealed, seal.lines)
    return sealed


def is_sealed(folder: Path, content: bytes) -> bool:
    """Whether there is a seal, all seals hold, and every line matches its checksum; nothing is parsed.

    Raises StudyError if a seal does not hold.
    """
    *lines, tail = content.split(b"\n")
    chain = Chain()
    try:
        for line in lines:
            chain, _ = read_chained(chain, line)
    except ChainBrokenError:
        return False
    return not tail and check_seals(folder, LogContents((), "", 0, chain, content)) > 0


def _is_sealed_prefix(folder: Path, seal: Seal, prefix: bytes) -> bool:
    return (
        seal.session == folder.name
        and seal.sha256 == hashlib.sha256(prefix).hexdigest()
        and seal.lines == prefix.count(b"\n")
        and prefix.endswith(f'"{seal.head}"}}\n'.encode())
    )


def _contradiction(folder: Path, contents: LogContents, happened: str) -> StudyError:
    do_now = f"Restore {LOG_NAME} and the seal from a copy."
    if contents.chain.since:
        do_now += (
            " The lines of the log match their own checksums: where there is no copy, take the seal out of the folder, "
            "and hapteq resume writes it again."
        )
    return StudyError(
        "The session log and its seal contradict each other",
        f"In {folder.name}, {happened}",
        do_now,
        saved="Nothing was changed.",
    )
