"""Forks that fail, and processes that are killed, interrupted or left alone."""

import errno
import os
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from study.workflows.forked_map import _pack_results, map_forked
from tests.study.workflows.forked_map.child_processes import children, slow


def refused(call, after: int, error: OSError):
    """A call that the system refuses after so many times."""
    left = [after]

    def refusing() -> object:
        if not left[0]:
            raise error
        left[0] -= 1
        return call()

    return refusing


@pytest.mark.parametrize("after", [0, 1])
def test_a_system_without_further_processes_leaves_the_work_to_those_there_are(monkeypatch, after):
    error = BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")
    monkeypatch.setattr(os, "fork", refused(os.fork, after, error))
    before = len(list(Path("/proc/self/fd").iterdir()))
    found = map_forked(slow, range(8), workers=4)
    assert [number for number, _ in found] == list(range(8))
    assert len({process for _, process in found}) == 1 + after
    assert len(list(Path("/proc/self/fd").iterdir())) == before
    assert children() == []


@pytest.mark.parametrize(("pipes", "processes"), [(0, 1), (1, 1), (2, 2)])
def test_too_many_open_files_leave_the_work_to_the_processes_there_are(monkeypatch, pipes, processes):
    monkeypatch.setattr(os, "pipe", refused(os.pipe, pipes, OSError(errno.EMFILE, "Too many open files")))
    found = map_forked(slow, range(8), workers=4)
    assert [number for number, _ in found] == list(range(8))
    assert len({process for _, process in found}) == processes
    assert children() == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_at_the_fork_ends_this_process_and_leaves_none(monkeypatch, tmp_path, number):
    fork, here, gone_on = os.fork, os.getpid(), tmp_path / "gone on"

    def forked() -> int:
        process = fork()
        signal.raise_signal(number)
        return process

    monkeypatch.setattr(os, "fork", forked)
    before = signal.signal(number, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            map_forked(slow, range(8))
        assert children() == []
    finally:
        if os.getpid() != here:
            gone_on.touch()
            os._exit(1)
        signal.signal(number, before)
    assert not gone_on.exists()
    assert not signal.pthread_sigmask(signal.SIG_BLOCK, ()) & {number}


def test_what_a_process_died_of_is_done_here():
    here = os.getpid()

    def dies(number: int) -> int:
        time.sleep(0.02)
        if os.getpid() != here:
            os._exit(1)
        return number

    assert map_forked(dies, range(6)) == list(range(6))


@pytest.mark.parametrize("wrong", range(4))
def test_an_error_is_raised_where_the_results_are_wanted_and_leaves_no_process(wrong):
    def inverse(number: int) -> float:
        time.sleep(0.02)
        return 1 / (number - wrong)

    with pytest.raises(ZeroDivisionError):
        map_forked(inverse, range(4))
    assert children() == []
    assert map_forked(abs, [-1, -2]) == [1, 2]


class TwoTextsError(Exception):
    """An error that is pickled, but cannot be made again from its message alone."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(f"{first} {second}")


def test_an_error_that_cannot_be_sent_is_raised_as_it_is(tmp_path):
    here = os.getpid()

    def failing_elsewhere(number: int) -> None:
        time.sleep(0.05)
        if os.getpid() != here:
            (tmp_path / str(number)).touch()
        if (tmp_path / str(number)).exists():
            raise TwoTextsError("no", "number")

    with pytest.raises(TwoTextsError, match="no number"):
        map_forked(failing_elsewhere, range(8))


def test_a_result_nested_too_deeply_is_left_out_and_the_others_are_sent():
    nested: list[object] = []
    for _ in range(10 * sys.getrecursionlimit()):
        nested = [nested]
    assert pickle.loads(_pack_results({0: (nested, None), 1: (7, None)}, {})) == (1, (7, None))


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_ctrl_c_ends_a_program_and_all_its_processes():
    program = (
        "import os, signal, time\n"
        # A shell that starts this in the background has it ignored, and children inherit that.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from study.workflows.forked_map import map_forked\n"
        "def work(_):\n"
        "    os.write(1, f'{os.getpid()}\\n'.encode())\n"  # at once: two processes write
        "    time.sleep(50)\n"
        "map_forked(work, range(8), workers=2)\n"
    )
    root = Path(__file__).parents[4]
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=root, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True,
    )  # fmt: skip
    assert process.stdout is not None
    workers = {int(process.stdout.readline()) for _ in range(2)}
    assert len(workers) == 2
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(20) != 0
    process.stdout.close()
    for worker in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(worker, 0)


def test_a_process_whose_parent_is_killed_ends_though_its_answers_fill_the_pipe(tmp_path):
    program = f"""
import os, pathlib, signal, time
from study.workflows.forked_map import map_forked
place = pathlib.Path({str(tmp_path)!r})
def piece(number):
    if os.getpid() == here:
        time.sleep(0.3)
        while not list(place.iterdir()):
            time.sleep(0.01)
        os.kill(here, signal.SIGKILL)
    (place / str(os.getpid())).touch()
    return b"x" * 1_000_000
here = os.getpid()
map_forked(piece, range(2), workers=2)
"""
    subprocess.run([sys.executable, "-c", program], check=False, timeout=60)
    (child,) = (int(path.name) for path in tmp_path.iterdir())
    until = time.monotonic() + 10
    while Path(f"/proc/{child}").exists() and "Z" not in Path(f"/proc/{child}/stat").read_text().split()[2]:
        assert time.monotonic() < until, "it waits for its answers to be read"
        time.sleep(0.05)
