"""Generates docs/formats.md, docs/importing.md and docs/schemas/*.json from the code that reads and writes the files.

`python -m study.workflows.files.format_docs docs` updates them; a test fails if they differ from the code.
"""

import json
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_type_hints

from pydantic import TypeAdapter

from analysis.diagnosis import document
from analysis.diagnosis.real_answer import real_answer
from analysis.evaluation.reproduction import document as reproduction_document
from analysis.psychophysics.thresholds import Threshold
from equalizer.plant.effect_vocabulary import EFFECT_NAMES, EffectParameter
from equalizer.signals.unit_system import LINEAR, ROTATIONAL
from equalizer.tracking.feedforward.trajectory import TABLE_KINDS
from protocols.document.schema import protocol_schema
from protocols.trial import Trial
from study.session.facts import log_chain
from study.session.facts.events import EVENTS
from study.session.watching.live import Live
from study.store.disk.csv_rows import column_names, describe_type
from study.store.disk.layout import Entry
from study.store.disk.text_file import write_text
from study.store.formats import identified_model_file, mechanical_model_file, recording_layout, repeats_file
from study.store.formats.calibration_file import ABOUT as CALIBRATION_ABOUT
from study.store.formats.calibration_file import LAYOUT as CALIBRATION_LAYOUT
from study.store.sessions import live_file, log_seal
from study.store.sessions.request_inbox import KINDS, REQUEST_FORMAT, REQUEST_VERSION
from study.workflows.files import format_text
from study.workflows.files.importing_docs import write_importing_page


def event_schema() -> dict[str, Any]:
    """JSON schema of an event of the session log; each may have the checksum field `chain` that the log adds."""
    schema = EVENTS.json_schema()
    for event in schema["$defs"].values():
        if "event" in event.get("properties", {}):
            event["properties"]["chain"] = {"type": "string", "pattern": f"^[0-9a-f]{{{log_chain.DIGITS}}}$"}
    return schema


def session_log_markdown() -> Iterable[str]:
    """Paragraphs of docs/formats.md on the session log and its seal."""
    yield "## Session log (`events.jsonl`) and its seal (`seal.json`)"
    yield from format_text.SESSION_LOG


@dataclass(frozen=True, slots=True)
class Schema:
    """A file of docs/schemas: its name, what it describes, and the function that generates its JSON schema."""

    file: str
    describes: str
    make: Callable[[], dict[str, Any]]


def document_schema(payload: Mapping[str, Any], format_name: str, version: int) -> dict[str, Any]:
    """The schema of a whole JSON document: that of its own fields, with format, version and provenance added."""
    format_fields = {"format": {"const": format_name}, "version": {"const": version}}
    return {
        **payload,
        "properties": {**format_fields, **payload["properties"], "provenance": {"type": "object"}},
        "required": ["format", "version", *payload.get("required", ())],
    }


def request_schema() -> dict[str, Any]:
    """JSON schema of a request to a running session, with one alternative for each kind of request."""
    schemas = {kind: TypeAdapter(request_type).json_schema() for kind, request_type in KINDS.items()}
    for kind, schema in schemas.items():
        schema["properties"]["request"] = {"const": kind}
        schema["required"].append("request")
    return {"oneOf": [document_schema(schema, REQUEST_FORMAT, REQUEST_VERSION) for schema in schemas.values()]}


SCHEMAS: tuple[Schema, ...] = (
    Schema("study_protocol.json", "study protocols, read from TOML", lambda: protocol_schema("study")),
    Schema("session_event.json", "one line of `events.jsonl`", event_schema),
    Schema(
        "seal.json",
        "`seal.json`, next to the log of a closed session",
        lambda: document_schema(log_seal.SEAL.json_schema(), log_seal.SEAL_FORMAT, log_seal.SEAL_VERSION),
    ),
    Schema("recording_protocol.json", "recording protocols, read from TOML", lambda: protocol_schema("recording")),
    Schema(
        "diagnosis.json",
        "`diagnosis.json`",
        lambda: document_schema(document.diagnosis_schema(), document.FORMAT, document.VERSION),
    ),
    Schema(
        "real_answer.json",
        "`answer.json`, the result of `hapteq real` for one recording",
        lambda: document_schema(real_answer.real_answer_schema(), real_answer.FORMAT, real_answer.VERSION),
    ),
    Schema(
        "repeats.json",
        f"`*{repeats_file.SUFFIX}`, {format_text.REPEATS}",
        lambda: document_schema(repeats_file.REPEATS.json_schema(), repeats_file.FORMAT, repeats_file.VERSION),
    ),
    Schema(
        "reproduction.json",
        "`reproduction.json`, the results of `hapteq reproduce`, compared with those of the paper",
        lambda: document_schema(
            reproduction_document.reproduction_schema(), reproduction_document.FORMAT, reproduction_document.VERSION
        ),
    ),
    Schema(
        "live.json",
        format_text.LIVE,
        lambda: document_schema(TypeAdapter(Live).json_schema(), live_file.LIVE_FORMAT, live_file.LIVE_VERSION),
    ),
    Schema("request.json", format_text.REQUEST, request_schema),
)
"""Schemas of all JSON formats and protocols. Each new JSON format must be added."""


