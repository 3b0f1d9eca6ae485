"""The command line as a script would use it: exit codes, stdout for results, stderr for talk."""

import contextlib
import io
import json
import os
import sys

import pytest

from study.cli.main import main
from study.errors import ExitCode
from study.store.formats.participant_texts import make_language_template
from study.store.formats.protocol_files import list_shipped_protocols, read_protocol

pytestmark = pytest.mark.usefixtures("validated_here")


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


def test_a_command_that_was_left_says_that_nothing_is_half_written(run, monkeypatch, tmp_path):
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("study.workflows.equalizer.identify_model.identify_model", interrupted)
    code, out, err = run("identify", tmp_path / "rec.h5", "--out", tmp_path / "model.h5")
    assert (code, out) == (130, "")
    assert "Interrupted" in err and "Files that it had written are complete" in err


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


def test_protocols_are_listed_and_explained(run):
    code, out, _ = run("protocol", "list")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == list(list_shipped_protocols())
    code, out, _ = run("protocol", "show", "direction_threshold")
    assert "staircase.step_change = after_reversal" in out
    assert "stimulus at most 3 N, spring and damper 1.5 N, all together 4.5 N" in out
    code, out, _ = run("protocol", "show", "direction_threshold", "--json")
    assert {field["key"] for field in json.loads(out)["fields"]} >= {"staircase.start_n", "trial.feedback"}
    code, out, _ = run("protocol", "show", "sweep", "--text")
    assert out.startswith("#")


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (["texts", "de"], lambda: make_language_template("de")),
        (["show", "direction_threshold", "--text"], lambda: read_protocol("direction_threshold").text),
    ],
)
def test_what_is_printed_to_be_a_file_is_in_utf_8_on_any_system(monkeypatch, command, text):
    out = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(out, encoding="cp1252"))
    assert main(["protocol", *command]) == 0
    sys.stdout.flush()
    assert out.getvalue().decode("utf-8") == text()


def test_a_map_for_a_file_of_another_encoding_in_its_name_is_printed_with_its_reason(tmp_path, monkeypatch, capsys):
    try:
        path = tmp_path / os.fsdecode(b"r\xff.csv")
        path.write_text("a,b\n" + "".join(f"{row},{row % 5}\n" for row in range(50)), "utf-8")
    except (OSError, UnicodeError):
        pytest.skip("this file system has no such names")
    out = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(out, encoding="utf-8"))
    assert main(["import", str(path), "--out", str(tmp_path / "rec.h5")]) == ExitCode.WRONG_USE
    sys.stdout.flush()
    assert out.getvalue().startswith(b"# A map for r?.csv.")
    assert "needs a map" in capsys.readouterr().err


def test_what_is_printed_to_be_a_file_is_also_printed_into_a_text_stream():
    with contextlib.redirect_stdout(io.StringIO()) as out:
        assert main(["protocol", "texts", "de"]) == 0
    assert out.getvalue() == make_language_template("de")


@pytest.mark.slow
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


def test_a_recording_away_from_the_centre_says_where(run, tmp_path):
    from study.store.formats.recording_file import read_recording

    assert run("record", "ellipsoid", "--out", tmp_path / "e.h5", "--place", "0.0", "0.03", "-0.02")[0] == 0
    recording = read_recording(tmp_path / "e.h5")
    assert recording.meta["place_m"] == [0.0, 0.03, -0.02]
    assert recording.position.samples.mean(axis=0) == pytest.approx([0.0, 0.03, -0.02], abs=2e-3)


def test_the_version_is_reported(run):
    code, out, _ = run("--version")
    assert code == 0
    assert out.startswith("hapteq ")


def test_a_changed_threshold_is_found(run, data):
    table = data / "P01_001" / "thresholds.csv"
    rows = table.read_text().splitlines()
    first = rows[1].split(",")
    first[2] = "0.1111"
    table.write_text("\n".join([rows[0], ",".join(first), *rows[2:]]) + "\n")
    code, out, _ = run("validate", data / "P01_001")
    assert code == 1
    assert "thresholds.csv does not agree with the log" in out


@pytest.mark.parametrize("command", ["study", "rehearse", "noise OUT.wav"])
def test_a_seed_that_no_file_holds_is_refused_before_anything_is_done(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    assert main([*command.split(), "--seed", str(2**128)]) == ExitCode.WRONG_USE
    assert "This seed is too large" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
