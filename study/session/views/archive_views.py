"""Data classes of the start screen and of the viewers of past sessions and diagnoses.

They contain plain values and import no analysis, so that a screen opens quickly. `study.workflows.views` fills them
from files.
"""

from dataclasses import dataclass
from typing import Literal

SessionStatus = Literal["finished", "unfinished", "running", "refused", "excluded", "withdrawn", "unreadable"]
"""Status of a session. `running`: a program has its log open; `refused`, `excluded`: the participant did not take
part, see `INELIGIBILITY_REASONS`; `withdrawn`: the data were erased, and only a note of the withdrawal is kept;
`unreadable`: the log is missing, damaged, or cannot be used for another reason."""

INELIGIBILITY_REASONS = {
    "refused": "consent was not given",
    "excluded": "a question of the exclusion list was answered with yes",
}
"""Reason, as a clause, for each status of a person who did not take part; also the reason with which a sitting ends."""


@dataclass(frozen=True, slots=True)
class SessionLine:
    """A session as a line of a list."""

    name: str
    """Name of the session, such as P01_001."""
    path: str
    """Path of the session's folder."""
    subject: str
    """Participant code."""
    protocol: str
    begun_utc: str
    """Time (UTC, ISO 8601) at which the session was opened; for a withdrawn session the time of the withdrawal, for an
    unreadable one the time of the last change of its folder (empty if not known)."""
    observer: str | None
    """Name of the simulated participant; None for a person."""
    answers: int
    """Number of answers in the log that count; 0, like the next two numbers, for a withdrawn session and for one of
    which no number can be read."""
    runs_done: int
    """Number of completed runs."""
    runs: int
    """Number of runs in the plan."""
    standing: SessionStatus
    remark: str = ""
    """Note for the list, such as the reason why the session cannot be read."""
    device: str = ""
    """Name of the device on which the session was begun; empty for a withdrawn or unreadable session."""


@dataclass(frozen=True, slots=True)
class ProtocolLine:
    """A protocol as a line of the start screen."""

    name: str
    """Name or path, as `--protocol` takes it."""
    title: str
    """Title, or why the protocol cannot be used."""
    locked: bool
    """Whether the protocol is locked against changes."""
    equalized: bool = False
    """Whether its stimuli are accelerations, which need a model of the device."""


@dataclass(frozen=True, slots=True)
class HomeView:
    """Contents of the start screen."""

    data: str
    """Path of the data folder."""
    sessions: tuple[SessionLine, ...]
    """Sessions of the folder, latest first."""
    protocols: tuple[ProtocolLine, ...]
    devices: tuple[str, ...]
    """Names of devices, as `--device` takes them."""
    models: tuple[str, ...] = ()
    """Paths of files of identified models."""
    qualities: tuple[tuple[str, str], ...] = ()
    """(path of a model file, its quality in words: held-out error, or misfit of an untested model, or why the file
    cannot be used)."""

    def describe_quality(self, model: str) -> str:
        """Describe the quality of the model in this file, as in `qualities`; empty for a file that is not listed."""
        return dict(self.qualities).get(model, "")


@dataclass(frozen=True, slots=True)
class Staircase:
    """One run of a staircase, for a plot. Its tuples have one entry per trial that counts, in order, without catch
    trials."""

    title: str
    levels_n: tuple[float, ...]
    """Level of the staircase at each trial (N), before roving."""
    correct: tuple[bool, ...]
    reversals: tuple[bool, ...]
    """Whether the staircase reversed at that trial."""
    threshold_n: float | None
    """Estimated threshold (N); None where the run is not complete or has no estimate."""
    cap_n: float
    """Highest level (N) that the protocol allows."""


@dataclass(frozen=True, slots=True)
class SessionView:
    """Details of one session."""

    line: SessionLine
    facts: tuple[tuple[str, str], ...]
    """(label, value): participant, protocol, device, seed, dates and others; only participant and folder of a withdrawn
    or unreadable session."""
    thresholds: tuple[tuple[str, ...], ...]
    """Rows of text, the first one the header; empty without a complete run."""
    warnings: tuple[str, ...]
    """Sentences about problems of the session, such as a log without checksums."""
    staircases: tuple[Staircase, ...]
    events: tuple[str, ...]
    """The log in words, oldest first; the direction of an open or void trial is left out."""
    report: str
    """Path of report.html; empty where none was written yet."""
    figures: tuple[str, ...]
    """Paths of PNG files."""


@dataclass(frozen=True, slots=True)
class DiagnosisView:
    """Contents of one `diagnosis.json`."""

    path: str
    verdict: str
    """Result in one sentence."""
    sentences: tuple[str, ...]
    """For each named effect: its parameters with intervals, its share and probability, and the effects that the data
    cannot distinguish from it."""
    rivals: tuple[str, ...]
    """For each named effect: the other effects that were considered and rejected, with probability and reason, one
    sentence each."""
    mismatch: tuple[tuple[str, ...], ...]
    """Differences of model and recording, as rows of text, the first one the header; empty without any."""
    fit: tuple[tuple[str, ...], ...]
    """Errors of the given model, of the re-tuned model, and of the model with the effects, and the noise between
    repeats, as rows like `mismatch`."""
    remainder: tuple[tuple[str, ...], ...]
    """Errors above the noise that the effects do not explain, as rows like `mismatch`."""
    next_experiment: str
    """Recommended next recording, in words; empty without a recommendation."""
    report: str = ""
    """Path of the report.html in the same folder; empty where there is none."""
    notes: tuple[str, ...] = ()
    """Remarks, such as how errors were measured and what was re-tuned."""
    candidates: tuple[str, ...] = ()
    """The best few effects that were not confirmed, the best first, except one that the verdict states."""
