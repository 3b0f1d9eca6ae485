"""`hapteq watch` and `hapteq note` from the command line, on a session that this test runs or does not run."""

import json
import os
import shutil
import threading
import time
from dataclasses import replace

import pytest

from study.cli import watch
from study.cli.conduct import make_simulated_code
from study.cli.main import main
from study.session.facts.events import DeviceFacts
from study.session.views.participant_codes import is_code
from study.session.watching.requests import NoteAsked, PauseAsked, StopAsked
from study.store.sessions.event_log import LOG_NAME, EventLog, read_log, read_opening
from study.store.sessions.request_inbox import RequestInbox

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]


@pytest.fixture(scope="module")
def data(tmp_path_factory, sketching):
    folder = tmp_path_factory.mktemp("cli")
    protocol = folder / "small.toml"
    protocol.write_text(
        'name = "small"\nkind = "study"\ntitle = "A small study"\n[stimulus]\nfrequencies_hz = [25.0]\n'
        "[staircase]\nstart_n = 1.0\ncap_n = 3.0\nup_after_wrong = 1\ndown_after_right = 3\n"
        "steps = [{ step_db = 4.0, reversals = 3 }]\nreversals = 3\naveraged_reversals = 2\n[directions]\n"
        "[safety]\nstimulus_cap_n = 3.0\ntotal_cap_n = 4.5\n"
    )
    made = folder / "data"
    begin = ["study", "--protocol", str(protocol), "--observer", "scripted", "--subject", "S1", "--seed", "3"]
    with sketching():
        assert main([*begin, "--data", str(made)]) == 0
    return made


@pytest.fixture
def running(data):
    """A session holds the log and takes what is asked."""
    log, over, heard = EventLog.reopen(data / "S1_001" / LOG_NAME), threading.Event(), []

    def take() -> None:
        while not over.is_set():
            heard.extend(RequestInbox(data / "S1_001").take())
            time.sleep(0.01)

    thread = threading.Thread(target=take)
    thread.start()
    yield heard
    over.set()
    thread.join()
    log.close()


def run(capsys, data, *arguments: str) -> tuple[int, str, str]:
    code = main([*arguments, "--data", str(data)])
    said = capsys.readouterr()
    return code, said.out, said.err


def test_the_light_name_of_the_log_is_the_logs():
    assert watch.LOG_NAME == LOG_NAME


