"""What enters one analysis, wherever its trials were read from."""

from dataclasses import dataclass
from pathlib import Path

from protocols.definition.study_protocol import StudyProtocol
from protocols.trial import Trial
from study.store.sessions.archive import SessionFolder


@dataclass(frozen=True, slots=True)
class Collected:
    protocol: StudyProtocol
    protocol_hash: str
    trials: tuple[Trial, ...]
    sessions: tuple[SessionFolder, ...]
    seeds: tuple[int, ...]
    devices: tuple[str, ...]
    """Names of all devices that were used."""
    observers: tuple[str, ...]
    """Names of the simulated participants; empty for people."""
    left_out: tuple[str, ...]
    """What did not enter, and why, in sentences."""
    qualities: tuple[tuple[str, str], ...]
    """Of the models that stimuli went through: (sessions, sentence), by what was measured; none for plain forces."""
    locked: str
    """Whether the protocol was locked when its sessions began."""
    finished: tuple[str, ...]
    """What was written now, because the program was killed before it was done, in sentences."""
    parents: tuple[Path, ...]
    """Files that the trials were read from."""
