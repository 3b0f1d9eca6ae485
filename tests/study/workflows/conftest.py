"""A small session that a test can begin, leave and go on with, in virtual time."""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from protocols.definition.study_protocol import StudyProtocol
from study.devices.clock import VirtualClock
from study.participants.observer_catalogue import find_observer
from study.session.views.participant_views import Answered, Reply, Unanswered
from study.store.sessions.archive import SessionFolder
from study.workflows.session.conduct_session import ConductedSitting, Participant, conduct_new, conduct_resumed
from study.workflows.session.open_session import SessionPlan
from study.workflows.session.simulated_display import SimulatedDisplay


class LeavesAfter:
    """A simulated participant who does something else than answering at one question."""

    def __init__(self, display: SimulatedDisplay, questions: int, instead) -> None:
        self._display = display
        self._left = questions
        self._instead = instead
        self.sentences: list[str] = []

    def ask(self, question, sign_of_life) -> Reply:
        if self._left == 0:
            self._left = -1
            return self._instead()
        self._left -= 1
        return self._display.ask(question, sign_of_life)

    def trouble(self, sentence: str) -> None:
        self.sentences.append(sentence)

    def __getattr__(self, name: str):
        return getattr(self._display, name)


@dataclass
class SittingOptions:
    """Conducts sessions of the small protocol below one data folder."""

    data: Path
    protocol: StudyProtocol
    text: str
    observer: str = "scripted"
    seed: int = 11

    def plan(self, subject: str = "P01", observer: str | None = "scripted") -> SessionPlan:
        return SessionPlan(self.protocol, self.text, False, subject, observer, self.seed, self.data)

    def participant(self, after: int | None = None, instead=None) -> Participant:
        clock = VirtualClock()
        display = SimulatedDisplay(find_observer(self.observer, self.seed), self.seed, clock)
        shown = display if after is None else LeavesAfter(display, after, instead)
        return Participant(display=shown, hand=display, clock=clock)

    def whole(self, subject: str = "P01") -> ConductedSitting:
        return conduct_new(self.plan(subject), "simulated", self.participant())

    def interrupted(self, after: int, instead=None) -> ConductedSitting:
        leave = instead or (lambda: Unanswered("the participant left", ends_sitting=True))
        return conduct_new(self.plan(), "simulated", self.participant(after, leave))

    def resumed(self, folder: SessionFolder) -> ConductedSitting:
        return conduct_resumed(folder, "simulated", self.participant())


@pytest.fixture
def sitter(tmp_path, small_protocol, small_text) -> SittingOptions:
    return SittingOptions(tmp_path / "data", small_protocol, small_text)


@pytest.fixture
def brief(tmp_path, brief_protocol, brief_text) -> SittingOptions:
    """As `sitter`, with a third of the trials."""
    return SittingOptions(tmp_path / "data", brief_protocol, brief_text)


@pytest.fixture(scope="session")
def played(tmp_path_factory, small_protocol, small_text) -> ConductedSitting:
    return SittingOptions(tmp_path_factory.mktemp("played") / "data", small_protocol, small_text).whole()


@pytest.fixture
def finished(sitter, played) -> ConductedSitting:
    """What `sitter.whole()` leaves: played once and copied, for tests of what a session is afterwards."""
    shutil.copytree(played.folder.path.parent, sitter.data)
    return replace(played, folder=SessionFolder(sitter.data / played.folder.name))


@pytest.fixture(scope="session")
def taken_data(tmp_path_factory, small_text, sketching) -> Path:
    """A data folder with a finished and analysed session, P01_001; copied by tests that change it."""
    from study.cli.main import main

    folder = tmp_path_factory.mktemp("taken")
    (folder / "small.toml").write_text(small_text)
    asked = ["study", "--protocol", str(folder / "small.toml"), "--observer", "ideal", "--seed", "3"]
    with sketching():
        assert main([*asked, "--subject", "P01", "--data", str(folder / "data")]) == 0
    return folder / "data"


@pytest.fixture(scope="session")
def sitter_of() -> type[SittingOptions]:
    """For a protocol of one's own, or for a session that a whole module shares."""
    return SittingOptions


@pytest.fixture
def always_one():
    return lambda: Answered(1, 0.0)
