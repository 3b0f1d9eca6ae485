"""Pieces of work on an executor, on this computer or a cluster: each result is returned as soon as it is available."""

import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from functools import cache
from itertools import islice
from typing import Any, TypeVar

import numpy as np

Key = TypeVar("Key")
Result = TypeVar("Result")
AHEAD = 100
"""Largest number of pieces in flight, chosen by hand: it bounds the inputs and results in memory."""
_FREED_BYTES = 30 * 2**20
"""Size of the block that is allocated and freed: below the 32 MB up to which glibc raises its limit."""


def run_pieces(
    executor: Executor,
    function: Callable[..., Result],
    pieces: Iterable[tuple[Key, tuple[Any, ...]]],
    ahead: int = AHEAD,
) -> Iterator[tuple[Key, Result]]:
    """Call `function(*arguments)` for each (key, arguments), and yield (key, result) in the order of finishing.

    function, arguments and results are sent between processes. Exceptions of the function are raised here, after the
    results that are there by then. An early end cancels what was not begun. pieces: taken as they are needed.
    """
    waiting, running = iter(pieces), dict[Future[Result], Key]()
    try:
        while True:
            for key, arguments in islice(waiting, ahead - len(running)):
                running[executor.submit(_run_in_worker, tuple(sys.argv), function, arguments)] = key
            if not running:
                return
            done = wait(running, return_when=FIRST_COMPLETED).done
            # Results first: an error ends this, and must not lose what finished beside it.
            for future in sorted(done, key=lambda each: each.cancelled() or each.exception() is not None):
                key = running.pop(future)
                yield key, future.result()
    finally:
        for future in running:
            future.cancel()


@cache
def keep_freed_memory() -> None:
    """Let the C library keep the memory of freed arrays. It gives back what is above a limit, page by page, and fits
    ask for it again at once: that was a fourth of a simulated study's processor time. In glibc a freed block of up to
    32 MB that had pages of its own raises the limit to twice its size (M_MMAP_THRESHOLD); elsewhere this does nothing.
    """
    np.empty(_FREED_BYTES, np.uint8)


def _run_in_worker(command: tuple[str, ...], function: Callable[..., Result], arguments: tuple[Any, ...]) -> Result:
    """Runs in a worker. command: what was typed, which the provenance of results says, and not how a worker began."""
    sys.argv = list(command)
    keep_freed_memory()
    return function(*arguments)
