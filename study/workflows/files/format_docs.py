"""Generate docs/formats.md, docs/importing.md and docs/schemas/*.json from the code that reads and writes the files.

A program: `python -m study.workflows.files.format_docs docs` updates them; a test (`test_format_docs.py`) fails where
they differ from the code. Most fixed texts of the pages are in `formats_text` and `importing_text`.
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
from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES, EffectParameter
from equalizer.signals.unit_system import LINEAR, ROTATIONAL
from equalizer.tracking.feedforward.trajectory import TABLE_KINDS
from protocols.document.schema import make_protocol_schema
from protocols.trial import Trial
from study.session.facts import log_chain
from study.session.facts.events import EVENTS
from study.session.watching.live_state import LiveState
from study.store.disk.csv_rows import describe_type, list_columns
from study.store.disk.layout import Entry
from study.store.disk.text_file import write_text
from study.store.formats import identified_model_file, mechanical_model_file, recording_layout, repeats_file
from study.store.formats.calibration_file import ABOUT as CALIBRATION_ABOUT
from study.store.formats.calibration_file import LAYOUT as CALIBRATION_LAYOUT
from study.store.sessions import live_file, log_seal
from study.store.sessions.request_inbox import REQUEST_CLASSES, REQUEST_FORMAT, REQUEST_VERSION
from study.workflows.files import formats_text
from study.workflows.files.importing_docs import compose_importing_page, format_markdown_table


def make_event_schema() -> dict[str, Any]:
    """Make the JSON schema of an event of the session log. Each event may have the field `chain`, the checksum that the
    log adds."""
    schema = EVENTS.json_schema()
    for event in schema["$defs"].values():
        if "event" in event.get("properties", {}):
            event["properties"]["chain"] = {"type": "string", "pattern": f"^[0-9a-f]{{{log_chain.CHECKSUM_DIGITS}}}$"}
    return schema


@dataclass(frozen=True, slots=True)
class Schema:
    """A file of docs/schemas."""

    file: str
    """Name of the file."""
    describes: str
    """The document that the schema describes, in Markdown."""
    make: Callable[[], dict[str, Any]]
    """Makes the schema."""


def make_document_schema(payload: Mapping[str, Any], format_name: str, version: int) -> dict[str, Any]:
    """Make the JSON schema of a complete JSON document. payload: schema of the fields apart from format, version and
    provenance, which are added."""
    format_fields = {"format": {"const": format_name}, "version": {"const": version}}
    return {
        **payload,
        "properties": {**format_fields, **payload["properties"], "provenance": {"type": "object"}},
        "required": ["format", "version", *payload.get("required", ())],
    }


def make_request_schema() -> dict[str, Any]:
    """Make the JSON schema of a request to a running session, with one alternative for each kind of request."""
    schemas = {kind: TypeAdapter(request_type).json_schema() for kind, request_type in REQUEST_CLASSES.items()}
    for kind, schema in schemas.items():
        schema["properties"]["request"] = {"const": kind}
        schema["required"].append("request")
    return {"oneOf": [make_document_schema(schema, REQUEST_FORMAT, REQUEST_VERSION) for schema in schemas.values()]}


SCHEMAS: tuple[Schema, ...] = (
    Schema("study_protocol.json", "study protocols, read from TOML", lambda: make_protocol_schema("study")),
    Schema("session_event.json", "one line of `events.jsonl`", make_event_schema),
    Schema(
        "seal.json",
        "`seal.json`, next to the log of a closed session",
        lambda: make_document_schema(
            log_seal.SEAL_VALIDATOR.json_schema(), log_seal.SEAL_FORMAT, log_seal.SEAL_VERSION
        ),
    ),
    Schema("recording_protocol.json", "recording protocols, read from TOML", lambda: make_protocol_schema("recording")),
    Schema(
        "diagnosis.json",
        "`diagnosis.json`",
        lambda: make_document_schema(document.build_diagnosis_schema(), document.FORMAT, document.VERSION),
    ),
    Schema(
        "real_answer.json",
        "`answer.json`, the result of `hapteq real` for one recording",
        lambda: make_document_schema(real_answer.make_real_answer_schema(), real_answer.FORMAT, real_answer.VERSION),
    ),
    Schema(
        "repeats.json",
        f"`*{repeats_file.SUFFIX}`, {formats_text.REPEATS_DESCRIPTION}",
        lambda: make_document_schema(
            repeats_file.REPEATS_VALIDATOR.json_schema(), repeats_file.FORMAT, repeats_file.VERSION
        ),
    ),
    Schema(
        "reproduction.json",
        "`reproduction.json`, the results of `hapteq reproduce`, compared with those of the paper",
        lambda: make_document_schema(
            reproduction_document.make_reproduction_schema(),
            reproduction_document.FORMAT,
            reproduction_document.VERSION,
        ),
    ),
    Schema(
        "live.json",
        formats_text.LIVE_STATE_DESCRIPTION,
        lambda: make_document_schema(
            TypeAdapter(LiveState).json_schema(), live_file.LIVE_FORMAT, live_file.LIVE_VERSION
        ),
    ),
    Schema("request.json", formats_text.REQUEST_DESCRIPTION, make_request_schema),
)
"""Schemas of protocols and JSON formats; only those in this tuple are documented."""


def compose_formats_page() -> str:
    """Compose the text of docs/formats.md, in Markdown."""
    parts = [
        "# File formats",
        *formats_text.INTRODUCTION,
        "## Recording (`.h5`)",
        _format_layout(recording_layout.LAYOUT),
        formats_text.SIGNAL_TABLE_NOTE,
        _format_layout(recording_layout.SIGNAL_ATTRIBUTES),
        formats_text.SEGMENT_TABLE_NOTE,
        _format_layout(recording_layout.SEGMENT_FIELDS),
        formats_text.RECORDING_NOTES,
        "## Identified model (`.h5`)",
        _format_layout(identified_model_file.LAYOUT),
        "## Calibration of a linkage (`.h5`)",
        CALIBRATION_ABOUT,
        _format_layout(CALIBRATION_LAYOUT),
        "## Mechanical model (`.toml`)",
        formats_text.MECHANICAL_MODEL_NOTES,
        _format_layout(mechanical_model_file.LAYOUT),
        "## Effects",
        formats_text.EFFECTS_NOTES,
        _format_effects(),
        "## Laws without a name",
        formats_text.LAW_SECTION,
        *_format_csv_tables(),
        "## Session log (`events.jsonl`) and its seal (`seal.json`)",
        *formats_text.SESSION_LOG_NOTES,
        "## JSON documents and protocols",
        "\n".join(f"* [`{schema.file}`](schemas/{schema.file}): {schema.describes}" for schema in SCHEMAS),
    ]
    return "\n\n".join(parts) + "\n"


def generate_documents() -> dict[str, str]:
    """Generate the text of every file, by its path relative to docs."""
    schemas = {f"schemas/{schema.file}": json.dumps(schema.make(), indent=2) + "\n" for schema in SCHEMAS}
    return {"formats.md": compose_formats_page(), "importing.md": compose_importing_page(), **schemas}


def write_documents(folder: Path) -> None:
    """Write all generated files into `folder`, the docs of the repository, replacing older ones. Raises OSError, and
    CannotWriteError for a file."""
    for name, text in generate_documents().items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_text(folder / name, text, overwrite=True)


_RESPONSE_UNIT = "the response's unit"
"""Text for a unit that is that of the response, in the table of effects."""


def _format_parameter(parameter: EffectParameter) -> str:
    """Format name and unit of an effect's parameter, for devices with linear axes."""
    unit = parameter.find_unit(LINEAR, _RESPONSE_UNIT)
    return f"`{parameter.name}` ({unit}, optional)" if parameter.optional else f"`{parameter.name}` ({unit})"


