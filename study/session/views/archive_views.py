"""Data classes that the start screen and the viewers of past sessions and diagnoses show.

They hold plain values and import no analysis, so that a screen opens quickly. `study.workflows.views` fills them from
the files.
"""

from dataclasses import dataclass
from typing import Literal

SessionStatus = Literal["finished", "unfinished", "running", "refused", "excluded", "withdrawn", "unreadable"]
"""Status of a session. `running`: a program is writing its log; `refused`, `excluded`: the participant did not take
part, see `INELIGIBILITY_REASONS`; `withdrawn`: the data were erased, and only a note of the withdrawal is kept;
`unreadable`: the log is missing or damaged."""

INELIGIBILITY_REASONS = {
    "refused": "consent was not given",
    "excluded": "a question of the exclusion list was answered with yes",
}
"""Why a participant did not take part, in words."""


@dataclass(frozen=True, slots=True)
class SessionLine:
    """One session in a list."""

    name: str
    path: str
    subject: str
    protocol: str
    begun_utc: str
    """Time of the opening, UTC; of the last change where the session cannot be read."""
    observer: str | None
    """Name of the simulated participant; None for a person."""
    answers: int
    """Number of answers in the log."""
    runs_done: int
    runs: int
    """Number of runs in the plan."""
    standing: SessionStatus
    remark: str = ""
    """Note for the list, such as the reason why the session cannot be read."""


@dataclass(frozen=True, slots=True)
class ProtocolLine:
    """A protocol as a line of the start screen."""

    name: str
    """Name or path, as `--protocol` takes it."""
    title: str
    locked: bool
    equalized: bool = False
    """Whether its stimuli are accelerations, which need a model of the device."""


@dataclass(frozen=True, slots=True)
class HomeView:
    """What the start screen offers."""

    data: str
    sessions: tuple[SessionLine, ...]
    """Latest first."""
    protocols: tuple[ProtocolLine, ...]
    devices: tuple[str, ...]
    models: tuple[str, ...] = ()
    """Files of identified models."""
    qualities: tuple[tuple[str, str], ...] = ()
    """Held-out errors of the models in a few words: (file, words)."""

    def quality_of(self, model: str) -> str:
        """Held-out error of a model's file in words; empty where it is not known."""
        return dict(self.qualities).get(model, "")


@dataclass(frozen=True, slots=True)
class Staircase:
    """One run, as a plot needs it. Its tuples have one entry per trial that counts; levels are forces in N."""

    title: str
    levels_n: tuple[float, ...]
    correct: tuple[bool, ...]
    reversals: tuple[bool, ...]
    """Whether the staircase turned at that trial."""
    threshold_n: float | None
    """None where the run is not complete."""
    cap_n: float
    """Highest level that the protocol allows."""


@dataclass(frozen=True, slots=True)
class SessionView:
    """Details of one session."""

    line: SessionLine
    facts: tuple[tuple[str, str], ...]
    """(what, value): participant, protocol, device, seed, dates."""
    thresholds: tuple[tuple[str, ...], ...]
    """Rows of text, the first one the header; empty without a complete run."""
    warnings: tuple[str, ...]
    staircases: tuple[Staircase, ...]
    events: tuple[str, ...]
    """The log in words, oldest first; the direction of an open trial is left out."""
    report: str
    """Path of report.html; empty where none was written yet."""
    figures: tuple[str, ...]
    """Paths of PNG files."""


@dataclass(frozen=True, slots=True)
class DiagnosisView:
    """Contents of one `diagnosis.json`."""

    path: str
    verdict: str
    sentences: tuple[str, ...]
    """One per named effect, with parameters and intervals."""
    rivals: tuple[str, ...]
    """Effects that explain the recordings as well, one sentence each."""
    mismatch: tuple[tuple[str, ...], ...]
    """Where model and recording differ. This and the next two: rows of text, the first one the header."""
    fit: tuple[tuple[str, ...], ...]
    """Errors before, re-tuned and with the effects."""
    remainder: tuple[tuple[str, ...], ...]
    """Errors that the effects leave above the noise."""
    next_experiment: str
    report: str = ""
    """Path of the report.html in the same folder; empty where there is none."""
    notes: tuple[str, ...] = ()
    """Remarks, such as how errors were measured and what was re-tuned."""
    candidates: tuple[str, ...] = ()
    """Effects that were not confirmed, the best first, without one that the verdict already states."""
