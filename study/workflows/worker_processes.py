"""Processes for work that holds Python's lock: each begins clean, and what is being done is finished when left."""

import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context


@contextmanager
def worker_processes(workers: int) -> Iterator[ProcessPoolExecutor]:
    # Forking a process with numba's threads in it is not safe; a spawned one starts clean.
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _leave_ctrl_c_to_the_parent)
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _leave_ctrl_c_to_the_parent() -> None:
    """A terminal sends Ctrl-C to all."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
