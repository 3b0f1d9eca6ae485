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
from equalizer.laws.parse import FUNCTIONS, LARGEST, LONGEST, MEMORY
from equalizer.laws.program import CELLS, DEEPEST
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW, EFFECT_NAMES, EffectParameter
from equalizer.signals.unit_system import LINEAR, ROTATIONAL
from equalizer.signals.units import ALLOWED
from equalizer.tracking.feedforward.trajectory import STEP_TOLERANCE, TABLE_KINDS
from protocols.document.schema import protocol_schema
from protocols.trial import Trial
from study.session.facts import log_chain
from study.session.facts.events import EVENTS
from study.session.watching.live import Live
from study.store.disk.csv_rows import columns, in_words
from study.store.disk.layout import Entry
from study.store.disk.text_file import write_text
from study.store.formats import identified_model_file, mechanical_model_file, recording_layout, repeats_file
from study.store.formats.calibration_file import ABOUT as CALIBRATION_ABOUT
from study.store.formats.calibration_file import LAYOUT as CALIBRATION_LAYOUT
from study.store.sessions import live_file, log_seal
from study.store.sessions.request_inbox import KINDS, REQUEST_FORMAT, REQUEST_VERSION
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
    yield (
        "One JSON object per line, appended and never changed; each is a fact of the schema `session_event.json`. "
        "Times are ISO 8601 with date and UTC offset, durations in seconds, files relative to the session's folder."
    )
    yield (
        f"A line ends with the field `chain`, {log_chain.DIGITS} hexadecimal digits: the first of the SHA-256 of the "
        "checksum before it, a line feed, and the line's own bytes without this field (nor the comma before it, nor "
        f"the line end). Before the first line stand {log_chain.DIGITS} zeros. Lines that older versions wrote have no "
        "`chain` but enter the hash: where such a log is continued, its first checksum covers what was before."
    )
    yield (
        "When a session is closed, `seal.json` is written once: number of lines, bytes, the last checksum, and the "
        "SHA-256 of these bytes. It distinguishes a log whose end was cut off from one that was interrupted. Notes "
        "added after the end are covered by `seal-2.json` and so on. Each reader of a session checks all of it, and "
        "`hapteq validate` names the line. A damaged session is left out of an analysis, with the reason."
    )
    yield (
        "Checksums and seal have no key: they show damage, and edits by those who do not compute them again. They are "
        "no proof of who wrote a log, nor against forgery; a copy kept elsewhere is."
    )


_PLAIN = ", ".join(f"`{name}`" for name in FUNCTIONS if name not in MEMORY)
LAWS = "\n\n".join(
    (
        f"A law that the catalogue has no name for is an effect `{DISCOVERED_LAW}`. A model says its formula:",
        "```toml\n[[effect]]\n"
        f'kind = "{DISCOVERED_LAW}"\naxis = "y"\nacts_on = "force"\nexpression = "-4.1*abs(vy)**1.5*sign(vy)"\n'
        "```",
        "In a diagnosis it is the effect's `law`, with `expression`, `variables`, `acts_on` and `axis`. A law of the "
        "`force` is added to the force at its axis; one of a `command` or `response` takes the place of that "
        "axis' command or response.",
        f"The formula has Python's syntax and SI numbers: `+ - * / **`, parentheses, `pi`, and the functions {_PLAIN}. "
        "Four more have memory: `lag(s, tau_s)` (one pole), `play(s, half_width)` (follows s with play), "
        f"`delay(s, seconds)` (remembered at up to {CELLS} instants), `integral(s)`; the second argument is constant. "
        "In a force or response they begin as if their signals had always been what they are first, in a command from "
        "zero.",
        "Signals are `x`, `vx`, `ax`, `fx` (position, velocity, acceleration, command of the x axis; y, z "
        "likewise), `t` (seconds from the first sample), or the recording's own channels. Where these do not end in "
        "x, y, z, the axes are called so in their order. A law of the force may also use the recording's "
        "conditions, as `c1`, `c2`, … where a condition's channel is no such name, or means something else. A law "
        "of a command may use commands and `t`, one of a response responses and `t`.",
        "Numbers with a point or exponent (`4.1`, `1e-3`) are free: a fit may move them. Whole numbers (`2`) belong "
        f"to the form. A formula has up to {LONGEST} characters and {LARGEST} parts, and up to {DEEPEST} numbers at "
        "once. It compares nothing: `maximum(x - 0.01, 0)` is a stop, `(1 + sign(vx))/2` is 1 on the way up.",
    )
)


@dataclass(frozen=True, slots=True)
class Schema:
    """A file of docs/schemas: its name, what it describes, and the function that generates its JSON schema."""

    file: str
    describes: str
    make: Callable[[], dict[str, Any]]


def document_schema(payload: Mapping[str, Any], format_name: str, version: int) -> dict[str, Any]:
    """The schema of a whole JSON document: that of its own fields, with format, version and provenance added."""
    own = {"format": {"const": format_name}, "version": {"const": version}}
    return {
        **payload,
        "properties": {**own, **payload["properties"], "provenance": {"type": "object"}},
        "required": ["format", "version", *payload.get("required", ())],
    }


