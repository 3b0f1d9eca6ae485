"""A person with real keys at the real screen, from the start to the report, with a kill in the middle."""

import json
import sys
import time
from pathlib import Path

import pytest

from protocols.document.loading import load_protocol
from study.devices.clock import VirtualClock
from study.participants.observer_catalogue import find_observer
from study.session.views.participant_views import Answered
from study.store.sessions.archive import SessionFolder
from study.workflows.results.fold_session import fold_session
from study.workflows.session.conduct_session import Participant, conduct_new
from study.workflows.session.open_session import SessionPlan
from study.workflows.session.simulated_display import SimulatedDisplay

sys.path.insert(0, str(Path(__file__).parent))

from terminal import Terminal

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]

FELT_S = 0.3
SEED = 4


class AtTheScreen:
    """Presses Enter where something is to be read, and answers trials, 1 and 2 in turn."""

    def __init__(self, terminal: Terminal, session: Path) -> None:
        self.terminal = terminal
        self._log = session / "events.jsonl"
        self._answered: set[tuple[int, int, int]] = set()

    def events(self) -> list[dict]:
        if not self._log.exists():
            return []
        whole = self._log.read_bytes().rpartition(b"\n")[0]
        return [json.loads(line) for line in whole.splitlines()]

    def sit(self, until, timeout_s: float = 120.0) -> None:
        give_up_s = time.monotonic() + timeout_s
        while not until(self.events()):
            assert time.monotonic() < give_up_s, self.terminal.screen[-3000:]
            assert self.terminal.process.poll() is None, self.terminal.screen[-3000:]
            self._act(self.events())

    def _act(self, events: list[dict]) -> None:
        last = events[-1] if events else {}
        if last.get("event") != "trial_presented":
            self.terminal.type("\r")
            self.terminal.drain(0.25)
            return
        trial = (last["run"], last["trial"], last["attempt"])
        if trial not in self._answered:
            self._answered.add(trial)
            self.terminal.drain(FELT_S)
            self.terminal.type("12"[len(self._answered) % 2])
        self.terminal.drain(0.1)


def answers(events: list[dict]) -> int:
    return sum(event["event"] == "answer_given" for event in events)


def closed(events: list[dict]) -> bool:
    return any(event["event"] == "session_closed" for event in events)


@pytest.fixture
def at_the_screen(tmp_path, small_file):
    seats = []

    def sit_down(command: str, *more: str) -> AtTheScreen:
        terminal = Terminal(command, *more, "--data", str(tmp_path / "data"))
        seats.append(AtTheScreen(terminal, tmp_path / "data" / "P07_001"))
        return seats[-1]

    yield sit_down
    for seat in seats:
        seat.terminal.close()


class SaysTheSame(SimulatedDisplay):
    """Is right where another participant was right. A trial that was drawn again after the kill may have had the other
    direction, so the same key would not be the same answer."""

    def __init__(self, given: list[bool], clock: VirtualClock) -> None:
        super().__init__(find_observer("ideal", SEED), SEED, clock)
        self._given = iter(given)

    def ask(self, question, sign_of_life):
        super().ask(question, sign_of_life)
        shown = self._perceived.direction_shown
        return Answered(shown if next(self._given) else 3 - shown, self._clock.now_s())


def headless(given: list[bool], text: str, data: Path):
    clock = VirtualClock()
    display = SaysTheSame(given, clock)
    plan = SessionPlan(load_protocol(text, "small"), text, False, "H1", "ideal", SEED, data, participant_number=0)
    return conduct_new(plan, "simulated", Participant(display=display, hand=display, clock=clock)).state


@pytest.mark.timeout(280)
def test_from_the_start_to_the_report_with_a_kill_in_the_middle(at_the_screen, small_file, brief_text, tmp_path):
    small_file.write_text(brief_text)
    first = at_the_screen("study", "--protocol", str(small_file), "--seed", str(SEED))
    first.terminal.wait_for("New session")
    first.terminal.wait_for("A small study for tests")
    first.terminal.type("P07")
    first.terminal.drain(0.5)
    first.terminal.type("\x1b[15~")  # F5
    first.terminal.wait_for("Device check")
    first.sit(until=lambda events: answers(events) >= 6)
    first.terminal.kill()
    before = answers(first.events())

    again = at_the_screen("resume", "P07_001")
    again.terminal.wait_for("Device check")
    again.sit(until=closed)
    if "Thank you" not in again.terminal.screen:  # it may have come while the log was watched
        again.terminal.wait_for("Thank you")
    again.terminal.press_until("\r", "Leave hapteq")
    again.terminal.type("q")
    assert again.terminal.end() == 0
    assert "Report:" in again.terminal.screen

    session = SessionFolder(tmp_path / "data" / "P07_001")
    state = fold_session(session).state
    assert state.closed
    assert answers(again.events()) >= before
    assert "Nothing was felt" in (session.path / "analysis" / "report.html").read_text()

    counted = [trial for trial in state.trials if trial.is_valid]
    other = headless([bool(trial.correct) for trial in counted], brief_text, tmp_path / "headless")

    def levels(trials):
        return [(t.run, t.trial, t.phase, t.frequency_hz, t.level_n, t.correct, t.reversal) for t in trials]

    assert levels(counted) == levels(other.trials)
    undisturbed = {(t.run, t.trial): t.direction_shown for t in counted if t.attempt == 0}
    assert len(undisturbed) >= len(counted) - 2
    assert undisturbed.items() <= {(t.run, t.trial): t.direction_shown for t in other.trials}.items()