def test_of_two_sessions_of_a_name_the_one_that_runs_gets_the_request(capsys, data, running, tmp_path, monkeypatch):
    """The stop went to the session in the current folder, which did not run, and the handle went on moving."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(data / "S1_001", "S1_001")
    log = (tmp_path / "S1_001" / LOG_NAME).read_bytes()
    assert run(capsys, data, "watch", "S1_001", "--note", "hurt", "--stop")[0] == 0
    assert running == [StopAsked("experimenter"), NoteAsked("experimenter", "hurt")]
    assert (tmp_path / "S1_001" / LOG_NAME).read_bytes() == log


def test_where_neither_of_two_sessions_of_a_name_runs_a_note_needs_the_path(capsys, data, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(data / "S1_001", "S1_001")
    code, _out, err = run(capsys, data, "watch", "S1_001", "--note", "hurt")
    assert code == 2 and "Two sessions have this name" in err
    assert b"hurt" not in (tmp_path / "S1_001" / LOG_NAME).read_bytes()


def test_once_tells_how_it_stands(capsys, data):
    code, out, _err = run(capsys, data, "watch", "S1_001", "--once")
    assert code == 0
    assert "✓ FINISHED S1_001: all runs are done" in out


def test_once_as_json_is_the_view_without_the_seed(capsys, data):
    code, out, _err = run(capsys, data, "watch", "S1_001", "--once", "--json")
    view = json.loads(out)
    assert (code, view["session"], view["standing"]) == (0, "S1_001", "finished")
    assert "seed" not in out


def test_without_a_name_the_session_that_changed_last_is_watched(capsys, data):
    code, out, _err = run(capsys, data, "watch", "--once")
    assert (code, "S1_001" in out) == (0, True)


def test_plain_lines_end_with_the_sitting(capsys, data):
    code, out, _err = run(capsys, data, "watch", "S1_001", "--plain")
    assert (code, "FINISHED" in out) == (0, True)


@pytest.mark.parametrize(
    ("option", "asked", "said"),
    [
        ("--stop", StopAsked("experimenter"), "the force is off, the sitting ends. Continue with: hapteq resume"),
        ("--pause", PauseAsked("experimenter"), "Paused."),
    ],
)
def test_a_running_session_is_stopped_or_paused(capsys, data, running, option, asked, said):
    code, _out, err = run(capsys, data, "watch", "S1_001", option)
    assert (code, said in " ".join(err.split())) == (0, True)
    assert running == [asked]


def test_notes_reach_a_running_session(capsys, data, running):
    code, _out, err = run(capsys, data, "watch", "S1_001", "--note", "lower chair", "--adverse", "numb thumb")
    assert (code, err.count("Noted in S1_001.")) == (0, 2)
    assert [(note.text, note.adverse) for note in running] == [("lower chair", False), ("numb thumb", True)]


@pytest.fixture
def newer(data):
    """Another session without a program; its log changed later than that of S1_001."""
    folder = data / "S2_001"
    shutil.copytree(data / "S1_001", folder)
    later_s = (data / "S1_001" / LOG_NAME).stat().st_mtime + 60.0
    os.utime(folder / LOG_NAME, (later_s, later_s))
    yield folder
    shutil.rmtree(folder)


def test_a_stop_without_a_name_reaches_the_session_that_runs(capsys, data, running, newer):
    code, _out, err = run(capsys, data, "watch", "--stop")
    assert (code, "S1_001" in err) == (0, True)
    assert running == [StopAsked("experimenter")]


@pytest.fixture
def busy(newer):
    """The newer session runs, too, and takes no request."""
    log = EventLog.reopen(newer / LOG_NAME)
    yield RequestInbox(newer)
    log.close()


def test_a_stop_without_a_name_reaches_all_sessions_that_run(capsys, data, running, busy):
    code, _out, err = run(capsys, data, "watch", "--stop", "--note", "the handle moved")
    said = " ".join(err.split())
    assert (code, "S1_001: the force is off" in said, "S2_001 accepted no request" in said) == (1, True, True)
    assert (running, busy.take()) == ([StopAsked("experimenter")], (StopAsked("experimenter"),))


@pytest.mark.parametrize("request_", [("--pause",), ("--note", "lower chair")])
def test_a_pause_or_note_without_a_name_is_refused_where_several_sessions_run(capsys, data, running, busy, request_):
    code, _out, err = run(capsys, data, "watch", *request_)
    said = " ".join(err.split())
    assert (code, "S1_001 and S2_001 are running" in said) == (2, True)
    assert (running, busy.take()) == ([], ())


def test_after_a_stop_the_command_names_the_real_device(capsys, data, running, monkeypatch):
    device = DeviceFacts("omega.7", simulated=False, sample_rate_hz=1000.0)
    session_opened = replace(read_opening(data / "S1_001" / LOG_NAME), device=device)
    monkeypatch.setattr("study.store.sessions.event_log.read_opening", lambda _path: session_opened)
    code, _out, err = run(capsys, data, "watch", "S1_001", "--stop")
    assert (code, "S1_001 --device omega7" in " ".join(err.split())) == (0, True)


def test_nothing_can_be_stopped_where_nothing_runs(capsys, data):
    code, _out, err = run(capsys, data, "watch", "S1_001", "--stop")
    assert (code, "This session is not running" in err) == (1, True)


def test_a_note_on_a_finished_session_is_in_its_log(capsys, data):
    code, _out, err = run(capsys, data, "note", "S1_001", "the grip was changed at 10:30", "--adverse")
    assert (code, "Noted in S1_001." in err) == (0, True)
    last = read_log(data / "S1_001" / LOG_NAME).events[-1]
    assert (last.event, last.text, last.adverse) == ("note_taken", "the grip was changed at 10:30", True)


@pytest.mark.parametrize("command", [["watch", "P99_001", "--once"], ["note", "P99_001", "text"]])
def test_an_unknown_session_is_wrong_use(capsys, data, command):
    code, _out, err = run(capsys, data, *command)
    assert (code, "There is no such session" in err) == (2, True)


def test_an_empty_data_folder_has_nothing_to_watch(capsys, tmp_path):
    code, _out, err = run(capsys, tmp_path, "watch", "--once")
    assert (code, "There is no session to watch" in err) == (2, True)


def test_a_session_without_a_line_has_not_begun(capsys, tmp_path):
    (tmp_path / "P01_001").mkdir()
    (tmp_path / "P01_001" / LOG_NAME).write_bytes(b"")
    code, _out, err = run(capsys, tmp_path, "watch", "P01_001", "--once")
    assert (code, "This session has not begun" in err) == (1, True)


def test_the_session_that_changed_last_is_no_folder_of_the_same_name_here(tmp_path, monkeypatch, data):
    namesake = tmp_path / "S1_001"
    namesake.mkdir()
    (namesake / LOG_NAME).write_text("")
    monkeypatch.chdir(tmp_path)
    assert watch._find_last_changed(data) == (data / "S1_001").resolve() != namesake.resolve()


def test_each_simulated_participant_has_a_code_of_its_own():
    names = (
        "ideal",
        "delivered_7_seed_1",
        "delivered_7_seed_12",
        "criterion_drift_7_seed_1",
        "criterion_drift_71_seed_1",
    )
    codes = [make_simulated_code(name) for name in names]
    assert codes[0] == "ideal1" and len(set(codes)) == len(names)
    assert make_simulated_code("delivered-7-seed-12") == make_simulated_code("delivered_7_seed_12")
    assert all(is_code(code) for code in codes)
