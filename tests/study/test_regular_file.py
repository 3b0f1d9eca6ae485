"""What stands in the place of a file and is none: every reader says so at once, and waits for nothing."""

import os
import socket
from pathlib import Path

import pytest
from typer.testing import CliRunner

from study.cli.main import app
from study.errors import StudyError
from study.importing.arrays.read_arrays import read_arrays
from study.importing.map_format.import_map import CsvMap
from study.importing.map_library import find_maps_for_folder, read_map
from study.regular_file import RefusedFileError, open_regular, read_regular
from study.store.disk.file_errors import CannotReadError
from study.store.disk.provenance import compute_sha256
from study.store.disk.text_file import read_text
from study.store.formats.diagnosis_file import read_diagnosis
from study.store.formats.identified_model_file import read_identified_model
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.protocol_files import read_protocol
from study.store.formats.real_answer_file import read_real_answer
from study.store.formats.recording_file import read_recording
from study.store.formats.repeats_file import read_repeats
from study.store.formats.reproduction_file import read_reproduction
from study.store.formats.thresholds_file import read_thresholds
from study.store.formats.trajectory_file import read_trajectory
from study.store.formats.trials_file import read_trials
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import EventLog, read_log, read_valid_events
from study.store.sessions.live_file import read_live
from study.store.sessions.log_lock import is_log_locked
from study.workflows.files.validate import validate_file
from study.workflows.results.fold_session import fold_session
from study.workflows.views.view_home import make_home_view
from study.workflows.views.watch_session import follow

pytestmark = pytest.mark.timeout(60)

FROZEN = Path(__file__).parents[1] / "frozen" / "v0_1"
READERS = {
    "recording": (read_recording, ".h5"),
    "identified model": (read_identified_model, ".h5"),
    "mechanical model": (read_mechanical_model, ".toml"),
    "trajectory": (read_trajectory, ".csv"),
    "trials": (read_trials, ".csv"),
    "thresholds": (read_thresholds, ".csv"),
    "diagnosis": (read_diagnosis, ".json"),
    "real answer": (read_real_answer, ".json"),
    "repeats": (read_repeats, ".json"),
    "reproduction": (read_reproduction, ".json"),
    "text": (read_text, ".txt"),
    "fingerprint": (compute_sha256, ".h5"),
    "protocol": (lambda path: read_protocol(str(path)), ".toml"),
    "map": (lambda path: read_map(str(path)), ".toml"),
    "log": (read_log, ".jsonl"),
    "log to go on with": (EventLog.reopen, ".jsonl"),
    **{f"arrays {kind}": (lambda path: read_arrays(path, CsvMap()), kind) for kind in (".csv", ".npz", ".mat", ".h5")},
}


def no_file(path: Path, kind: str) -> None:
    match kind:
        case "pipe":
            os.mkfifo(path)
        case "socket":
            where = os.open(path.parent, os.O_RDONLY)
            with socket.socket(socket.AF_UNIX) as bound:  # by way of the folder: such names must be short
                bound.bind(f"/proc/self/fd/{where}/{path.name}")
            os.close(where)
        case "device":
            path.symlink_to("/dev/zero")
        case "folder":
            path.mkdir()
        case "lost link":
            path.symlink_to(path.with_name("nowhere"))
        case "looping link":
            path.symlink_to(path)


KINDS = ("pipe", "socket", "device", "folder", "lost link", "looping link")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("reader", READERS)
def test_no_reader_takes_what_is_no_file_for_a_file(tmp_path, kind, reader):
    read, suffix = READERS[reader]
    no_file(tmp_path / f"a{suffix}", kind)
    with pytest.raises(StudyError) as refused:
        read(tmp_path / f"a{suffix}")
    assert refused.value.happened and refused.value.do_now


