"""The command line as a script would use it: exit codes, stdout for results, stderr for talk."""

import json
import shutil
from pathlib import Path

import pytest

from study.cli.main import main
from study.errors import ExitCode
from study.store.formats.protocol_files import shipped_protocols


@pytest.fixture
def run(capsys):
    """Runs one command in this process; returns exit code, stdout, stderr."""

    def call(*arguments: object) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main([str(a) for a in arguments])
        said = capsys.readouterr()
        return int(code), said.out, said.err

    return call


@pytest.fixture(scope="module")
def finished(tmp_path_factory, small_text):
    """A data folder with one finished session of the small protocol; copied by whoever changes it."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "small.toml").write_text(small_text)
    data = folder / "data"
    assert main(["study", "--protocol", str(folder / "small.toml"), "--observer", "ideal", "--seed", "3",
                 "--subject", "P01", "--data", str(data)]) == 0  # fmt: skip
    return data


@pytest.fixture
def data(finished, tmp_path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "data"))


def test_a_simulated_participant_takes_the_study_and_results_go_to_stdout(run, small_file, tmp_path):
    code, out, err = run("study", "--protocol", small_file, "--observer", "ideal", "--data", tmp_path / "d")
    assert code == 0
    assert out.splitlines()[0].split() == ["frequency", "threshold", "cut", "by", "cap", "participants"]
    assert "25 Hz" in out
    assert "Report:" in err
    assert (tmp_path / "d" / "ideal1_001" / "analysis" / "report.html").exists()


def test_without_a_terminal_a_simulated_participant_sits_down_and_it_says_so(run, small_file, tmp_path, monkeypatch):
    with (tmp_path / "nothing").open("w+") as nothing:
        monkeypatch.setattr("sys.stdin", nothing)
        code, _, err = run("study", "--protocol", small_file, "--data", tmp_path / "d")
    assert code == 0
    assert "No terminal here: a simulated participant ('ideal') takes the session." in err


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["study", "--observer", "oracle"], "Choose one of ideal, lapsing, biased"),
        (["study", "--protocol", "direction_treshold"], "Did you mean direction_threshold?"),
        (["study", "--protocol", "sweep", "--observer", "ideal"], "hapteq record"),
        (["study", "--observer", "ideal", "--subject", "Ada Lovelace"], "1 to 16 letters and digits"),
        (["resume", "P09_001"], "There is no such session"),
        (["withdraw", "P09_001"], "There is no such session"),
        (["analyze", "nowhere"], "There is nothing to analyse"),
        (["record", "direction_threshold", "--out", "x.h5"], "hapteq study"),
        (["protocol", "show", "swep"], "Did you mean sweep?"),
        (["study", "--seed", "-1"], "--seed"),
        (["studdy"], "studdy"),
    ],
)
def test_wrong_use_is_exit_code_2_with_a_sentence_that_helps(run, tmp_path, monkeypatch, arguments, expected):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert expected in err
    assert list(tmp_path.iterdir()) == []


def test_a_device_that_is_not_there_is_exit_code_3(run, small_file, tmp_path):
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--device", "omega", "--data",
                       tmp_path / "d")  # fmt: skip
    assert code == 3
    assert "Use --device simulated" in err
    assert not (tmp_path / "d").exists()


def test_an_interruption_is_exit_code_130(run, small_file, tmp_path, monkeypatch):
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("study.workflows.session.simulated_display.SimulatedDisplay.ask", interrupted)
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--data", tmp_path / "d")
    assert code == 130
    assert "0 answers are on disk." in err
    assert "Go on with: hapteq resume" in err
    monkeypatch.undo()
    assert run("resume", "ideal1_001", "--data", tmp_path / "d")[0] == 0


def test_a_command_that_was_left_says_that_nothing_is_half_written(run, monkeypatch, tmp_path):
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("study.workflows.equalizer.identify_model.identify_model", interrupted)
    code, out, err = run("identify", tmp_path / "rec.h5", "--out", tmp_path / "model.h5")
    assert (code, out) == (130, "")
    assert "Interrupted" in err and "none is half written" in err


def test_a_finished_session_is_said_to_be_finished(run, data):
    code, _, err = run("resume", "P01_001", "--data", data)
    assert code == 1
    assert "This session is finished" in err


def test_analyze_writes_everything_that_the_contract_names(run, data, tmp_path):
    code, out, _ = run("analyze", data, "--out", tmp_path / "out")
    assert code == 0
    assert "25 Hz" in out
    for name in ("thresholds.csv", "anova.json", "report.html", "figures/thresholds.png", "figures/thresholds.svg"):
        assert (tmp_path / "out" / name).stat().st_size > 0, name
    code, out, _ = run("validate", tmp_path / "out" / "thresholds.csv", tmp_path / "out" / "anova.json")
    assert code == 0, out
    document = json.loads((tmp_path / "out" / "anova.json").read_text())
    assert document["provenance"]["seeds"] == {"P01_001": 3}
    assert document["provenance"]["parents"][0]["file"] == "events.jsonl"


def test_a_program_can_read_the_results(run, data):
    code, out, _ = run("analyze", data, "--json")
    assert code == 0
    document = json.loads(out)
    assert {row["frequency_hz"] for row in document["thresholds"]} == {25.0, 35.0}
    assert all(row["threshold_n"] > 0 for row in document["thresholds"])
    assert Path(document["report"]).exists()


def test_analyze_again_replaces_its_own_results(run, data):
    assert run("analyze", data)[0] == 0
    assert run("analyze", data)[0] == 0


def test_a_damaged_session_is_left_out_and_named(run, data):
    broken = Path(shutil.copytree(data / "P01_001", data / "P02_001"))
    (broken / "events.jsonl").write_text("not a log\n")
    code, out, err = run("analyze", data)
    assert code == 0
    assert "P02_001 cannot be used. Line 1 of events.jsonl" in err
    assert "25 Hz" in out


def test_validate_says_what_is_wrong_and_fails(run, data, tmp_path):
    table = data / "P01_001" / "trials.csv"
    table.write_text(table.read_text().replace("subject,", "person,", 1))
    code, out, _ = run("validate", table, data / "P01_001" / "session.json")
    assert code == 1
    assert "trials.csv" in out
    assert "not valid" in out
    assert "session.json: session summary: valid" in out
    code, out, _ = run("validate", "--json", table)
    assert code == 1
    assert json.loads(out)[0]["problems"]


def test_withdrawal_erases_all_sessions_of_the_participant_and_nobody_elses(run, data, small_file):
    for subject in ("P01", "P02"):
        who = ("--observer", "ideal", "--subject", subject)
        assert run("study", "--protocol", small_file, *who, "--data", data)[0] == 0
    other = {p: p.read_bytes() for p in (data / "P02_001").rglob("*") if p.is_file()}
    code, out, err = run("withdraw", "P01_002", "--data", data, "--yes")
    assert code == 0
    assert "Erased: P01_001, P01_002" in out
    assert "erase them" in err
    for name in ("P01_001", "P01_002"):
        left = {p.name for p in (data / name).iterdir()}
        assert left <= {"withdrawn.json", "session.lock"}
        document = json.loads((data / name / "withdrawn.json").read_text())
        assert set(document) == {"format", "version", "session", "withdrawn_utc", "begun"}
        assert set(document["begun"]) == {"protocol", "simulated", "number"}
        assert run("validate", data / name)[0] == 0
    assert {p: p.read_bytes() for p in (data / "P02_001").rglob("*") if p.is_file()} == other
    code, _, err = run("resume", "P01_001", "--data", data)
    assert code == 1
    assert "withdrew" in err
    code, _, err = run("analyze", data)
    assert "P01_001 was withdrawn by the participant." in err
    # Nobody else gets the code.
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--subject", "P01", "--data", data)
    assert code == 2
    assert "P01 withdrew" in err


def test_a_withdrawal_that_is_not_confirmed_erases_nothing(run, data, monkeypatch):
    monkeypatch.setattr("typer.confirm", lambda *_, **__: False)
    code, _, err = run("withdraw", "P01_001", "--data", data)
    assert code == 0
    assert "Nothing was erased." in err
    assert (data / "P01_001" / "events.jsonl").exists()


def test_a_locked_protocol_that_changed_is_refused_before_a_session_begins(run, small_file, tmp_path):
    data = tmp_path / "d"
    code, out, _ = run("protocol", "lock", small_file, "--data", data)
    assert code == 0
    assert out.strip().endswith("small.lock.json")
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


def test_protocols_are_listed_and_explained(run):
    code, out, _ = run("protocol", "list")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(shipped_protocols())
    code, out, _ = run("protocol", "show", "direction_threshold")
    assert "staircase.step_change = after_reversal" in out
    assert "stimulus at most 3 N, spring and damper 1.5 N, all together 4.5 N" in out
    code, out, _ = run("protocol", "show", "direction_threshold", "--json")
    assert {field["key"] for field in json.loads(out)["fields"]} >= {"staircase.start_n", "trial.feedback"}
    code, out, _ = run("protocol", "show", "sweep", "--text")
    assert out.startswith("#")


def test_a_recording_is_made_once_and_never_overwritten(run, tmp_path):
    out = tmp_path / "ellipsoid.h5"
    code, said, _ = run("record", "ellipsoid", "--out", out)
    assert (code, said.strip()) == (0, str(out))
    assert run("validate", out)[0] == 0
    before = out.read_bytes()
    code, _, err = run("record", "ellipsoid", "--out", out)
    assert code == 1
    assert "never overwritten" in err
    assert out.read_bytes() == before


def test_ellipsoids_enter_the_report(run, data, tmp_path):
    assert run("record", "ellipsoid", "--out", tmp_path / "e.h5")[0] == 0
    assert run("analyze", data, "--out", tmp_path / "out", "--ellipsoid", tmp_path / "e.h5")[0] == 0
    assert (tmp_path / "out" / "figures" / "ellipsoids.png").exists()
    other = data / "P01_001" / "recordings" / "run-00_trial-000_attempt-0.h5"
    code, _, err = run("analyze", data, "--ellipsoid", other)
    assert code == 1
    assert "hapteq record ellipsoid" in err


def test_a_recording_away_from_the_centre_says_where(run, tmp_path):
    from study.store.formats.recording_file import read_recording

    assert run("record", "ellipsoid", "--out", tmp_path / "e.h5", "--place", "0.0", "0.03", "-0.02")[0] == 0
    recording = read_recording(tmp_path / "e.h5")
    assert recording.meta["place_m"] == [0.0, 0.03, -0.02]
    assert recording.position.samples.mean(axis=0) == pytest.approx([0.0, 0.03, -0.02], abs=2e-3)


def test_the_version_is_said(run):
    code, out, _ = run("--version")
    assert code == 0
    assert out.startswith("hapteq ")


def test_figures_of_a_participant_who_withdrew_do_not_stay(run, data, small_file, tmp_path):
    assert run("study", "--protocol", small_file, "--observer", "ideal", "--subject", "P02", "--data", data)[0] == 0
    out = tmp_path / "elsewhere"
    assert run("analyze", data, "--out", out)[0] == 0
    assert run("analyze", data)[0] == 0
    assert run("withdraw", "P02_001", "--data", data, "--yes")[0] == 0
    assert not (data / "analysis").exists()
    assert run("analyze", data, "--out", out)[0] == 0
    traces = [p for p in out.rglob("*") if p.is_file() and (b"P02_001" in p.read_bytes()) and p.suffix != ".html"]
    assert traces == []
    assert not list((out / "figures").glob("*P02*"))


def test_leaving_is_not_finishing(run, small_file, tmp_path, monkeypatch):
    from study.session.views.views import Unanswered

    leave = Unanswered("the participant left", leave=True)
    monkeypatch.setattr("study.workflows.session.simulated_display.SimulatedDisplay.ask", lambda *_: leave)
    code, out, err = run("study", "--protocol", small_file, "--observer", "ideal", "--data", tmp_path / "d")
    assert (code, out) == (130, "")
    assert "The sitting ended: the participant left." in err
    assert f"hapteq resume {tmp_path / 'd' / 'ideal1_001'}" in err


def test_a_copied_session_is_left_out_and_the_rest_is_analysed(run, data):
    shutil.copytree(data / "P01_001", data / "P02_001")
    code, out, err = run("analyze", data)
    assert code == 0
    assert "P02_001 holds the log of P01_001: the folder was copied or renamed." in err
    assert "25 Hz" in out


def test_a_simulated_participant_does_not_take_a_persons_code(run, small_file, tmp_path, session_logs):
    data = tmp_path / "d"
    assert run("study", "--protocol", small_file, "--observer", "ideal", "--subject", "P01", "--data", data)[0] == 0
    session_logs.as_older(data / "P01_001", lambda text: text.replace(b'"observer":"ideal"', b'"observer":null', 1))
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--subject", "P01", "--data", data)
    assert code == 2
    assert "P01 is the code of a person" in err


def test_the_help_names_every_observer(run):
    from study.participants.observers import OBSERVERS

    _, out, _ = run("study", "--help")
    said = "".join(out.split())
    assert all(name in said for name in OBSERVERS)


def test_a_changed_threshold_is_found(run, data):
    table = data / "P01_001" / "thresholds.csv"
    rows = table.read_text().splitlines()
    first = rows[1].split(",")
    first[2] = "0.1111"
    table.write_text("\n".join([rows[0], ",".join(first), *rows[2:]]) + "\n")
    code, out, _ = run("validate", data / "P01_001")
    assert code == 1
    assert "thresholds.csv does not agree with the log" in out


def test_withdrawal_leaves_what_others_put_beside_the_analysis(run, data):
    assert run("analyze", data)[0] == 0
    notes = data / "analysis" / "my_notes.R"
    notes.write_text("mine")
    code, _, err = run("withdraw", "P01_001", "--data", data, "--yes")
    assert code == 0
    assert "and the analysis in" in err.splitlines()[0]
    assert [p.name for p in (data / "analysis").iterdir()] == ["my_notes.R"]


def test_a_damaged_protocol_text_keeps_nobody_out(run, data, small_file):
    log = data / "P01_001" / "events.jsonl"
    log.write_text(log.read_text().replace("start_n = 1.0", "start_n = = 1.0", 1))
    code, _, err = run("study", "--protocol", small_file, "--observer", "ideal", "--subject", "P01", "--data", data)
    assert code == 0, err
    assert run("withdraw", "P01_001", "--data", data, "--yes")[0] == 0


def test_a_session_that_is_being_written_is_not_withdrawn(run, data):
    from study.store.sessions.event_log import EventLog

    log = EventLog.reopen(data / "P01_001" / "events.jsonl")
    code, _, err = run("withdraw", "P01_001", "--data", data, "--yes")
    log.close()
    assert code == 1
    assert "Another program is writing to P01_001" in err
    assert (data / "P01_001" / "trials.csv").exists()


@pytest.mark.parametrize("command", ["study", "rehearse", "noise OUT.wav"])
def test_a_seed_that_no_file_holds_is_refused_before_anything_is_done(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    assert main([*command.split(), "--seed", str(2**128)]) == ExitCode.WRONG_USE
    assert "This seed is too large" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