def formats_markdown() -> str:
    """The text of docs/formats.md."""
    parts = [
        "# File formats",
        *format_text.INTRODUCTION,
        *_recordings(),
        "## Identified model (`.h5`)",
        _table(identified_model_file.LAYOUT),
        "## Calibration of a linkage (`.h5`)",
        CALIBRATION_ABOUT,
        _table(CALIBRATION_LAYOUT),
        *_mechanical_models(),
        "## Effects",
        format_text.EFFECTS_NOTES,
        _effects(),
        "## Laws without a name",
        format_text.LAWS,
        *_tables(),
        *session_log_markdown(),
        "## JSON documents and protocols",
        "\n".join(f"* [`{schema.file}`](schemas/{schema.file}): {schema.describes}" for schema in SCHEMAS),
    ]
    return "\n\n".join(parts) + "\n"


def documents() -> dict[str, str]:
    """Text of every generated file, by its path below docs."""
    schemas = {f"schemas/{schema.file}": json.dumps(schema.make(), indent=2) + "\n" for schema in SCHEMAS}
    return {"formats.md": formats_markdown(), "importing.md": write_importing_page(), **schemas}


def write_documents(folder: Path) -> None:
    """Write all generated files into this folder (docs), replacing older ones. Raises CannotWriteError."""
    for name, text in documents().items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_text(folder / name, text, overwrite=True)


def _recordings() -> Iterable[str]:
    yield "## Recording (`.h5`)"
    yield _table(recording_layout.LAYOUT)
    yield format_text.SIGNAL_ATTRIBUTES
    yield _table(recording_layout.SIGNAL_ATTRIBUTES)
    yield format_text.SEGMENT_FIELDS
    yield _table(recording_layout.SEGMENT_FIELDS)
    yield format_text.RECORDING_NOTES


def _mechanical_models() -> Iterable[str]:
    yield "## Mechanical model (`.toml`)"
    yield format_text.MECHANICAL_MODEL_NOTES
    yield _table(mechanical_model_file.LAYOUT)


_RESPONSE = "the response's unit"


def _parameter(part: EffectParameter) -> str:
    unit = part.unit_in(LINEAR, _RESPONSE)
    return f"`{part.name}` ({unit}, optional)" if part.optional else f"`{part.name}` ({unit})"


def _effects() -> str:
    rows = []
    for effect in EFFECT_NAMES:
        numbers = ", ".join(_parameter(part) for part in effect.parameters)
        rotational_units = ", ".join(part.unit_in(ROTATIONAL, _RESPONSE) for part in effect.parameters)
        rows.append((f"`{effect.name}`", effect.place, numbers, rotational_units))
    return _rows(("effect", "place", "parameters", "rotational units"), rows)


_TABLES: tuple[tuple[str, type[Trial] | type[Threshold], str], ...] = (
    ("trials.csv", Trial, format_text.TRIALS),
    ("thresholds.csv", Threshold, format_text.THRESHOLDS),
)


def _tables() -> Iterable[str]:
    yield "## Trajectory and forces (`.csv`)"
    yield _rows(
        ("header", "holds"), [(f"`{','.join(kind.header)}`", f"{kind.quantity}, {kind.unit}") for kind in TABLE_KINDS]
    )
    yield format_text.TABLE_NOTES
    for name, row_type, description in _TABLES:
        yield f"## `{name}`"
        yield description
        hints = get_type_hints(row_type)
        yield _rows(("column", "holds"), [(f"`{key}`", describe_type(hints[key])) for key in column_names(row_type)])


def _table(entries: Iterable[Entry]) -> str:
    rows = [(f"`{entry.name}`", entry.holds, entry.meaning, "yes" if entry.required else "no") for entry in entries]
    return _rows(("name", "holds", "meaning", "required"), rows)


def _rows(heading: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [heading, tuple("---" for _ in heading), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


if __name__ == "__main__":
    write_documents(Path(sys.argv[1]))
