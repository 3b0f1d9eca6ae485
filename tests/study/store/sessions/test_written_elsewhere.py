"""Folders outside a data folder, noted for a withdrawal."""

import os
import stat

from study.regular_file import MAX_DOCUMENT_BYTES
from study.store.sessions import written_elsewhere
from study.store.sessions.written_elsewhere import WRITTEN_ELSEWHERE_NAME, note_written_folder, read_written_folders


def test_each_folder_is_noted_once_also_with_a_line_break_in_its_name(tmp_path):
    data = tmp_path / "data"
    data.mkdir()
    outs = (tmp_path / "out", tmp_path / "two\nlines", tmp_path / "other")
    for out in (*outs, *outs):
        note_written_folder(data, out)
    assert read_written_folders(data) == outs
    assert (data / WRITTEN_ELSEWHERE_NAME).read_text().splitlines()[0] == str(outs[0])


def test_a_list_that_cannot_be_read_is_not_replaced(tmp_path):
    (tmp_path / "data").mkdir()
    note_written_folder(tmp_path / "data", tmp_path / "old")
    list_path = tmp_path / "data" / WRITTEN_ELSEWHERE_NAME
    os.truncate(list_path, MAX_DOCUMENT_BYTES + 1)
    note_written_folder(tmp_path / "data", tmp_path / "new")
    assert read_written_folders(tmp_path / "data") == ()
    with list_path.open("rb") as file:
        assert file.readline() == os.fsencode(tmp_path / "old") + b"\n"


def test_a_list_whose_folder_cannot_be_synced_ends_nothing(tmp_path, monkeypatch):
    (tmp_path / "data").mkdir()

    def fail(folder):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr("study.store.sessions.written_elsewhere.sync_folder", fail)
    note_written_folder(tmp_path / "data", tmp_path / "out")
    assert read_written_folders(tmp_path / "data") == (tmp_path / "out",)


def test_a_data_folder_that_is_called_like_a_session_is_none(tmp_path):
    data = tmp_path / "study_2026"
    (data / "P01_001").mkdir(parents=True)
    (data / "P01_001" / "events.jsonl").touch()
    note_written_folder(data, tmp_path / "out")
    note_written_folder(data / "P01_001", tmp_path / "other")
    assert read_written_folders(data) == (tmp_path / "out", tmp_path / "other")
    assert not (tmp_path / WRITTEN_ELSEWHERE_NAME).exists()


def test_what_is_written_below_a_folder_that_is_called_like_a_session_is_noted(tmp_path):
    note_written_folder(tmp_path, tmp_path / "results_2026" / "first")
    assert read_written_folders(tmp_path) == (tmp_path / "results_2026" / "first",)


def test_two_programs_that_note_at_the_same_time_lose_nothing(tmp_path, monkeypatch):
    read_list = written_elsewhere._read_list

    def read_while_another_writes(data):
        noted = read_list(data)
        monkeypatch.setattr(written_elsewhere, "_read_list", read_list)
        note_written_folder(tmp_path, tmp_path / "a" / "theirs")
        return noted

    monkeypatch.setattr(written_elsewhere, "_read_list", read_while_another_writes)
    note_written_folder(tmp_path, tmp_path / "a" / "mine")
    assert set(read_written_folders(tmp_path)) == {tmp_path / "a" / "theirs", tmp_path / "a" / "mine"}


def test_a_list_that_was_edited_keeps_its_last_line(tmp_path):
    (tmp_path / WRITTEN_ELSEWHERE_NAME).write_text("/mnt/old")
    note_written_folder(tmp_path, tmp_path / "a" / "new")
    assert [str(folder) for folder in read_written_folders(tmp_path)] == ["/mnt/old", str(tmp_path / "a" / "new")]


def test_the_folder_of_a_new_list_is_synced(tmp_path, monkeypatch):
    (tmp_path / "data").mkdir()
    synced = []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append(os.fstat(descriptor)))
    note_written_folder(tmp_path / "data", tmp_path / "out")
    assert [stat.S_ISDIR(status.st_mode) for status in synced] == [False, True]
    assert synced[1].st_ino == (tmp_path / "data").stat().st_ino
