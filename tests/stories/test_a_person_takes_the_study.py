"""A person with real keys in a real terminal, in line mode, on the simulated device, in real time."""

import csv
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from terminal import Terminal

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]


@pytest.fixture
def study(tmp_path, small_file):
    terminals = []

    def start(*more: str, command: str = "study") -> Terminal:
        terminals.append(Terminal(command, *more, "--plain", "--data", str(tmp_path / "data")))
        return terminals[-1]

    yield start
    for terminal in terminals:
        terminal.close()


def begin(study, small_file) -> Terminal:
    terminal = study("--protocol", str(small_file), "--seed", "4")
    terminal.wait_for("Participant code")
    terminal.type("P07\n")
    terminal.wait_for("The device is ready.*Enter continues")
    terminal.type("\n")
    shown = terminal.wait_for("Press Enter to begin")
    assert "up-left to down-right" in shown
    assert "nothing moves here" in shown
    terminal.type("\n")
    return terminal


def answer_until_finished(terminal: Terminal) -> int:
    answers = 0
    while True:
        shown = terminal.wait_for(r"1 or 2\?|Press Enter to go on|Finished:")
        if "Finished:" in shown:
            return answers
        if "Press Enter to go on" in shown:
            terminal.type("\n")
            continue
        terminal.type("121"[answers % 3] + "\n")
        answers += 1


@pytest.mark.slow
@pytest.mark.timeout(240)
def test_from_the_code_to_the_report_with_a_kill_in_the_middle(study, small_file, tmp_path):
    terminal = begin(study, small_file)
    for trial, key in ((1, "1\n"), (2, "3\n"), (0, "2\n"), (3, "1\n")):
        heading = rf"trial {trial}\b.*" if trial else "'3' is no answer.*"
        terminal.wait_for(heading + r"1 or 2\?")
        terminal.type(key)
    terminal.wait_for("trial 4")
    terminal.kill()

    again = study("P07_001", command="resume")
    again.wait_for("The device is ready.*Enter continues")
    again.type("\n")
    assert "3 answers are on the disk" in again.wait_for("Press Enter to begin")
    again.type("\n")
    answer_until_finished(again)
    assert again.end() == 0
    assert "Report:" in again.screen

    session = tmp_path / "data" / "P07_001"
    with (session / "trials.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["felt"] for row in rows} == {"false"}
    first, second = (row["status"] for row in rows if row["trial"] == "3" and row["run"] == "0")
    assert first == "spoiled"
    assert second in ("ok", "flagged", "unmeasured")
    report = (session / "analysis" / "report.html").read_text()
    assert "Nothing was felt" in report


@pytest.mark.timeout(120)
def test_pasted_answers_answer_one_trial_and_leaving_keeps_them(study, small_file, tmp_path):
    terminal = begin(study, small_file)
    terminal.wait_for(r"trial 1\b.*1 or 2\?")
    terminal.type("1\n2\n1\n2\n1\n")
    terminal.wait_for(r"trial 2\b.*1 or 2\?")
    terminal.type("q\n")
    assert terminal.end() == 130
    said = " ".join(terminal.screen.split())
    assert "1 answer is on disk." in said
    assert "Continue with: hapteq resume" in said


@pytest.mark.timeout(120)
def test_ctrl_c_lets_go_and_says_how_to_continue(study, small_file):
    terminal = begin(study, small_file)
    terminal.wait_for(r"1 or 2\?")
    terminal.type("1\n")
    terminal.wait_for(r"trial 2\b")
    terminal.type("\x03")
    assert terminal.end() == 130
    assert "1 answer is on disk." in terminal.screen
    assert "hapteq resume" in terminal.screen


@pytest.mark.timeout(120)
def test_a_closed_terminal_loses_nothing(study, small_file, tmp_path):
    terminal = begin(study, small_file)
    terminal.wait_for(r"trial 1\b.*1 or 2\?")
    terminal.type("1\n")
    terminal.wait_for(r"trial 2\b.*1 or 2\?")
    terminal.hang_up()
    assert terminal.process.wait(timeout=30) != 0
    again = study("P07_001", command="resume")
    again.wait_for("The device is ready.*Enter continues")
    again.type("\n")
    assert "1 answer is on the disk" in again.wait_for("Press Enter to begin")
    again.type("q\n")
    assert again.end() == 130
