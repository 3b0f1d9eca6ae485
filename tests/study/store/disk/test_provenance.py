import hashlib
import json
import os

import pytest

from study.store.disk.file_errors import CannotReadError
from study.store.disk.json_document import read_json, write_json
from study.store.disk.provenance import PACKAGES, anonymise_arguments, compute_sha256, gather_provenance, list_versions
from study.store.sessions.written_elsewhere import note_written_folder, read_written_folders


def test_parents_are_named_without_their_folder_and_with_their_content(tmp_path):
    (tmp_path / "sweep.h5").write_bytes(b"data")
    found = gather_provenance(protocol_hash="abc", seeds={"session": 7}, parents=[tmp_path / "sweep.h5"]).as_dict()
    assert found["parents"] == [{"file": "sweep.h5", "sha256": hashlib.sha256(b"data").hexdigest()}]
    assert (found["protocol_hash"], found["seeds"]) == ("abc", {"session": 7})
    assert str(tmp_path) not in json.dumps(found)


def test_what_is_not_known_is_left_out():
    assert set(gather_provenance().as_dict()) == {"versions", "command", "parents"}


def test_versions_name_everything_that_computes():
    assert set(list_versions()) == {"python", *PACKAGES}
    assert list_versions()["numpy"][0].isdigit()


def test_the_command_line_keeps_options_and_loses_folders():
    typed = (
        "/home/me/bin/hapteq",
        "identify",
        "data/sweep.h5",
        "--out=/data/me/model.h5",
        "--band",
        "5",
        "C:\\me\\a.h5",
    )
    assert anonymise_arguments(typed)[:5] == ("hapteq", "identify", "sweep.h5", "--out=model.h5", "--band")


def test_a_parent_that_is_not_there_is_named(tmp_path):
    with pytest.raises(CannotReadError, match="There is no file"):
        compute_sha256(tmp_path / "none")


def test_file_names_that_are_not_utf8_do_not_stop_what_is_written(tmp_path):
    name = os.fsdecode(b"caf\xe9")
    path = tmp_path / f"{name}.h5"
    path.write_bytes(b"x")
    assert anonymise_arguments(("/bin/hapteq", f"/data/{name}", name, f"--out={name}"))[1:] == (
        "caf?",
        "caf?",
        "--out=caf?",
    )
    origin = gather_provenance(parents=[path])
    assert origin.parents[0].file == "caf?.h5"
    write_json(tmp_path / "a.json", "some", 1, {"about": name}, origin)
    assert read_json(tmp_path / "a.json", "some", 1)["about"] == "caf?"


def test_copies_are_found_again_under_any_name(tmp_path):
    outs = [tmp_path / "out" / name for name in ("plain", "line\u2028end", os.fsdecode(b"caf\xe9"))]
    (tmp_path / "data").mkdir()
    for out in outs:
        note_written_folder(tmp_path / "data", out)
    assert read_written_folders(tmp_path / "data") == tuple(outs)
