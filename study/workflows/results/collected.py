"""Input of one analysis: trials and facts about their sessions, collected from session folders (`collect_sessions`) or
from an exported dataset (`collect_exported`)."""

from dataclasses import dataclass
from pathlib import Path

from protocols.definition.study_protocol import StudyProtocol
from protocols.trial import Trial
from study.store.formats.answer_table import FilledForm
from study.store.sessions.archive import SessionFolder


@dataclass(frozen=True, slots=True)
class CollectedTrials:
    """Trials of one protocol and one population that are analysed together, and facts about their sessions."""

    protocol: StudyProtocol
    protocol_hash: str
    trials: tuple[Trial, ...]
    sessions: tuple[SessionFolder, ...]
    seeds: tuple[int, ...]
    """Seeds of the sessions, in the same order."""
    devices: tuple[str, ...]
    """Names of all devices that were used."""
    observers: tuple[str, ...]
    """Names of the simulated participants; empty for people."""
    left_out: tuple[str, ...]
    """Sentences on what was excluded, and why."""
    qualities: tuple[tuple[str, str], ...]
    """(sessions, sentence) on the quality of each model that equalized stimuli; empty where forces were commanded."""
    locked: str
    """Whether the protocol was locked when its sessions began, in words."""
    finished: tuple[str, ...]
    """Sentences on result files that were missing or out of date and have been written now."""
    parents: tuple[Path, ...]
    """Input files, for the provenance."""
    forms: tuple[FilledForm, ...] = ()
    """Answers to the protocol's questions."""
