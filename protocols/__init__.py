"""Protocols of experiments: numbers and rules that are fixed before a participant takes part. Nothing here reads or
writes files, or imports another package of this project. Used by `analysis` and `study`.

Folders: `definition` (schema of a TOML file), `wording` (texts for participants) -> `document` (text to protocol and
back, hash, lock) -> `procedure` (order, levels, random draws). `trial` is one row of the results. Read in this order:
`definition.staircase_rule` and `procedure.staircase` (rule for the next level), `definition.study_protocol` and
`definition.recording_protocol` (schemas), `procedure.schedule` (order and random draws), `document.loading` (text to
protocol, with all problems listed), `document.hashing` and `document.lock` (proof that a protocol was fixed before data
were recorded).

Decisions:

2026-11-21. Random draws are keyed by (run, trial, attempt), never sequential: a repeated trial changes no later draw.
2026-11-21. Defaults are filled in before a protocol is hashed. A field added later enters the hash only where it
differs from its default (`document.hashing`), so that old hashes stay valid.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from protocols.definition.recording_protocol import RecordingProtocol as RecordingProtocol
    from protocols.definition.staircase_rule import StaircaseRule as StaircaseRule
    from protocols.definition.study_protocol import StudyProtocol as StudyProtocol
    from protocols.document.dumping import dump_protocol as dump_protocol
    from protocols.document.loading import load_protocol as load_protocol
    from protocols.procedure.schedule import schedule_runs as planned_runs
    from protocols.procedure.staircase import begin_staircase as begin_staircase
    from protocols.procedure.staircase import compute_level_n as staircase_level_n
    from protocols.procedure.staircase import step as step_staircase
    from protocols.trial import Trial as Trial

_HOME = {
    "RecordingProtocol": "protocols.definition.recording_protocol:RecordingProtocol",
    "StaircaseRule": "protocols.definition.staircase_rule:StaircaseRule",
    "StudyProtocol": "protocols.definition.study_protocol:StudyProtocol",
    "Trial": "protocols.trial:Trial",
    "begin_staircase": "protocols.procedure.staircase:begin_staircase",
    "dump_protocol": "protocols.document.dumping:dump_protocol",
    "load_protocol": "protocols.document.loading:load_protocol",
    "planned_runs": "protocols.procedure.schedule:schedule_runs",
    "staircase_level_n": "protocols.procedure.staircase:compute_level_n",
    "step_staircase": "protocols.procedure.staircase:step",
}
"""Module and name of each exported object, imported at first use, because importing a module may take seconds."""

__all__ = [
    "RecordingProtocol",
    "StaircaseRule",
    "StudyProtocol",
    "Trial",
    "begin_staircase",
    "dump_protocol",
    "load_protocol",
    "planned_runs",
    "staircase_level_n",
    "step_staircase",
]


def __getattr__(name: str) -> Any:
    """Import an exported object at first use (PEP 562). Raises AttributeError for another name."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = _HOME[name].partition(":")
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    """Names of the exported objects."""
    return sorted(__all__)
