"""Input of one analysis or export: trials and facts about their sessions, collected from session folders
(`collect_sessions`) or from an exported dataset (`collect_exported`)."""

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
    """By `hash_protocol`."""
    trials: tuple[Trial, ...]
    sessions: tuple[SessionFolder, ...]
    """Sessions of the trials; for an export, folders of these names beside its files, which need not exist."""
    seeds: tuple[int, ...]
    """Random seeds of `sessions`, in the same order; 0 where an export does not state it."""
    devices: tuple[str, ...]
    """Names of the devices that were used, without repetition."""
    observers: tuple[str, ...]
    """Names of the simulated participants; empty for people."""
    exclusions: tuple[str, ...]
    """Sentences on sessions and trials that were excluded, each with the reason."""
    model_qualities: tuple[tuple[str, str], ...]
    """(names of sessions, sentence) on the quality of each model that equalized their stimuli; empty where forces were
    commanded without a model."""
    lock_statement: str
    """Whether the protocol was locked when its sessions began, in words: "yes", "no: ...", "for 2 of 5 sessions"; "not
    known" where an export does not state it."""
    result_file_notes: tuple[str, ...]
    """Sentences on result files of sessions that were missing or out of date: written now, or why they could not be."""
    input_paths: tuple[Path, ...]
    """Input files, for the provenance."""
    forms: tuple[FilledForm, ...] = ()
    """Answers to the protocol's questions; empty for an exported dataset."""
