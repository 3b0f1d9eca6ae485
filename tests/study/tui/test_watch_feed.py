"""The process that reads a log for a screen."""

import os
import signal
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

import pytest

from study.session.facts.events import DeviceFacts, SessionOpened, encode_event
from study.tui.engine.watch_feed import WatchFeed

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]

ROOT = Path(__file__).parents[3]


@pytest.fixture
def session(tmp_path, small_protocol, small_text) -> Path:
    """A session that was just opened."""
    from protocols.document.hashing import hash_protocol

    folder = tmp_path / "P01_001"
    folder.mkdir()
    utc = datetime.now(UTC).isoformat(timespec="milliseconds")
    device = DeviceFacts("a device", simulated=True, sample_rate_hz=1000.0)
    opened = SessionOpened(
        utc, "hapteq-session", 1, "P01_001", "P01", 0, None, small_text, hash_protocol(small_protocol), False, 7,
        device, "none", {"hapteq": "0"},
    )  # fmt: skip
    (folder / "events.jsonl").write_bytes(encode_event(opened))
    return folder


def until(condition, most_s: float = 20.0):
    end_s = time.monotonic() + most_s
    while not condition():
        assert time.monotonic() < end_s
        time.sleep(0.02)
    return condition()


def gone(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    # A killed child of ours stays as a zombie until it is waited for.
    return Path(f"/proc/{pid}/stat").read_text().split(")")[1].split()[0] == "Z"


def test_views_come_and_continue_coming_and_the_child_ends_with_the_feed(session):
    feed = WatchFeed(str(session))
    try:
        first = until(feed.latest)
        assert (first.session, first.standing) == ("P01_001", "not running")
        assert until(lambda: feed.latest() is not first)
        assert feed.problem == ""
    finally:
        feed.close()
    assert gone(feed.child_pid)
    feed.close()


def test_a_log_that_cannot_be_followed_is_told_as_a_sentence(session):
    (session / "events.jsonl").write_bytes(b"{}\n")
    feed = WatchFeed(str(session))
    try:
        assert "The first line of the log of P01_001 is none" in until(lambda: feed.problem)
    finally:
        feed.close()


def test_a_problem_is_over_once_the_log_can_be_read_again(session):
    log = session / "events.jsonl"
    intact = log.read_bytes()
    log.write_bytes(b"{}\n")
    feed = WatchFeed(str(session))
    try:
        assert until(lambda: feed.problem)
        log.write_bytes(intact)
        assert until(feed.latest).session == "P01_001"
        assert until(lambda: not feed.problem)
    finally:
        feed.close()


def test_a_reader_that_dies_is_reported(session):
    feed = WatchFeed(str(session))
    try:
        until(feed.latest)
        os.kill(feed.child_pid, signal.SIGKILL)
        assert until(lambda: feed.problem) == "the program that reads the log has ended; leave, and watch again."
    finally:
        feed.close()


def test_the_child_dies_with_a_killed_parent(session, tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(
        "import sys, time\n"
        "from study.tui.engine.watch_feed import WatchFeed\n"
        "if __name__ == '__main__':\n"
        "    feed = WatchFeed(sys.argv[1])\n"
        "    while feed.latest() is None: time.sleep(0.02)\n"
        "    print(feed.child_pid, flush=True)\n"
        "    time.sleep(60)\n"
    )
    command = [sys.executable, str(script), str(session)]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)}
    ) as parent:
        child = int(parent.stdout.readline())
        parent.kill()
    until(lambda: gone(child))


def test_the_screens_process_loads_neither_numpy_nor_pydantic():
    script = (
        "import sys\n"
        "import study.cli.watch, study.tui.watch.watch_app, study.tui.engine.watch_feed\n"
        "import study.store.sessions.request_inbox\n"
        "print(*sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    )
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert loaded.isdisjoint({"numpy", "pydantic", "h5py", "scipy"})
