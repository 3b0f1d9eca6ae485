"""Folders outside a data folder, noted for a withdrawal."""

from study.store.sessions.written_elsewhere import WRITTEN_ELSEWHERE_NAME, note_written_folder, read_written_folders


def test_each_folder_is_noted_once_also_with_a_line_break_in_its_name(tmp_path):
    data = tmp_path / "data"
    data.mkdir()
    outs = (tmp_path / "out", tmp_path / "two\nlines", tmp_path / "other")
    for out in (*outs, *outs):
        note_written_folder(data, out)
    assert read_written_folders(data) == outs
    assert (data / WRITTEN_ELSEWHERE_NAME).read_text().splitlines()[0] == str(outs[0])
