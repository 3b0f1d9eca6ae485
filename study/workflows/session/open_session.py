"""Open a session: create its folder and its log, whose first event states everything that determines the session.

These are the protocol, seed, device, equalizer and software versions: an interrupted session is resumed from its log.
"""

import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from protocols.definition.study_protocol import StudyProtocol
from protocols.document.hashing import hash_protocol
from study.devices.clock import Clock
from study.devices.device import DeviceInfo
from study.session.facts.events import SESSION_FORMAT, SESSION_VERSION, DeviceFacts, SessionOpened
from study.session.state.rules import LATEST_RULES
from study.session.state.state import SessionState, begin_session
from study.store.disk.provenance import list_versions
from study.store.sessions.archive import SessionFolder, create_session_folder
from study.store.sessions.event_log import EventLog
from study.store.sessions.session_lock import hold_session_lock
from study.workflows.session.equalize_stimuli import SessionEqualizer, copy_model
from study.workflows.session.other_session_dose import compute_other_session_dose
from study.workflows.session.participant_number import find_participant_number


@dataclass(frozen=True, slots=True)
class SessionPlan:
    """Settings of a new session, apart from the device."""

    protocol: StudyProtocol
    protocol_text: str
    """Complete text of the protocol (TOML), for the log."""
    protocol_locked: bool
    """Whether the protocol has a lock file, whose hash it matches (`protocols.document.lock`)."""
    subject: str
    """Participant code, such as P01."""
    observer: str | None
    """Name of the simulated participant; None for a person."""
    seed: int
    """Seed of the session's random draws."""
    data_folder: Path
    """Folder in which the session folder is created."""
    participant_number: int | None = None
    """Place in a balanced order of conditions, from 0; None: from the sessions in the data folder."""
    model: Path | None = None
    """Identified model that equalizes the stimuli; None where forces are commanded."""


@dataclass(frozen=True, slots=True)
class OpenedSession:
    """A locked session: its folder, its log open for appending, and its state."""

    folder: SessionFolder
    log: EventLog
    state: SessionState


def draw_seed() -> int:
    """Draw a random seed of 32 bits from the operating system."""
    return secrets.randbits(32)


@contextmanager
def open_session(
    plan: SessionPlan, device: DeviceInfo, session_equalizer: SessionEqualizer, clock: Clock
) -> Iterator[OpenedSession]:
    """Create a session: its folder, a copy of the model, if any, and its log with the first event. The session is
    locked, and the log open, while the context lasts. Raises StudyError."""
    participant_number = plan.participant_number
    if participant_number is None:
        participant_number = find_participant_number(
            plan.data_folder, plan.subject, plan.protocol.name, plan.observer is not None
        )
    folder = create_session_folder(plan.data_folder, plan.subject)
    utc = clock.utc()
    session_opened = SessionOpened(
        utc=utc,
        format=SESSION_FORMAT,
        version=SESSION_VERSION,
        session=folder.name,
        subject=plan.subject,
        participant_number=participant_number,
        observer=plan.observer,
        protocol_text=plan.protocol_text,
        protocol_hash=hash_protocol(plan.protocol),
        protocol_locked=plan.protocol_locked,
        seed=plan.seed,
        device=collect_device_facts(device),
        equalizer=session_equalizer.equalizer.name,
        versions=list_versions(),
        equalized=session_equalizer.facts,
        monotonic_s=clock.now_s(),
        dose_elsewhere=compute_other_session_dose(folder, plan.observer, device.simulated, utc),
        rules=LATEST_RULES,
    )
    with hold_session_lock(folder.path):
        copy_model(session_equalizer, folder)
        log = EventLog.create(folder.log)
        try:
            log.append(session_opened)
            yield OpenedSession(folder, log, begin_session(session_opened, plan.protocol))
        finally:
            log.close()


def collect_device_facts(info: DeviceInfo) -> DeviceFacts:
    """Collect the facts about the device that the log records when a session is opened or resumed."""
    return DeviceFacts(
        name=info.name, simulated=info.simulated, sample_rate_hz=info.sample_rate_hz, details=info.details
    )
