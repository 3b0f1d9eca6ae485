"""Hash of a protocol: identifies the settings of a study, independent of the formatting of its file.

Sessions, locks (`protocols.document.lock`) and recordings store it, so that a changed protocol is detected. Settings
that later versions added to the format enter the hash only where they differ from their defaults, so that old hashes
stay valid: the tables `*_ADDITIONS` list them.
"""

import hashlib
import json
from typing import Any

from protocols.definition.declared_analysis import AnalysisSettings
from protocols.definition.participant_text import TextSettings
from protocols.definition.plausibility import PLAUSIBILITY_DEFAULTS
from protocols.definition.preparation import (
    ConsentSettings,
    DemoSettings,
    MaskingSettings,
    PracticeSettings,
    SetupSettings,
)
from protocols.definition.probes import ProbeSettings
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.session_settings import CatchSettings, DetectionSettings, GateSettings, SittingLimits
from protocols.definition.study_protocol import StudyProtocol
from protocols.document.dumping import protocol_to_values

DefaultValue = str | float | bool | list[Any] | dict[str, Any]
"""Default value of a field, as in JSON."""

TABLE_ADDITIONS = {
    "consent": ConsentSettings(),
    "setup": SetupSettings(),
    "masking": MaskingSettings(),
    "demo": DemoSettings(),
    "practice": PracticeSettings(),
    "detection": DetectionSettings(),
    "catch": CatchSettings(),
    "gate": GateSettings(),
    "limits": SittingLimits(),
    "probes": ProbeSettings(),
    "analysis": AnalysisSettings(),
    "text": TextSettings(),
    "before": (),
    "debrief": (),
}
"""Tables of a study protocol added after the first locks and sessions, with their defaults. A table at its defaults is
left out of the hash."""

SAFETY_ADDITIONS: dict[str, DefaultValue] = {"safety.feedback_cap_n": 1.5, "safety.plausibility": PLAUSIBILITY_DEFAULTS}
"""Safety settings added later to both kinds of protocol, with their defaults; forces in N."""

FIELD_ADDITIONS: dict[str, dict[str, DefaultValue]] = {
    "study": {
        **SAFETY_ADDITIONS,
        "trial.device_buttons": [],
        "trial.repeats_per_run": 3,
        "demo.rove_db": 0.0,
        "practice.rove_db": 0.0,
        "stimulus.rove_db": 0.0,
        "measurement.late_ticks_limit": 1.0,
        "measurement.longest_late_ms": 1000.0,
        "measurement.lost_packets_limit": 0.05,
        "measurement.accelerometer_needed": False,
        "setup.daily_check_needed": False,
        "debrief.codes": [],
        "debrief.number": [],
        "debrief.unit": "",
        "debrief.scale": [],
        "debrief.ends": [],
        "staircase.bayesian": {"trials": 0, "spread_db": 0.0},
        "analysis.interval": "undeclared",
    },
    "recording": {**SAFETY_ADDITIONS, "lower_on_clip": True, "least_amplitude_n": 0.2, "segments.role": ""},
}
"""Fields added after the first locks and sessions, with their default values, by kind of protocol and dotted path. A
path through a list, such as `segments.role`, applies to every entry."""


def hash_protocol(protocol: StudyProtocol | RecordingProtocol) -> str:
    """Compute the SHA-256 (64 hexadecimal digits) of all values as canonical JSON: keys sorted, no white space.

    Comments, the order of keys, and whether a default is written out make no difference; title and source do, because
    they are fixed before data are taken. Defaults are included, except those of `*_ADDITIONS`. Raises ValueError where
    a value is NaN or infinite.
    """
    values = protocol_to_values(protocol)
    if isinstance(protocol, StudyProtocol):
        for name, default in TABLE_ADDITIONS.items():
            if getattr(protocol, name) == default:
                del values[name]
    for path, default in FIELD_ADDITIONS[protocol.kind].items():
        _delete_default(values, path.split("."), default)
    # JSON writes 0.0 and -0.0 differently, though the values are equal; adding 0.0 turns -0.0 into 0.0.
    json_text = json.dumps(values, sort_keys=True, separators=(",", ":"), allow_nan=False)
    normalised_values = json.loads(json_text, parse_float=lambda digits: float(digits) + 0.0)
    canonical_json = json.dumps(normalised_values, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(canonical_json.encode()).hexdigest()


def _delete_default(values: Any, path: list[str], default: DefaultValue) -> None:
    """Delete the field at a path from nested dicts and lists, in place, where it has its default value; in a list, from
    each entry. An absent field is ignored."""
    if isinstance(values, list):
        for entry in values:
            _delete_default(entry, path, default)
    elif len(path) > 1:
        if path[0] in values:
            _delete_default(values[path[0]], path[1:], default)
    elif values.get(path[0]) == default:
        del values[path[0]]
