"""Keys sent to a real terminal in one burst: every answer of a form is the one that was typed for its question."""

import json
import sys
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from terminal import ESCAPE_SEQUENCE, Terminal

pytestmark = pytest.mark.real_time

FORMS = """
[consent]
version = "1"
exclusions = ["Is the hand hurt?", "Is the arm numb?", "Is there a pacemaker?", "Is it too late today?"]

[setup]
ask = true
"""
SETUP = {"hearing": "ear muffs", "hand_hidden": "yes", "arm_supported": "no", "grip": "finger tips", "hand": "left"}


@pytest.fixture
def sitting(tmp_path, small_text):
    path = tmp_path / "small.toml"
    path.write_text(small_text + FORMS)
    terminal = Terminal(
        "study", "--protocol", str(path), "--subject", "P07", "--device", "simulated", "--data", str(tmp_path / "data")
    )
    yield terminal, tmp_path / "data" / "P07_001" / "events.jsonl"
    terminal.close()


def shown(terminal: Terminal, words: str) -> None:
    """The question can be read, and a moment has passed, as for any person."""
    terminal.wait_for(words)
    terminal.drain(0.3)


def shown_since(terminal: Terminal, words: str, since: int) -> None:
    """The same, also where it was printed while something else was waited for."""
    give_up_s = time.monotonic() + 60.0
    while words not in " ".join(ESCAPE_SEQUENCE.sub("", terminal.screen[since:]).split()):
        assert time.monotonic() < give_up_s, f"'{words}' did not appear in:\n{terminal.screen[-2000:]}"
        terminal.drain(0.1)
    terminal.drain(0.3)


def filled(log: Path, form: str, terminal: Terminal) -> dict:
    """The event of a form, when it is in the log."""
    give_up_s = time.monotonic() + 60.0
    while time.monotonic() < give_up_s:
        whole = log.read_bytes().rpartition(b"\n")[0] if log.exists() else b""
        for event in map(json.loads, whole.splitlines()):
            if event["event"] == "form_filled" and event["form"] == form:
                return event
        terminal.drain(0.1)
    raise AssertionError(f"{form} was not filled in:\n{terminal.screen[-2000:]}")


def test_a_yes_typed_fast_into_the_exclusions_is_not_lost(sitting):
    terminal, log = sitting
    shown(terminal, "Is it too late today")
    terminal.type("1\r2\r1\r2\r\r")
    # A yes ends the sitting, so it is asked once more.
    shown(terminal, "Is that right?")
    terminal.type("1\r\r")
    assert filled(log, "exclusion", terminal)["passed"] is False


def test_answers_typed_fast_reach_the_log_question_by_question(sitting):
    terminal, log = sitting
    shown(terminal, "Is it too late today")
    # What follows for the next form was typed before it could be read, and answers nothing there.
    since = len(terminal.screen)
    terminal.type("2\r2\r2\r2\r\r" + "1\r" * 7)
    assert filled(log, "exclusion", terminal)["passed"] is True
    shown_since(terminal, "How you sit: 5 of 5 still open", since)
    terminal.type("2\r1\r2\r3\r2\r\r")
    assert filled(log, "setup", terminal)["answers"] == SETUP