def _format_effects() -> str:
    """Format the Markdown table of the effects of a mechanical model, with the units of their parameters."""
    rows = []
    for effect in EFFECT_ENTRIES:
        parameters_text = ", ".join(_format_parameter(parameter) for parameter in effect.parameters)
        rotational_units = ", ".join(parameter.find_unit(ROTATIONAL, _RESPONSE_UNIT) for parameter in effect.parameters)
        rows.append((f"`{effect.name}`", effect.place, parameters_text, rotational_units))
    return format_markdown_table(("effect", "place", "parameters", "rotational units"), rows)


_CSV_TABLES: tuple[tuple[str, type[Trial] | type[Threshold], str], ...] = (
    ("trials.csv", Trial, formats_text.TRIALS_NOTES),
    ("thresholds.csv", Threshold, formats_text.THRESHOLDS_NOTES),
)
"""CSV tables with a row per dataclass instance: file name, dataclass, description."""


def _format_csv_tables() -> Iterable[str]:
    """Yield the sections on the CSV tables: trajectories and forces, trials, thresholds."""
    yield "## Trajectory and forces (`.csv`)"
    yield format_markdown_table(
        ("header", "holds"), [(f"`{','.join(kind.header)}`", f"{kind.quantity}, {kind.unit}") for kind in TABLE_KINDS]
    )
    yield formats_text.FORCE_TABLE_NOTES
    for name, row_type, description in _CSV_TABLES:
        yield f"## `{name}`"
        yield description
        type_hints = get_type_hints(row_type)
        yield format_markdown_table(
            ("column", "holds"),
            [(f"`{column}`", describe_type(type_hints[column])) for column in list_columns(row_type)],
        )


def _format_layout(entries: Iterable[Entry]) -> str:
    """Format the Markdown table of the entries of a file."""
    rows = [
        (f"`{entry.name}`", entry.type_and_shape, entry.meaning, "yes" if entry.required else "no") for entry in entries
    ]
    return format_markdown_table(("name", "holds", "meaning", "required"), rows)


if __name__ == "__main__":
    write_documents(Path(sys.argv[1]))
