"""A study from the command line: who sits down, what is refused, and how it is left."""

import json
import os

import pytest

from study.tui.line_mode.line_input import LineInput

pytestmark = pytest.mark.usefixtures("validated_here", "sketched")


@pytest.mark.slow
def test_a_simulated_participant_takes_the_study_and_results_go_to_stdout(run, small_file, tmp_path):
    code, out, err = run("study", "--protocol", small_file, "--observer", "ideal", "--data", tmp_path / "d")
    assert code == 0
    assert out.splitlines()[0].split() == ["frequency", "threshold", "cut", "by", "cap", "participants"]
    assert "25 Hz" in out
    assert "Report:" in err
    assert (tmp_path / "d" / "ideal1_001" / "analysis" / "report.html").exists()


@pytest.mark.slow
def test_without_a_terminal_a_simulated_participant_sits_down_and_it_says_so(run, small_file, tmp_path, monkeypatch):
    with (tmp_path / "nothing").open("w+") as nothing:
        monkeypatch.setattr("sys.stdin", nothing)
        code, _, err = run("study", "--protocol", small_file, "--data", tmp_path / "d")
    assert code == 0
    assert "No terminal here: a simulated participant ('ideal') takes the session." in err


def test_a_device_that_is_not_there_is_exit_code_3(run, small_file, tmp_path):
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--device", "omega", "--data",
                       tmp_path / "d")  # fmt: skip
    assert code == 3
    assert "Use --device simulated" in err
    assert not (tmp_path / "d").exists()


@pytest.mark.slow
def test_an_interruption_is_exit_code_130(run, small_file, tmp_path, monkeypatch):
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("study.workflows.session.simulated_display.SimulatedDisplay.ask", interrupted)
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--data", tmp_path / "d")
    assert code == 130
    assert "0 answers are on disk." in err
    assert "Continue with: hapteq resume" in err
    monkeypatch.undo()
    assert run("resume", "ideal1_001", "--data", tmp_path / "d")[0] == 0


def test_a_person_waits_for_the_device_in_the_language_of_the_protocol(run, small_text, tmp_path, monkeypatch):
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    german = tmp_path / "german.toml"
    german.write_text(f'{small_text}\n[text]\nlanguage = "de"\n', encoding="utf-8")
    read, _ = os.pipe()
    monkeypatch.setattr("study.cli.conduct.LineInput", lambda: LineInput(read))
    monkeypatch.setattr("study.cli.conduct.conduct_new", interrupted)
    _, _, err = run("study", "--protocol", german, "--plain", "--subject", "P01", "--data", tmp_path / "d")
    assert "Das Gerät wird vorbereitet: beim ersten Mal etwa zehn Sekunden." in err
    assert "Preparing" not in err


def test_a_finished_session_is_said_to_be_finished(run, data):
    code, _, err = run("resume", "P01_001", "--data", data)
    assert code == 1
    assert "This session is finished" in err


def test_a_locked_protocol_that_changed_is_refused_before_a_session_begins(run, small_file, tmp_path):
    data = tmp_path / "d"
    code, out, err = run("protocol", "lock", small_file, "--data", data)
    assert code == 0
    assert out.strip().endswith("small.lock.json")
    assert "declares no primary analysis, contrast, sample size or exclusions" in " ".join(err.split())
    assert run("validate", data / "small.lock.json")[0] == 0
    assert run("study", "--protocol", small_file, "--observer", "ideal", "--data", data)[0] == 0
    opened = json.loads((data / "ideal1_001" / "events.jsonl").read_text().splitlines()[0])
    assert opened["protocol_locked"] is True
    small_file.write_text(small_file.read_text().replace("start_n = 1.0", "start_n = 0.9"))
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--data", data)
    assert code == 1
    assert "This protocol is locked" in err
    assert not (data / "ideal1_002").exists()


def test_a_wrong_protocol_names_file_key_and_what_is_allowed(run, small_file, tmp_path):
    small_file.write_text(small_file.read_text().replace("start_n = 1.0", "start_mN = 1000"))
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--data", tmp_path / "d")
    assert code == 1
    assert "small.toml" in err
    assert "staircase.start_mN" in err
    assert "start_n" in err


def test_leaving_is_not_finishing(run, small_file, tmp_path, monkeypatch):
    from study.session.views.participant_views import Unanswered

    leave = Unanswered("the participant left", ends_sitting=True)
    monkeypatch.setattr("study.workflows.session.simulated_display.SimulatedDisplay.ask", lambda *_: leave)
    code, out, err = run("study", "--protocol", small_file, "--observer", "ideal", "--data", tmp_path / "d")
    assert (code, out) == (130, "")
    assert "The sitting ended: the participant left." in err
    assert f"hapteq resume {tmp_path / 'd' / 'ideal1_001'}" in err


@pytest.mark.slow
def test_a_simulated_participant_does_not_take_a_persons_code(run, small_file, tmp_path, session_logs):
    data = tmp_path / "d"
    assert run("study", "--protocol", small_file, "--observer", "ideal", "--subject", "P01", "--data", data)[0] == 0
    session_logs.as_older(data / "P01_001", lambda text: text.replace(b'"observer":"ideal"', b'"observer":null', 1))
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--subject", "P01", "--data", data)
    assert code == 2
    assert "P01 is the code of a person" in err


def test_the_help_names_every_observer(run):
    from study.participants.observer_catalogue import OBSERVERS

    _, out, _ = run("study", "--help")
    said = "".join(out.split())
    assert all(name in said for name in OBSERVERS)


@pytest.mark.slow
def test_a_session_begins_beside_a_damaged_protocol_text(run, data, small_file):
    log = data / "P01_001" / "events.jsonl"
    log.write_text(log.read_text().replace("start_n = 1.0", "start_n = = 1.0", 1))
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--subject", "P01", "--data", data)
    assert code == 0, err
    assert run("withdraw", "P01_001", "--data", data, "--yes")[0] == 0
