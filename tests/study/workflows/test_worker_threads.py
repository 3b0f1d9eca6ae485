"""Work in parallel: in order, with its errors, from within itself, and left at once."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from study.workflows.worker_threads import worker_threads

pytestmark = pytest.mark.real_time


def test_results_come_in_order_whoever_is_first():
    with worker_threads(4) as threads:
        assert threads.map(lambda s: (time.sleep(s), s)[1], [0.05, 0.0, 0.02]) == [0.05, 0.0, 0.02]
        assert threads.map(pow, [2, 3], [3, 2]) == [8, 9]
        assert threads.map(str, []) == []


def test_two_are_at_work_at_once():
    meeting = threading.Barrier(2, timeout=10)
    with worker_threads(2) as threads:
        assert len(threads.map(lambda _: meeting.wait(), range(2))) == 2


def test_an_error_is_raised_where_the_results_are_wanted():
    with worker_threads(2) as threads:
        with pytest.raises(ZeroDivisionError):
            threads.map(lambda n: 1 / n, [1, 0, 2])
        assert threads.map(abs, [-1]) == [1]


def test_work_within_work_does_not_wait_for_itself():
    with worker_threads(2) as threads:
        assert threads.map(lambda n: sum(threads.map(abs, range(n))), [3, 4, 5, 6]) == [3, 6, 10, 15]


def test_one_worker_works_in_the_thread_that_asks():
    with worker_threads(1) as threads:
        assert threads.map(lambda _: threading.current_thread(), [0]) == [threading.main_thread()]


@pytest.mark.timeout(60)
def test_ctrl_c_ends_a_program_while_its_workers_are_busy():
    program = (
        "import signal, time\n"
        # A shell that starts this in the background has it ignored, and children inherit that.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from study.workflows.worker_threads import worker_threads\n"
        "with worker_threads(2) as threads:\n"
        "    print('busy', flush=True)\n"
        "    threads.map(lambda _: time.sleep(50), range(8))\n"
    )
    root = Path(__file__).parents[3]
    process = subprocess.Popen(
        [sys.executable, "-c", program], cwd=root, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b"busy\n"
    time.sleep(0.3)
    began_s = time.monotonic()
    os.kill(process.pid, signal.SIGINT)
    assert process.wait(20) != 0
    process.stdout.close()
    assert time.monotonic() - began_s < 10
