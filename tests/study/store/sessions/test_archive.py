import errno
import os

import pytest

from study.errors import StudyError, WrongUseError
from study.store.sessions.archive import check_subject, create_session_folder, find_session, list_session_folders
from study.store.sessions.session_lock import PLACES_LOCK_NAME, hold_places_lock, hold_session_lock
from study.workflows.session.withdraw_participant import find_session_to_withdraw


def test_every_session_gets_a_folder_of_its_own(tmp_path):
    names = [create_session_folder(tmp_path / "data", code).name for code in ("P01", "P01", "P02", "P01")]
    assert names == ["P01_001", "P01_002", "P02_001", "P01_003"]
    assert [f.name for f in list_session_folders(tmp_path / "data")] == sorted(names)


def test_a_number_is_not_used_again_after_a_folder_was_moved_away(tmp_path):
    create_session_folder(tmp_path, "P01")
    second = create_session_folder(tmp_path, "P01")
    (tmp_path / "P01_001" / "recordings").rmdir()
    (tmp_path / "P01_001").rmdir()
    assert create_session_folder(tmp_path, "P01").name == "P01_003"
    assert second.name == "P01_002"


@pytest.mark.parametrize("code", ["", "JohnSmith", "Ada Lovelace", "ada@lab.org", "P01_2", "../P01", "P" * 17, "P01\n"])
def test_a_participant_is_a_code_and_never_a_name(code):
    with pytest.raises(WrongUseError) as error:
        check_subject(code)
    assert "1 to 16 letters and digits" in error.value.happened


def test_a_session_that_does_not_exist_is_named_with_those_that_do(tmp_path):
    create_session_folder(tmp_path, "P01").log.touch()
    with pytest.raises(WrongUseError, match="'P09_001' is neither.*Sessions there: P01_001"):
        find_session("P09_001", tmp_path)


def test_a_session_is_found_by_folder_and_by_name(tmp_path):
    folder = create_session_folder(tmp_path, "P01")
    folder.log.touch()
    assert find_session("P01_001", tmp_path).path == folder.path.resolve()
    assert find_session(str(folder.path), tmp_path / "elsewhere").path == folder.path.resolve()


def test_a_withdrawn_session_says_so(tmp_path):
    folder = create_session_folder(tmp_path, "P01")
    folder.tombstone.write_text("{}")
    with pytest.raises(StudyError, match="withdrew; the data were erased"):
        find_session("P01_001", tmp_path)
    folder.withdrawal.write_text("{}")
    with pytest.raises(StudyError, match="withdrew; not all data are erased yet"):
        find_session("P01_001", tmp_path)


def test_a_data_folder_that_cannot_be_made_is_said_so(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StudyError, match="The session folder cannot be made"):
        create_session_folder(tmp_path / "file" / "data", "P01")


def test_a_session_has_one_writer(tmp_path):
    folder = create_session_folder(tmp_path, "P01")
    with (
        hold_session_lock(folder.path),
        pytest.raises(StudyError, match="running elsewhere.*Another program is writing to P01_001"),
        hold_session_lock(folder.path),
    ):
        raise AssertionError("two writers")
    with hold_session_lock(folder.path):
        pass


def test_a_lock_that_cannot_be_made_is_said_so(tmp_path):
    (tmp_path / PLACES_LOCK_NAME).mkdir()
    with pytest.raises(StudyError, match="The data folder cannot be written to"), hold_places_lock(tmp_path):
        raise AssertionError("held")


def test_a_network_drive_without_locks_is_named_as_the_cause(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(pytest.importorskip("fcntl"), "flock", refuse)
    with pytest.raises(StudyError, match="The session's folder cannot be locked.*no file locks") as refused:
        hold_session_lock(tmp_path).__enter__()
    assert "local disk" in refused.value.do_now and "permissions" not in refused.value.do_now


def test_a_name_that_something_else_has_taken_is_skipped(tmp_path):
    """Such as a link to a disk that is not mounted, or another case of the letters where that is the same name."""
    (tmp_path / "P01_001").symlink_to(tmp_path / "not_mounted" / "P01_001")
    (tmp_path / "P01_002").write_text("")
    assert create_session_folder(tmp_path, "P01").name == "P01_003"


def test_a_session_without_a_log_is_not_said_to_be_missing(tmp_path):
    folder = create_session_folder(tmp_path, "P01")
    for session in ("P01_001", str(folder.path)):
        with pytest.raises(WrongUseError, match="This session has no log.*P01_001 holds no events.jsonl"):
            find_session(session, tmp_path)


def test_a_name_that_two_studies_have_is_refused_unless_its_path_is_given(tmp_path, monkeypatch):
    for study in ("mine", "theirs"):
        create_session_folder(tmp_path / study, "P01").log.touch()
    monkeypatch.chdir(tmp_path / "mine")
    for find in (find_session, find_session_to_withdraw):
        with pytest.raises(WrongUseError, match="Two sessions have this name"):
            find("P01_001", tmp_path / "theirs")
        for data in (tmp_path / "mine", tmp_path / "nothing"):
            assert find("P01_001", data).path == tmp_path / "mine" / "P01_001"
        assert find(str(tmp_path / "theirs" / "P01_001"), tmp_path / "mine").path == tmp_path / "theirs" / "P01_001"


def test_results_that_are_called_like_a_session_are_none(tmp_path):
    for name in ("results_2026", "P01_001"):
        (tmp_path / name).mkdir()
    assert [folder.name for folder in list_session_folders(tmp_path)] == ["P01_001"]
    (tmp_path / "results_2026" / "events.jsonl").touch()  # an older version may have taken any code
    assert [folder.name for folder in list_session_folders(tmp_path)] == ["P01_001", "results_2026"]


def test_a_session_is_found_from_within_its_folder(tmp_path, monkeypatch):
    folder = create_session_folder(tmp_path, "P01")
    folder.log.touch()
    monkeypatch.chdir(folder.path)
    for data in (tmp_path, tmp_path.parent):
        assert find_session(".", data).path == folder.path


def test_a_withdrawal_that_ends_while_it_is_looked_for_is_seen(tmp_path, monkeypatch):
    folder, exists = create_session_folder(tmp_path, "P01"), os.path.exists
    folder.withdrawal.write_text("{}")

    def end_withdrawal(path):
        found = exists(path)
        folder.tombstone.write_text("{}")
        folder.withdrawal.unlink(missing_ok=True)
        return found

    with monkeypatch.context() as ending:
        ending.setattr(os.path, "exists", end_withdrawal)
        assert folder.withdrawn
