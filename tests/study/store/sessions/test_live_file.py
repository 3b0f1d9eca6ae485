"""The live state of a session on disk: whole or nothing."""

import json
import math
import threading
from dataclasses import replace

import pytest

from study.session.watching.live_state import LiveState
from study.store.sessions.live_file import LIVE_NAME, read_live, remove_live, write_live

LIVE = LiveState(
    utc="2026-11-22T10:00:00.000+00:00",
    activity="trial",
    since_utc="2026-11-22T09:59:58.000+00:00",
    fault="",
    offset_mm=1.5,
    handle_ready=True,
    acceleration_mps2=3.25,
    sensor_clipped=False,
    missed_ticks=2,
)


def test_what_is_written_is_read(tmp_path):
    write_live(tmp_path, LIVE)
    assert read_live(tmp_path) == LIVE
    quiet = replace(LIVE, activity="waiting for the handle", offset_mm=None, acceleration_mps2=None)
    write_live(tmp_path, quiet)
    assert read_live(tmp_path) == quiet


def test_the_file_says_what_it_is(tmp_path):
    write_live(tmp_path, LIVE)
    document = json.loads((tmp_path / LIVE_NAME).read_text())
    assert (document["format"], document["version"]) == ("hapteq-live", 1)
    assert [path.name for path in tmp_path.iterdir()] == [LIVE_NAME]


def test_a_number_that_json_does_not_have_is_no_number(tmp_path):
    write_live(tmp_path, replace(LIVE, acceleration_mps2=math.nan, offset_mm=math.inf))
    assert read_live(tmp_path) == replace(LIVE, acceleration_mps2=None, offset_mm=None)


def test_without_a_file_nothing_is_known(tmp_path):
    assert read_live(tmp_path) is None
    remove_live(tmp_path)


def test_it_can_be_taken_away(tmp_path):
    write_live(tmp_path, LIVE)
    remove_live(tmp_path)
    assert read_live(tmp_path) is None


def test_a_folder_that_cannot_be_written_ends_no_session(tmp_path):
    write_live(tmp_path / "gone", LIVE)


def test_no_part_of_the_file_is_taken_for_the_whole(tmp_path):
    write_live(tmp_path, LIVE)
    whole = (tmp_path / LIVE_NAME).read_bytes()
    for length in range(len(whole) - 1):  # without its last line end it is whole
        (tmp_path / LIVE_NAME).write_bytes(whole[:length])
        assert read_live(tmp_path) is None or length == len(whole) - 1


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("version", 2),
        ("format", "hapteq-session"),
        ("activity", "sleeping"),
        ("offset_mm", "far"),
        ("offset_mm", math.nan),
        ("handle_ready", 1),
        ("missed_ticks", 1.5),
        ("missed_ticks", True),
        ("utc", None),
        ("direction", 1),
    ],
)
def test_a_file_with_one_wrong_value_is_not_used(tmp_path, name, value):
    write_live(tmp_path, LIVE)
    document = json.loads((tmp_path / LIVE_NAME).read_text())
    (tmp_path / LIVE_NAME).write_text(json.dumps({**document, name: value}))
    assert read_live(tmp_path) is None


@pytest.mark.parametrize("content", [b"", b"null", b"[]", b"\xff\xfe", b"[" * 50_000])
def test_garbage_is_not_used(tmp_path, content):
    (tmp_path / LIVE_NAME).write_bytes(content)
    assert read_live(tmp_path) is None


def test_a_reader_never_sees_half_a_state(tmp_path):
    write_live(tmp_path, LIVE)
    done = threading.Event()

    def write() -> None:
        for number in range(300):
            write_live(tmp_path, replace(LIVE, missed_ticks=number))
        done.set()

    writer = threading.Thread(target=write)
    writer.start()
    seen = []
    while not done.is_set():
        seen.append(read_live(tmp_path))
    writer.join()
    assert None not in seen
    assert read_live(tmp_path).missed_ticks == 299
