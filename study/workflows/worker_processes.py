"""Worker processes for CPU-bound work, started clean (spawned); running work is finished on leaving."""

import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context


@contextmanager
def worker_processes(workers: int) -> Iterator[ProcessPoolExecutor]:
    # Forking a process with numba's threads in it is not safe; a spawned one starts clean.
    """A process pool that ignores Ctrl-C in its workers."""
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _leave_ctrl_c_to_the_parent)
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _leave_ctrl_c_to_the_parent() -> None:
    """Ignore Ctrl-C in a worker: a terminal sends it to all processes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
