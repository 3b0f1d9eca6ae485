"""Tasks on an executor (processes of this computer, or a cluster), with results in the order of finishing.

The number of tasks in flight is bounded. Workers get the command line of the calling process, for the provenance of
their results, and keep freed memory, which saves processor time.
"""

import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from functools import cache
from itertools import islice
from typing import Any, TypeVar

import numpy as np

Key = TypeVar("Key")
Result = TypeVar("Result")
MAX_IN_FLIGHT = 100
"""Largest number of tasks in flight, set by hand: it bounds the inputs and results in memory."""
_FREED_BYTES = 30 * 2**20
"""Size of the block that `keep_freed_memory` allocates and frees: below 32 MB, the largest size to which glibc adapts
its thresholds."""


def run_tasks(
    executor: Executor,
    function: Callable[..., Result],
    tasks: Iterable[tuple[Key, tuple[Any, ...]]],
    max_running: int = MAX_IN_FLIGHT,
) -> Iterator[tuple[Key, Result]]:
    """Call `function(*arguments)` for each (key, arguments) of `tasks`, and yield (key, result) in the order of
    finishing. Function, arguments and results are sent between processes; `tasks` is read as needed, at most
    `max_running` in flight.

    An exception of the function is raised here, after the results that finished at the same time. When the iteration
    ends early, tasks that have not begun are cancelled.
    """
    waiting, running = iter(tasks), dict[Future[Result], Key]()
    try:
        while True:
            for key, arguments in islice(waiting, max_running - len(running)):
                running[executor.submit(_run_in_worker, tuple(sys.argv), function, arguments)] = key
            if not running:
                return
            done = wait(running, return_when=FIRST_COMPLETED).done
            # Results before errors: an error ends the iteration, and results that finished with it would be lost.
            for future in sorted(done, key=lambda finished: finished.cancelled() or finished.exception() is not None):
                key = running.pop(future)
                yield key, future.result()
    finally:
        for future in running:
            future.cancel()


@cache
def keep_freed_memory() -> None:
    """Let the C library keep the memory of freed arrays for reuse. By default it returns large blocks to the system,
    and fits allocate them again at once, page by page: a fourth of a simulated study's processor time. In glibc,
    freeing a separately mapped block of up to 32 MB raises M_MMAP_THRESHOLD to its size and M_TRIM_THRESHOLD to twice
    that.
    """
    np.empty(_FREED_BYTES, np.uint8)


def _run_in_worker(command: tuple[str, ...], function: Callable[..., Result], arguments: tuple[Any, ...]) -> Result:
    """Call the function in a worker process. command: command line of the calling process, which replaces the worker's
    own in the provenance of results."""
    sys.argv = list(command)
    keep_freed_memory()
    return function(*arguments)
