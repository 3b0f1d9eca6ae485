"""Two terminals: a person answers in one, the experimenter watches, notes, pauses and stops from another."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from terminal import ROOT, Terminal

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]


@pytest.fixture
def started(tmp_path, small_file):
    terminals = []

    def start(*arguments: str) -> Terminal:
        terminals.append(Terminal(*arguments, "--data", str(tmp_path / "data")))
        return terminals[-1]

    yield start
    for terminal in terminals:
        terminal.close()


@pytest.fixture
def beside(tmp_path):
    """One command in another terminal; returns exit code and everything said."""

    def run(*arguments: str, data: bool = True) -> tuple[int, str]:
        options = ["--data", str(tmp_path / "data")] if data else []
        command = [sys.executable, "-m", "study", *arguments, *options]
        environment = {"PYTHONPATH": f"{ROOT}:{ROOT / 'study' / 'launcher'}", "PATH": ""}
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=60)
        return done.returncode, " ".join((done.stdout + done.stderr).split())

    return run


@pytest.mark.timeout(120)
def test_a_session_is_watched_noted_paused_and_stopped(started, beside, small_file, tmp_path):
    person = started("study", "--plain", "--protocol", str(small_file), "--seed", "4", "--subject", "P07")
    person.wait_for("The device is ready.*Enter continues")
    person.type("\n")
    person.wait_for("Press Enter to begin")
    person.type("\n")
    person.wait_for(r"trial 1\b.*1 or 2\?")
    log = tmp_path / "data" / "P07_001" / "events.jsonl"

    code, said = beside("watch", "--once", "--json")
    open_trial = json.loads(log.read_text().splitlines()[-1])
    assert code == 0
    assert '"standing": "running"' in said
    assert '"activity": "waiting for the answer"' in said
    assert "direction" in open_trial
    assert '"shown"' not in said

    screen = started("watch", "P07_001")
    screen.wait_for("RUNNING")
    assert beside("watch", "--note", "asks for a lower chair")[0] == 0
    assert beside("watch", "--pause") == (0, "Paused. The participant continues at their own screen.")
    person.wait_for("Pause.*Enter continues")
    screen.wait_for("PAUSED")
    person.type("\n")
    person.wait_for(r"trial 1\b.*1 or 2\?")

    screen.type("S")
    stopped_s = time.monotonic()
    person.wait_for("This sitting is over: the experimenter stopped the session")
    assert time.monotonic() - stopped_s < 3.0
    screen.wait_for("STOPPED")
    screen.type("q")
    assert screen.end() == 0
    person.end()

    events = [json.loads(line) for line in log.read_text().splitlines()]
    assert [e["text"] for e in events if e["event"] == "note_taken"] == ["asks for a lower chair"]
    assert [e["who"] for e in events if e["event"] == "pause_taken"] == ["experimenter"]
    assert events[-1]["reason"] == "the experimenter stopped the session"
    assert beside("watch", "--stop")[0] == 1
    assert beside("note", "P07_001", "came back the next day")[0] == 0
    assert beside("validate", str(log.parent), data=False)[0] == 0
