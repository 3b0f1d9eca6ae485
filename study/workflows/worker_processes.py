"""Pool of worker processes for CPU-bound work, started by spawning."""

import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context, parent_process

from study.errors import StudyError


@contextmanager
def open_worker_processes(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of `workers` processes, which ignore Ctrl-C, and end where the calling process is killed. At the end
    of the context, also after an exception, running tasks are completed and waiting ones cancelled. Raises StudyError
    where a worker was killed."""
    # A fork would inherit the locks of threads (numba, OpenBLAS); a spawned process has none.
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _initialise_worker)
    try:
        yield pool
    except BrokenProcessPool as broken_pool:
        raise StudyError(
            "A worker process was killed",
            "It ended without an error of its own: it was killed, or the system lacked memory.",
            "Run the same command again: it continues where it stopped. Where memory is short, use fewer --workers.",
            saved="What was finished is kept.",
        ) from broken_pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _initialise_worker() -> None:
    """Ignore SIGINT in a worker: for Ctrl-C the terminal sends it to all processes, and the calling process handles it.
    Start a thread that ends the worker with the calling process: without it, a worker of a killed process would finish
    its tasks beside those of the next run, and then wait for others for ever."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Wait for the end of the process that started this one, then end this one at once."""
    parent = parent_process()
    assert parent is not None, "a worker is started by another process"
    parent.join()
    os._exit(1)
