"""Pool of worker processes for CPU-bound work, started by spawning."""

import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context

from study.errors import StudyError


@contextmanager
def open_worker_processes(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of `workers` processes, which ignore Ctrl-C. At the end of the context, also after an exception,
    running tasks are completed and waiting ones cancelled. Raises StudyError where a worker was killed."""
    # A fork would inherit the locks of threads (numba, OpenBLAS); a spawned process has none.
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _ignore_interrupts)
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


def _ignore_interrupts() -> None:
    """Ignore SIGINT in a worker: for Ctrl-C the terminal sends it to all processes, and the calling process handles
    it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
