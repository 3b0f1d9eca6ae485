"""Data of one analysis, from sessions or an exported dataset."""

from dataclasses import dataclass
from pathlib import Path

from protocols.definition.study_protocol import StudyProtocol
from protocols.trial import Trial
from study.store.formats.answer_table import FilledForm
from study.store.sessions.archive import SessionFolder


@dataclass(frozen=True, slots=True)
class CollectedTrials:
    """Trials that are analysed together, all of the same protocol, and facts about their sessions."""

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
    """What was excluded, and why, in sentences."""
    qualities: tuple[tuple[str, str], ...]
    """Quality of the models that equalized the stimuli: (sessions, sentence); none for plain forces."""
    locked: str
    """Whether the protocol was locked when its sessions began."""
    finished: tuple[str, ...]
    """Results that had to be completed now, because the program had been killed, in sentences."""
    parents: tuple[Path, ...]
    """Input files."""
    forms: tuple[FilledForm, ...] = ()
    """Answers to the protocol's questions."""