@pytest.mark.parametrize(
    ("kind", "sentence"),
    [
        ("pipe", "It is a pipe, not a file."),
        ("socket", "It is a socket, not a file."),
        ("device", "It is a device, not a file."),
    ],
)
def test_it_is_said_what_stands_there(tmp_path, kind, sentence):
    no_file(tmp_path / "a.csv", kind)
    with pytest.raises(CannotReadError) as refused:
        read_text(tmp_path / "a.csv")
    assert refused.value.happened == sentence


@pytest.mark.parametrize("kind", KINDS)
def test_a_folder_of_sessions_is_listed_although_a_log_a_model_and_a_protocol_are_no_files(tmp_path, kind):
    data = tmp_path / "data"
    (data / "P01_001").mkdir(parents=True)
    for place in (data / "P01_001" / "events.jsonl", data / "P01_001" / "live.json", data / "m.h5", data / "p.toml"):
        no_file(place, kind)
    view = make_home_view(data)
    (line,) = view.sessions
    assert (line.standing, view.models) == ("unreadable", ())
    assert not any(entry.name.startswith(str(tmp_path)) for entry in view.protocols)
    folder = SessionFolder(data / "P01_001")
    assert is_log_locked(folder.log) is None
    assert read_live(folder.path) is None
    assert read_valid_events(folder.log) == ()
    with pytest.raises(StudyError):
        fold_session(folder)
    follower = follow(folder.path)
    if kind == "lost link":  # as where the log is still to come
        assert follower.look("2026-01-01T00:00:00+00:00") is None
    else:
        with pytest.raises(StudyError, match="cannot be followed"):
            follower.look("2026-01-01T00:00:00+00:00")


@pytest.mark.parametrize("kind", KINDS)
def test_commands_say_it_too(tmp_path, kind):
    (tmp_path / "P01_001").mkdir()
    no_file(tmp_path / "P01_001" / "events.jsonl", kind)
    no_file(tmp_path / "a.csv", kind)
    for words in (
        ("sessions", "--data", tmp_path),
        ("show", tmp_path / "P01_001"),
        ("resume", tmp_path / "P01_001", "--data", tmp_path),
        ("analyze", tmp_path, "--out", tmp_path / "out"),
        ("watch", "P01_001", "--data", tmp_path, "--plain"),
        ("import", tmp_path / "a.csv", "--out", tmp_path / "b.h5"),
    ):
        done = CliRunner().invoke(app, [str(word) for word in words])
        assert done.exception is None or isinstance(done.exception, StudyError | SystemExit), (words, done.exception)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "folder"])
def test_validate_says_it_in_its_own_process(tmp_path, kind):
    no_file(tmp_path / "a.h5", kind)
    assert validate_file(tmp_path / "a.h5").kind == "unreadable"


def test_a_lock_that_cannot_be_read_is_not_taken_for_none(tmp_path):
    protocol = (FROZEN / "corpus_study.toml").read_text()
    (tmp_path / "p.toml").write_text(protocol)
    no_file(tmp_path / "corpus.lock.json", "lost link")
    with pytest.raises(CannotReadError, match=r"corpus\.lock\.json cannot be read"):
        read_protocol(str(tmp_path / "p.toml"))


def test_a_map_beside_data_that_is_no_file_is_passed_over(tmp_path):
    no_file(tmp_path / "map.toml", "pipe")
    no_file(tmp_path / "data.npz", "device")
    assert find_maps_for_folder(tmp_path) == ()


def test_the_size_is_looked_at_before_anything_is_read(tmp_path):
    with (tmp_path / "a").open("wb") as file:
        file.truncate(1 << 40)  # a hole; it takes no room on the disk
    with pytest.raises(RefusedFileError, match="it has 1099511627776 bytes, and up to 1000 are read"):
        read_regular(tmp_path / "a", 1000)
    (tmp_path / "b").write_bytes(b"x" * 1000)
    assert read_regular(tmp_path / "b", 1000) == b"x" * 1000


def test_a_link_to_a_file_is_followed(tmp_path):
    (tmp_path / "a").write_bytes(b"x")
    (tmp_path / "b").symlink_to("a")
    with open_regular(tmp_path / "b") as file:
        assert file.read() == b"x"
