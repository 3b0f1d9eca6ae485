"""What is recorded is for the account that recorded it, with any umask."""

import os
import shutil
import stat
from pathlib import Path

import pytest
from typer.testing import CliRunner

from study.cli.main import app
from study.session.watching.live_state import LiveState
from study.session.watching.requests import NoteAsked
from study.store.disk.atomic_write import write_atomically
from study.store.disk.privacy import format_data_folder_warning, is_open_to_others, make_folder, restrict_to_owner
from study.store.sessions.archive import create_session_folder
from study.store.sessions.live_file import write_live
from study.store.sessions.request_inbox import RequestInbox
from study.workflows.checks.check_installation import check_privacy
from study.workflows.files.validate import validate_file
from study.workflows.session.plan_sitting import plan_sitting

pytestmark = pytest.mark.usefixtures("validated_here", "sketched")

CORPUS = Path(__file__).resolve().parents[3] / "frozen" / "v0_1"
LIVE = LiveState(
    utc="2026-05-04T09:30:00.000+00:00", activity="idle", since_utc="2026-05-04T09:30:00.000+00:00", fault="",
    offset_mm=0.0, handle_ready=True, acceleration_mps2=None, sensor_clipped=False, missed_ticks=0,
)  # fmt: skip


@pytest.fixture(autouse=True)
def umask():
    """None: everything that is not said is open to everyone."""
    before = os.umask(0)
    yield
    os.umask(before)


@pytest.fixture
def opened(tmp_path) -> Path:
    """A data folder that an earlier version made: everyone can read it."""
    data = Path(shutil.copytree(CORPUS / "study", tmp_path / "data"))
    for path in (data, *data.rglob("*")):
        path.chmod(0o755 if path.is_dir() else 0o644)
    return data


def exposed(folder: Path) -> list[str]:
    """Everything in it, and itself, to which others have a right."""
    paths = (folder, *folder.rglob("*"))
    return [str(path.relative_to(folder.parent)) for path in paths if stat.S_IMODE(path.lstat().st_mode) & 0o077]


def run(*words: object) -> str:
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    return done.output


def test_everything_that_a_study_writes_is_private(tmp_path):
    data = tmp_path / "new" / "data"
    who = ("--observer", "ideal", "--subject", "P09", "--seed", "3")
    run("study", "--protocol", CORPUS / "corpus_study.toml", *who, "--data", data)
    run("analyze", data)
    RequestInbox(data / "P09_001").send(NoteAsked("experimenter", "numb thumb", adverse=True))
    write_live(data / "P09_001", LIVE)
    assert {"analysis", "recordings", "events.jsonl", "session.lock", "live.json", "requests"} <= {
        path.name for path in (data / "P09_001").iterdir()
    }
    assert exposed(data) == []


def test_a_session_closes_a_data_folder_that_others_can_read(opened, tmp_path):
    outside = tmp_path / "outside.h5"
    outside.write_text("")
    outside.chmod(0o644)
    (opened / "P04_001" / "recordings" / "linked.h5").symlink_to(outside)
    run("resume", "P04_001", "--data", opened)
    assert not is_open_to_others(opened)
    assert not is_open_to_others(opened / "P01_001")
    assert exposed(opened / "P04_001") == ["P04_001/recordings/linked.h5"]  # a link has no rights of its own
    assert stat.S_IMODE(outside.stat().st_mode) == 0o644


@pytest.mark.slow
def test_an_analysis_beside_the_sessions_is_private_even_where_they_are_not_yet(opened):
    shutil.rmtree(opened / "P04_001")
    run("analyze", opened)
    assert exposed(opened / "analysis") == []


@pytest.mark.parametrize("umask", [0o000, 0o022])
def test_elsewhere_files_have_the_rights_of_their_folder(umask, tmp_path):
    os.umask(umask)
    for name, mode in (("shared", 0o755), ("own", 0o700)):
        (tmp_path / name).mkdir()
        (tmp_path / name).chmod(mode)
        write_atomically(tmp_path / name / "model.h5", b"model")
        make_folder(tmp_path / name / "figures")
    assert stat.S_IMODE((tmp_path / "shared" / "model.h5").stat().st_mode) == 0o666 & ~umask
    assert stat.S_IMODE((tmp_path / "shared" / "figures").stat().st_mode) == 0o777 & ~umask
    assert exposed(tmp_path / "own") == []


@pytest.mark.parametrize("why", ["it was made to be shared", "it holds more than the study"])
def test_a_folder_that_is_not_closed_is_reported(opened, why, monkeypatch, tmp_path):
    if why == "it was made to be shared":
        opened.chmod(0o2775)
    else:
        monkeypatch.chdir(opened)
    assert format_data_folder_warning(opened).endswith(
        f"A session leaves them: {why}. Remove these rights: chmod 700 {opened}"
    )
    assert plan_sitting(str(CORPUS / "corpus_study.toml"), "P09", None, 3, opened).notes == (
        format_data_folder_warning(opened),
    )
    folder = create_session_folder(opened, "P09")
    assert is_open_to_others(opened)
    assert exposed(folder.path) == []


def test_going_on_in_a_folder_that_is_not_closed_says_so(opened):
    opened.chmod(0o2775)
    assert f"Note: {format_data_folder_warning(opened)}" in run("resume", "P04_001", "--data", opened)
    assert exposed(opened / "P04_001") == []


def test_validate_and_doctor_say_who_can_read(opened):
    said = validate_file(opened / "P01_001").notes
    assert [f"chmod 700 {folder}" in note for folder, note in zip((opened / "P01_001", opened), said, strict=True)]
    assert f"  Note: Other accounts of this computer have rights to {opened}" in run("validate", opened / "P01_001")
    finding = check_privacy(opened)
    assert (finding.fine, finding.value) == (False, f"{opened}: open to other accounts")
    assert f"chmod 700 {opened}" in finding.advice
    for path in (opened, opened / "P01_001"):
        path.chmod(0o700)
    assert validate_file(opened / "P01_001").notes == ()
    assert check_privacy(opened).fine
    assert check_privacy(opened / "not" / "yet").fine


def test_closing_follows_no_link(opened, tmp_path):
    other = Path(shutil.copytree(opened, tmp_path / "other"))
    shutil.rmtree(opened / "P01_001")
    (opened / "P01_001").symlink_to(other)
    restrict_to_owner(opened / "P01_001", recursive=True)
    restrict_to_owner(opened, recursive=True)
    assert stat.S_IMODE(other.stat().st_mode) == 0o755
    assert exposed(opened) == ["data/P01_001"]


def test_a_link_in_the_place_of_the_live_file_is_not_written_through(tmp_path):
    (tmp_path / "thesis.txt").write_text("all of it")
    (tmp_path / ".live.json.part").symlink_to(tmp_path / "thesis.txt")
    write_live(tmp_path, LIVE)
    assert (tmp_path / "thesis.txt").read_text() == "all of it"
