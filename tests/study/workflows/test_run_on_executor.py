"""Pieces of work on an executor: what finished is handed over before an error ends the whole."""

import os
import platform
import resource
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future

import numpy as np
import pytest

from study.errors import StudyError
from study.workflows.run_on_executor import run_tasks
from study.workflows.worker_processes import open_worker_processes


class AtOnce(Executor):
    """Every piece is done as soon as it is handed over."""

    def submit(self, function, /, *arguments, **named):
        future: Future = Future()
        try:
            future.set_result(function(*arguments, **named))
        except ZeroDivisionError as error:
            future.set_exception(error)
        return future


def test_results_that_are_there_come_before_an_error_beside_them():
    pieces = [(number, (12, number % 2)) for number in range(20)]
    came = []
    with pytest.raises(ZeroDivisionError):
        for key, _ in run_tasks(AtOnce(), divmod, pieces):
            came.append(key)
    assert sorted(came) == [number for number in range(20) if number % 2]


def faults_of_arrays(rounds):
    """Pages that the system had to find (page faults): six arrays of 2 MB that are made and freed, round by round."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(rounds):
        arrays = [np.ones(2**18) for _ in range(6)]
        del arrays
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries have limits of their own")
def test_a_worker_keeps_the_memory_that_its_fits_free_and_ask_for_again():
    with open_worker_processes(1) as pool:
        ((_, faults),) = run_tasks(pool, faults_of_arrays, [("arrays", (100,))])
    once = 6 * 2**21 / resource.getpagesize()
    assert faults < 3 * once  # a hundred times as many where each round gets its pages anew


@pytest.mark.slow
def test_workers_of_power_do_not_load_what_draws():
    asked = "import sys; import study.workflows.planning.simulate_power; print('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True).stdout == "False\n"


def killed(number):
    """As by the system for want of memory."""
    os.kill(os.getpid(), signal.SIGKILL if number == 3 else 0)
    return number


@pytest.mark.timeout(120)
def test_a_killed_worker_is_an_error_that_says_what_is_kept_and_what_to_do():
    came = []
    told = pytest.raises(StudyError, match=r"worker process was killed.*finished is kept.*continues where it stopped")
    with told, open_worker_processes(1) as pool:
        for key, _ in run_tasks(pool, killed, ((number, (number,)) for number in range(6))):
            came.append(key)
    assert sorted(came) == [0, 1, 2]


@pytest.mark.timeout(120)
def test_workers_end_with_the_process_that_started_them():
    """They once finished their tasks beside those of the next run, and stayed for ever."""
    script = (
        "import os, time\nfrom study.workflows.worker_processes import open_worker_processes\n"
        "if __name__ == '__main__':\n"
        "    with open_worker_processes(1) as pool:\n"
        "        print(pool.submit(os.getpid).result(), flush=True)\n"
        "        pool.submit(time.sleep, 300).result()\n"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as calling:
        worker = int(calling.stdout.readline())
        calling.kill()
    for _ in range(600):
        try:
            os.kill(worker, 0)
        except ProcessLookupError:
            return
        time.sleep(0.1)
    os.kill(worker, signal.SIGKILL)
    pytest.fail("the worker still runs")
