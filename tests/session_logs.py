"""Logs as a crash, an older version or a forger leaves them, for tests."""

from collections.abc import Callable
from pathlib import Path

from study.session.facts.log_chain import Chain, append_checksum, verify_checksum

RESULTS = ("trials.csv", "thresholds.csv", "detection.csv", "session.json")


def events_of(log: Path) -> list[bytes]:
    """Each event's own JSON, without checksum and line end."""
    chain, events = Chain(), []
    for line in log.read_bytes().splitlines():
        chain, event = verify_checksum(chain, line)
        events.append(event)
    return events


def cut(session: Path, lines: int) -> None:
    """As a kill in the middle leaves it: the first lines, and nothing that is written at the end."""
    log = session / "events.jsonl"
    log.write_bytes(b"".join(log.read_bytes().splitlines(keepends=True)[:lines]))
    unsealed(session)


def unsealed(session: Path) -> None:
    for path in (*(session / name for name in RESULTS), *session.glob("seal*.json")):
        path.unlink(missing_ok=True)


def as_older(session: Path, change: Callable[[bytes], bytes] = bytes) -> None:
    """As a version before checksums left it; change: of the whole text."""
    log = session / "events.jsonl"
    log.write_bytes(change(b"".join(event + b"\n" for event in events_of(log))))
    for path in session.glob("seal*.json"):
        path.unlink()


def forged(session: Path, change: Callable[[list[bytes]], list[bytes]]) -> None:
    """Events changed, and all checksums computed again; the seal is gone."""
    log, chain, text = session / "events.jsonl", Chain(), b""
    for event in change(events_of(log)):
        chain, line = append_checksum(chain, event)
        text += line
    log.write_bytes(text)
    for path in session.glob("seal*.json"):
        path.unlink()
