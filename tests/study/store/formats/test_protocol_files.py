"""Protocols and their locks on a real disk, and every refusal."""

from pathlib import Path

import pytest

from protocols.document.hashing import hash_protocol
from protocols.document.lock import lock_from_json
from study.errors import ExitCode, StudyError, WrongUseError
from study.local_clock import convert_to_machine_zone
from study.session.views.local_time import format_time_in_zone
from study.store.disk.file_errors import CannotReadError, CannotWriteError, UnusableFileError
from study.store.formats.protocol_files import (
    LockedProtocolChangedError,
    ProtocolRefusedError,
    list_shipped_protocols,
    lock_protocol,
    read_protocol,
    read_recording_protocol,
    read_study_protocol,
)

WHEN = "2024-05-01T09:00:00+00:00"


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A copy of the shipped study under the same name, as a lab would begin."""
    path = tmp_path / "protocols" / "mine.toml"
    path.parent.mkdir()
    path.write_text(read_protocol("direction_threshold").text, encoding="utf-8")
    return path


@pytest.fixture
def data(tmp_path: Path) -> Path:
    folder = tmp_path / "data"
    folder.mkdir()
    return folder


def change(path: Path) -> None:
    path.write_text(path.read_text("utf-8").replace("start_n = 1.0", "start_n = 1.5"), encoding="utf-8")


def test_the_shipped_protocols_are_listed_and_each_can_be_read():
    studies, recordings = {"direction_threshold", "direction_training", "equalized_threshold"}, {"ellipsoid", "sweep"}
    recordings |= {"sweep_band", "sweep_study", "sweep_hand", "multisine", "daily_check"}
    assert studies | recordings <= set(list_shipped_protocols())
    for name in list_shipped_protocols():
        found = read_protocol(name)
        assert (found.protocol.name, found.path, found.locked) == (name, None, False)
        assert f'name = "{name}"' in found.text


def test_a_file_is_read_by_its_path(mine):
    found = read_study_protocol(str(mine))
    assert found.path == mine
    assert found.protocol == read_study_protocol("direction_threshold").protocol


def test_a_byte_order_mark_and_windows_line_ends_do_no_harm(mine):
    mine.write_bytes(b"\xef\xbb\xbf" + mine.read_bytes().replace(b"\n", b"\r\n"))
    assert read_protocol(str(mine)).protocol == read_protocol("direction_threshold").protocol


def test_an_unknown_name_is_refused_with_a_guess_and_the_list():
    with pytest.raises(WrongUseError) as caught:
        read_protocol("direction_treshold")
    assert caught.value.happened == (
        "'direction_treshold' is neither a file nor a shipped protocol. Did you mean direction_threshold?"
    )
    assert caught.value.do_now.endswith(f"one of {', '.join(list_shipped_protocols())}.")
    assert caught.value.exit_code is ExitCode.WRONG_USE


@pytest.mark.parametrize("name", ["none.toml", "no/such/file"])
def test_a_path_to_nothing_is_refused(name):
    with pytest.raises(CannotReadError, match="There is no file"):
        read_protocol(name)


def test_a_folder_is_no_protocol(data):
    with pytest.raises(CannotReadError, match="is a folder"):
        read_protocol(str(data))


def test_bytes_that_are_no_text_are_refused(mine):
    mine.write_bytes(b"name = '\xff'")
    with pytest.raises(CannotReadError, match="text in UTF-8"):
        read_protocol(str(mine))


def test_a_wrong_file_is_refused_with_file_key_and_what_is_allowed(mine):
    mine.write_text(mine.read_text("utf-8").replace("start_n = 1.0", "start_mN = 1000"), encoding="utf-8")
    with pytest.raises(ProtocolRefusedError) as caught:
        read_protocol(str(mine))
    error = caught.value
    assert error.title == "mine.toml is not a usable protocol"
    assert "mine.toml: staircase.start_mN is no key of [staircase]; did you mean start_n" in error.happened
    assert error.do_now.startswith("Correct the file and run the command again")
    assert [problem.key for problem in error.problems] == ["staircase.start_mN"]


def test_a_recording_cannot_be_taken_by_a_participant():
    with pytest.raises(WrongUseError) as caught:
        read_study_protocol("sweep")
    assert caught.value.happened == "'sweep' is a recording protocol, not one that a participant can take."
    assert "`hapteq record`" in caught.value.do_now


def test_a_study_cannot_be_recorded():
    with pytest.raises(WrongUseError) as caught:
        read_recording_protocol("direction_threshold")
    assert caught.value.happened == "'direction_threshold' is a study protocol, not one that a device can record."
    assert "`hapteq study`" in caught.value.do_now


def test_a_lock_says_which_protocol_when_and_by_which_version(data):
    found = read_protocol("direction_threshold")
    path = lock_protocol(found, data, WHEN, "0.1.0")
    assert path == data / "direction_threshold.lock.json"
    lock = lock_from_json(path.read_text("utf-8"))
    assert (lock.name, lock.hash) == ("direction_threshold", hash_protocol(found.protocol))
    assert (lock.locked_utc, lock.hapteq) == (WHEN, "0.1.0")
    assert read_study_protocol("direction_threshold", data).lock == lock
    assert not read_study_protocol("direction_training", data).locked


def test_locking_the_same_again_leaves_the_first_lock(data):
    found = read_protocol("direction_threshold")
    before = lock_protocol(found, data, WHEN, "0.1.0").read_bytes()
    assert lock_protocol(found, data, "2030-01-01T00:00:00+00:00", "9.9").read_bytes() == before


def test_a_locked_protocol_that_changed_is_refused_before_data_come_in(mine):
    path = lock_protocol(read_protocol(str(mine)), mine.parent, WHEN, "0.1.0")
    assert read_study_protocol(str(mine)).locked
    change(mine)
    with pytest.raises(LockedProtocolChangedError) as caught:
        read_study_protocol(str(mine))
    error = caught.value
    assert error.title == "This protocol is locked, and it is not the locked one"
    assert str(path) in error.happened
    assert f"was locked on {format_time_in_zone(WHEN, convert_to_machine_zone)} and has changed since" in error.happened
    assert error.saved == "Nothing was changed, and no session was begun."
    assert error.do_now.startswith("Restore the locked version")


def test_a_lock_beside_the_data_holds_for_a_file_elsewhere(mine, data):
    lock_protocol(read_protocol(str(mine)), data, WHEN, "0.1.0")
    change(mine)
    with pytest.raises(LockedProtocolChangedError):
        read_study_protocol(str(mine), data)


def test_only_a_comment_changed_and_the_lock_still_fits(mine):
    lock_protocol(read_protocol(str(mine)), mine.parent, WHEN, "0.1.0")
    mine.write_text("# checked by both of us\n" + mine.read_text("utf-8"), encoding="utf-8")
    assert read_study_protocol(str(mine)).locked


def test_another_version_cannot_be_locked_over_the_first(mine, data):
    lock_protocol(read_protocol(str(mine)), data, WHEN, "0.1.0")
    change(mine)
    with pytest.raises(LockedProtocolChangedError):
        lock_protocol(read_protocol(str(mine)), data, WHEN, "0.1.0")


def test_a_damaged_lock_is_refused_rather_than_passed_over(data):
    path = lock_protocol(read_protocol("sweep"), data, WHEN, "0.1.0")
    path.write_text(path.read_text("utf-8")[:40], encoding="utf-8")
    with pytest.raises(UnusableFileError, match=r"sweep\.lock\.json is not a usable protocol lock"):
        read_recording_protocol("sweep", data)


def test_a_lock_needs_its_folder(tmp_path):
    with pytest.raises(CannotWriteError, match="There is no folder"):
        lock_protocol(read_protocol("sweep"), tmp_path / "nowhere", WHEN, "0.1.0")


def test_every_refusal_is_an_error_that_a_person_can_act_on(mine):
    mine.write_text("kind = ", encoding="utf-8")
    with pytest.raises(StudyError, match=r"line 1.*Correct the file"):
        read_protocol(str(mine))
