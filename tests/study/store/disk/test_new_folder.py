"""A folder of results is there whole, or not at all."""

import os

import pytest

from study.errors import StudyError
from study.store.disk import atomic_write
from study.store.disk.file_errors import CannotWriteError, NotSyncedError
from study.store.disk.new_folder import create_new_folder, require_new_folder


def test_what_was_written_stands_under_its_name_in_the_end(tmp_path):
    with create_new_folder(tmp_path / "out") as folder:
        (folder / "a").write_text("1")
        assert not (tmp_path / "out").exists()
    assert (tmp_path / "out" / "a").read_text() == "1"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("end", [KeyboardInterrupt, ValueError])
def test_ended_early_it_leaves_nothing(tmp_path, end):
    with pytest.raises(end), create_new_folder(tmp_path / "out") as folder:
        (folder / "a").write_text("1")
        raise end
    assert list(tmp_path.iterdir()) == []


def test_an_empty_folder_may_be_filled(tmp_path):
    (tmp_path / "out").mkdir()
    with create_new_folder(tmp_path / "out") as folder:
        (folder / "a").write_text("1")
    assert (tmp_path / "out" / "a").exists()


def test_what_is_there_already_is_never_mixed_with(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine").write_text("1")
    with pytest.raises(StudyError, match="holds files already") as refused:
        require_new_folder(tmp_path / "out")
    assert (refused.value.title, refused.value.saved) == (
        "The results need a folder of their own", "Nothing was written."
    )  # fmt: skip
    (tmp_path / "file").write_text("1")
    with pytest.raises(StudyError, match="is a file"):
        require_new_folder(tmp_path / "file")


def test_a_folder_that_was_filled_meanwhile_is_left_alone(tmp_path):
    with pytest.raises(StudyError, match="holds files already"), create_new_folder(tmp_path / "out"):
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "mine").write_text("1")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["mine"]


def test_where_only_the_folder_above_is_not_synced_the_results_are_said_to_be_there(tmp_path, monkeypatch):
    def fail_to_sync(folder):
        if folder == tmp_path:
            raise OSError(5, "Input/output error")

    monkeypatch.setattr(atomic_write, "sync_folder", fail_to_sync)
    with pytest.raises(NotSyncedError, match="out is in place and complete"), create_new_folder(tmp_path / "out"):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("is_there", [True, False])
def test_a_link_is_filled_where_it_leads(tmp_path, is_there):
    """Such as a link to another disk."""
    (tmp_path / "disk" / "real").mkdir(parents=True)
    (tmp_path / "out").symlink_to(tmp_path / "disk" / "real")
    if not is_there:
        (tmp_path / "disk" / "real").rmdir()
    with create_new_folder(tmp_path / "out") as folder:
        (folder / "a").write_text("1")
    assert [path.name for path in (tmp_path / "disk").iterdir()] == ["real"]
    assert (tmp_path / "out").is_symlink() and (tmp_path / "disk" / "real" / "a").read_text() == "1"


def test_a_link_in_a_circle_is_refused_before_the_results_are_made(tmp_path):
    (tmp_path / "out").symlink_to(tmp_path / "out")
    with pytest.raises(CannotWriteError):
        require_new_folder(tmp_path / "out")


def test_the_folder_above_must_be_there(tmp_path):
    with pytest.raises(StudyError, match="There is no folder"):
        require_new_folder(tmp_path / "no" / "out")


def test_a_place_that_cannot_be_written_to_is_refused_before_any_work(tmp_path):
    with pytest.raises(CannotWriteError, match="was not written"):
        require_new_folder(tmp_path / ("x" * 300))
    (tmp_path / "closed").mkdir()
    (tmp_path / "closed").chmod(0o555)
    if os.access(tmp_path / "closed", os.W_OK):
        pytest.skip("the user who runs this may write anywhere")
    with pytest.raises(CannotWriteError, match="was not written"):
        require_new_folder(tmp_path / "closed" / "out")
