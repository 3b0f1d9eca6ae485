"""What docs/formats.md says of the session log and its seal, and the schema of a line."""

from collections.abc import Iterable
from typing import Any

from study.session.facts import log_chain
from study.session.facts.events import EVENTS


def event_schema() -> dict[str, Any]:
    """Each event may carry the checksum that the log adds."""
    schema = EVENTS.json_schema()
    for event in schema["$defs"].values():
        if "event" in event.get("properties", {}):
            event["properties"]["chain"] = {"type": "string", "pattern": f"^[0-9a-f]{{{log_chain.DIGITS}}}$"}
    return schema


def session_log_markdown() -> Iterable[str]:
    yield "## Session log (`events.jsonl`) and its seal (`seal.json`)"
    yield (
        "One JSON object per line, appended and never changed; each is a fact of the schema `session_event.json`. "
        "Times are ISO 8601 with date and UTC offset, durations in seconds, files relative to the session's folder."
    )
    yield (
        f"A line ends with the field `chain`, {log_chain.DIGITS} hexadecimal digits: the first of the SHA-256 of the "
        "checksum before it, a line feed, and the line's own bytes without this field (nor the comma before it, nor "
        f"the line end). Before the first line stand {log_chain.DIGITS} zeros. Lines that older versions wrote have no "
        "`chain` and enter the hash all the same: where such a log goes on, its first checksum covers what came "
        "before."
    )
    yield (
        "When a session is closed, `seal.json` is written once: number of lines, bytes, the last checksum, and the "
        "SHA-256 of these bytes. It tells a log whose end was cut off from one that was interrupted. Notes that are "
        "added after the end are covered by `seal-2.json` and so on. Whatever reads a session checks all of it, and "
        "`hapteq validate` names the line. A session that is damaged is left out of an analysis, with the reason."
    )
    yield (
        "Checksums and seal have no key: they show damage, and edits by those who do not compute them again. They are "
        "no proof of who wrote a log, nor against forgery; a copy kept elsewhere is."
    )
