"""Worker processes for CPU-bound work, started clean (spawned); running work is finished on leaving."""

import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context

from study.errors import StudyError


@contextmanager
def worker_processes(workers: int) -> Iterator[ProcessPoolExecutor]:
    """A process pool that ignores Ctrl-C in its workers. Raises StudyError where one of them is killed."""
    # Forking a process with numba's threads in it is not safe; a spawned one starts clean.
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _leave_ctrl_c_to_the_parent)
    try:
        yield pool
    except BrokenProcessPool as died:
        raise StudyError(
            "A worker process was killed",
            "It ended without an error of its own: it was killed, or the system lacked memory.",
            "Run the same command again: it continues where it stopped. Where memory is short, use fewer --workers.",
            saved="What was finished is kept.",
        ) from died
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _leave_ctrl_c_to_the_parent() -> None:
    """Ignore Ctrl-C in a worker: a terminal sends it to all processes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