def request_schema() -> dict[str, Any]:
    """JSON schema of a request to a running session, with one alternative for each kind of request."""
    schemas = {kind: TypeAdapter(asked).json_schema() for kind, asked in KINDS.items()}
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
        "`answer.json`, what `hapteq real` says of one recording",
        lambda: document_schema(real_answer.real_answer_schema(), real_answer.FORMAT, real_answer.VERSION),
    ),
    Schema(
        "repeats.json",
        f"`*{repeats_file.SUFFIX}`, next to a table of forces that was found by repeating: errors per play, what the "
        "forces belong to",
        lambda: document_schema(repeats_file.REPEATS.json_schema(), repeats_file.FORMAT, repeats_file.VERSION),
    ),
    Schema(
        "reproduction.json",
        "`reproduction.json`, what `hapteq reproduce` found, compared with what the paper reports",
        lambda: document_schema(
            reproduction_document.reproduction_schema(), reproduction_document.FORMAT, reproduction_document.VERSION
        ),
    ),
    Schema(
        "live.json",
        "`live.json`, how a running session is right now; replaced several times a second",
        lambda: document_schema(TypeAdapter(Live).json_schema(), live_file.LIVE_FORMAT, live_file.LIVE_VERSION),
    ),
    Schema(
        "request.json",
        "one file in a session's `requests/`: what other programs ask of it, removed when it is read; a name that "
        "begins with `stop` is a stop, with any content",
        request_schema,
    ),
)
"""Schemas of all JSON formats and protocols. Each new JSON format must be added."""


def formats_markdown() -> str:
    """The text of docs/formats.md."""
    parts = [
        "# File formats",
        "This page is made from the code (`python -m study.workflows.files.format_docs docs`): change the code, not "
        "the page. `hapteq validate FILE` checks any of these files and says in words what is wrong.",
        "Every HDF5 file and every JSON document states its `format` and `version`; TOML and CSV are recognised by "
        f"their keys or header. Units: {ALLOWED}. `g` is standard gravity. Time is the first dimension of each array.",
        *_recordings(),
        "## Identified model (`.h5`)",
        _table(identified_model_file.LAYOUT),
        "## Calibration of a linkage (`.h5`)",
        CALIBRATION_ABOUT,
        _table(CALIBRATION_LAYOUT),
        *_mechanical_models(),
        "## Effects",
        "Names of physics that a model may have or lack, with the parameters in order, the main one first; units of "
        "translational and rotational models. Further names may appear in a diagnosis.",
        _effects(),
        "## Laws without a name",
        LAWS,
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
    yield "Each of `command`, `response`, `position`, `excitation`, `condition` carries:"
    yield _table(recording_layout.SIGNAL_ATTRIBUTES)
    yield "A row of `segments`:"
    yield _table(recording_layout.SEGMENT_FIELDS)
    yield (
        "A plant with direct feedthrough answers `command[k-1]`. When the sensor is faster than the command, the "
        "command repeats. NaN is a missing sample; an analysis that cannot use it says so. Segments must not overlap."
    )


def _mechanical_models() -> Iterable[str]:
    yield "## Mechanical model (`.toml`)"
    yield "Further keys are refused."
    yield _table(mechanical_model_file.LAYOUT)


_RESPONSE = "the response's unit"


def _parameter(part: EffectParameter) -> str:
    unit = part.unit_in(LINEAR, _RESPONSE)
    return f"`{part.name}` ({unit}, optional)" if part.optional else f"`{part.name}` ({unit})"


def _effects() -> str:
    rows = []
    for effect in EFFECT_NAMES:
        numbers = ", ".join(_parameter(part) for part in effect.parameters)
        turned = ", ".join(part.unit_in(ROTATIONAL, _RESPONSE) for part in effect.parameters)
        rows.append((f"`{effect.name}`", effect.place, numbers, turned))
    return _rows(("effect", "place", "parameters", "rotational units"), rows)


_TABLES: tuple[tuple[str, type[Trial] | type[Threshold], str], ...] = (
    (
        "trials.csv",
        Trial,
        "One row per presentation; more columns may follow. `felt` is false where a person answered while no device "
        "moved, empty for simulated ones. `direction_shown` and `answer` are numbers on the screen (`angle_deg` tells "
        "the direction), in the phase `detection` intervals. In `catch` the level is the cap; no staircase moves.",
    ),
    (
        "thresholds.csv",
        Threshold,
        "One row per run. `threshold_n` is the arithmetic mean of the averaged levels in newtons, `threshold_db` the "
        "mean of the same levels in dB re 1 N; then the same threshold in delivered m/s² and mm. `detection.csv` has "
        "the same columns, one row per detection run; its `d_prime` is that of two intervals.",
    ),
)


def _tables() -> Iterable[str]:
    yield "## Trajectory and forces (`.csv`)"
    yield _rows(
        ("header", "holds"), [(f"`{','.join(kind.header)}`", f"{kind.quantity}, {kind.unit}") for kind in TABLE_KINDS]
    )
    yield (
        f"The rate is constant (each step within {STEP_TOLERANCE:.0%} of the mean one) and the model's; rows of forces "
        "answer rows of the trajectory one to one."
    )
    for name, row_type, about in _TABLES:
        yield f"## `{name}`"
        yield about
        hints = get_type_hints(row_type)
        yield _rows(("column", "holds"), [(f"`{column}`", in_words(hints[column])) for column in columns(row_type)])


def _table(entries: Iterable[Entry]) -> str:
    rows = [(f"`{entry.name}`", entry.holds, entry.meaning, "yes" if entry.required else "no") for entry in entries]
    return _rows(("name", "holds", "meaning", "required"), rows)


def _rows(heading: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [heading, tuple("---" for _ in heading), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


if __name__ == "__main__":
    write_documents(Path(sys.argv[1]))
