"""The experiment: numbers and rules that are fixed before a participant takes part. Pure; imports none of our other
packages.

Folders: `definition` (schema of a TOML file), `wording` (texts for participants) -> `document` (text to protocol and
back, hash, lock) -> `procedure` (order, levels, random draws). Read in this order:

`staircase_rule` and `staircase` (the rule that decides the next level), `study_protocol` and `recording_protocol`
(schemas of TOML files), `schedule` (order and draws from keys), `trial` (one row of the results), `loading` (text to
protocol, every problem named), `hashing` and `lock` (fixed before data).

Decisions:

2026-11-21. Draws are keyed by (run, trial, attempt) and never sequential: a repeated or resumed trial shifts nothing.
2026-11-21. Defaults are filled in before a protocol is hashed, so a new field changes every hash: bump versions then.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from protocols.definition.recording_protocol import RecordingProtocol as RecordingProtocol
    from protocols.definition.staircase_rule import StaircaseRule as StaircaseRule
    from protocols.definition.study_protocol import StudyProtocol as StudyProtocol
    from protocols.document.dumping import dump_protocol as dump_protocol
    from protocols.document.loading import load_protocol as load_protocol
    from protocols.procedure.schedule import runs as planned_runs
    from protocols.procedure.staircase import begin as begin_staircase
    from protocols.procedure.staircase import level_n as staircase_level_n
    from protocols.procedure.staircase import step as step_staircase
    from protocols.trial import Trial as Trial

_HOME = {
    "RecordingProtocol": "protocols.definition.recording_protocol:RecordingProtocol",
    "StaircaseRule": "protocols.definition.staircase_rule:StaircaseRule",
    "StudyProtocol": "protocols.definition.study_protocol:StudyProtocol",
    "Trial": "protocols.trial:Trial",
    "begin_staircase": "protocols.procedure.staircase:begin",
    "dump_protocol": "protocols.document.dumping:dump_protocol",
    "load_protocol": "protocols.document.loading:load_protocol",
    "planned_runs": "protocols.procedure.schedule:runs",
    "staircase_level_n": "protocols.procedure.staircase:level_n",
    "step_staircase": "protocols.procedure.staircase:step",
}
"""Module and name of what is exported; imported when it is asked for, because a module may take seconds."""

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
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, own = _HOME[name].partition(":")
    return getattr(import_module(module), own)


def __dir__() -> list[str]:
    return sorted(__all__)
