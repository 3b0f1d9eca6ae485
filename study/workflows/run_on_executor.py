"""Run tasks on an executor (processes of this computer, or a cluster), and yield results in the order of completion.

The number of tasks in flight (submitted, not finished) is bounded. Workers get the command line of the calling process,
for the provenance of their results, and keep freed memory, which saves processor time.
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
"""Largest number of tasks in flight by default. Chosen: bounds the memory for arguments and results."""
_FREED_BYTES = 30 * 2**20
"""Size of the block that `keep_freed_memory` allocates and frees (bytes): below 32 MiB, the largest size to which glibc
adapts its thresholds (DEFAULT_MMAP_THRESHOLD_MAX on 64-bit systems)."""


def run_tasks(
    executor: Executor,
    function: Callable[..., Result],
    tasks: Iterable[tuple[Key, tuple[Any, ...]]],
    max_in_flight: int = MAX_IN_FLIGHT,
) -> Iterator[tuple[Key, Result]]:
    """Call `function(*arguments)` for each (key, arguments) of `tasks`, and yield (key, result) in the order of
    completion. Function, arguments and results must be picklable. `tasks` is read only as far as needed to keep
    `max_in_flight` tasks in flight.

    An exception of the function is raised here, after the results that finished at the same time. When the iteration
    ends early, tasks that have not begun are cancelled.
    """
    remaining_tasks, keys_in_flight = iter(tasks), dict[Future[Result], Key]()
    try:
        while True:
            for key, arguments in islice(remaining_tasks, max_in_flight - len(keys_in_flight)):
                keys_in_flight[executor.submit(_run_in_worker, tuple(sys.argv), function, arguments)] = key
            if not keys_in_flight:
                return
            finished_futures = wait(keys_in_flight, return_when=FIRST_COMPLETED).done
            # Results before errors: an error ends the iteration, and results that finished with it would be lost.
            for future in sorted(
                finished_futures,
                key=lambda finished_future: finished_future.cancelled() or finished_future.exception() is not None,
            ):
                key = keys_in_flight.pop(future)
                yield key, future.result()
    finally:
        for future in keys_in_flight:
            future.cancel()


@cache
def keep_freed_memory() -> None:
    """Let the C library keep the memory of freed arrays for reuse, once per process. By default it returns large blocks
    to the system, and fits allocate them again immediately, page by page, which took a fourth of the processor time of
    a simulated study. In glibc, freeing a separately mapped block of up to 32 MiB raises M_MMAP_THRESHOLD to its size
    and M_TRIM_THRESHOLD to twice that (mallopt(3)); other C libraries ignore it."""
    np.empty(_FREED_BYTES, np.uint8)


def _run_in_worker(command: tuple[str, ...], function: Callable[..., Result], arguments: tuple[Any, ...]) -> Result:
    """Call the function in a worker process. command: `sys.argv` of the calling process, which replaces that of the
    worker for the provenance of results."""
    sys.argv = list(command)
    keep_freed_memory()
    return function(*arguments)
