"""Sessions, devices, files, participants and screens: the only package with side effects.

Layers, each importing only those after it: `cli`, `tui`, `evaluation`, `workflows`, `importing`, `devices`, then
`store` and `participants` (independent of each other), then `local_clock`, `session` (without side effects),
`regular_file` and `errors`. The command `hapteq` starts in `cli.main`.

Read in this order: `session.facts.events` (logged events, called facts), `session.state.fold` (the state that follows
from them), `session.state.machine` (the next action), `workflows.session.run_session` and
`workflows.trial.present_trial` (its execution), `devices.device` (interface of a device), `devices.governor.govern`
(force limits) and `store.sessions.event_log` (facts are on disk before the program acts on them).

Decisions:

2026-11-21. The staircase is updated when the measurement of a trial is complete, not at the answer: a trial that the
device spoiled must be void although it was answered. An answer whose measurement was lost in a crash counts.
2026-11-21. A display must not know level, frequency or correctness: its views have no field for them.
2026-11-21. A simulated participant receives what it feels through the interface `Hand`; a person feels the device.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from study.errors import StudyError as StudyError
    from study.store.formats.identified_model_file import read_identified_model as read_identified_model
    from study.store.formats.identified_model_file import write_identified_model as write_identified_model
    from study.store.formats.mechanical_model_file import read_mechanical_model as read_mechanical_model
    from study.store.formats.mechanical_model_file import write_mechanical_model as write_mechanical_model
    from study.store.formats.protocol_files import read_protocol as read_protocol
    from study.store.formats.protocol_files import read_study_protocol as read_study_protocol
    from study.store.formats.recording_file import read_recording as read_recording
    from study.store.formats.recording_file import write_recording as write_recording
    from study.store.formats.trials_file import read_trials as read_trials
    from study.workflows.recording.import_recording import ImportPlan as ImportPlan
    from study.workflows.recording.import_recording import import_recording as import_recording
    from study.workflows.recording.record_device import RecordingPlan as RecordingPlan
    from study.workflows.recording.record_device import record_device as record_device
    from study.workflows.results.analyze_data import analyze_data as analyze_data
    from study.workflows.session.rehearse_study import Rehearsal as Rehearsal
    from study.workflows.session.rehearse_study import rehearse_study as rehearse_study
    from study.workflows.session.simulate_session import simulate_session as simulate_session

_HOME = {
    "ImportPlan": "study.workflows.recording.import_recording:ImportPlan",
    "RecordingPlan": "study.workflows.recording.record_device:RecordingPlan",
    "Rehearsal": "study.workflows.session.rehearse_study:Rehearsal",
    "StudyError": "study.errors:StudyError",
    "analyze_data": "study.workflows.results.analyze_data:analyze_data",
    "import_recording": "study.workflows.recording.import_recording:import_recording",
    "read_identified_model": "study.store.formats.identified_model_file:read_identified_model",
    "read_mechanical_model": "study.store.formats.mechanical_model_file:read_mechanical_model",
    "read_protocol": "study.store.formats.protocol_files:read_protocol",
    "read_recording": "study.store.formats.recording_file:read_recording",
    "read_study_protocol": "study.store.formats.protocol_files:read_study_protocol",
    "read_trials": "study.store.formats.trials_file:read_trials",
    "record_device": "study.workflows.recording.record_device:record_device",
    "rehearse_study": "study.workflows.session.rehearse_study:rehearse_study",
    "simulate_session": "study.workflows.session.simulate_session:simulate_session",
    "write_identified_model": "study.store.formats.identified_model_file:write_identified_model",
    "write_mechanical_model": "study.store.formats.mechanical_model_file:write_mechanical_model",
    "write_recording": "study.store.formats.recording_file:write_recording",
}
"""Module and name of each export. A module is imported at the first access, because the import may take seconds."""

__all__ = [
    "ImportPlan",
    "RecordingPlan",
    "Rehearsal",
    "StudyError",
    "analyze_data",
    "import_recording",
    "read_identified_model",
    "read_mechanical_model",
    "read_protocol",
    "read_recording",
    "read_study_protocol",
    "read_trials",
    "record_device",
    "rehearse_study",
    "simulate_session",
    "write_identified_model",
    "write_mechanical_model",
    "write_recording",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = _HOME[name].partition(":")
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted(__all__)
