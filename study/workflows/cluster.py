"""Work on the workers of a dask scheduler: the same executor interface as for the processes of this computer.

Each worker imports hapteq itself, so that all must have the same version: other code could give other numbers.
"""

import threading
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

from study.errors import StudyError

if TYPE_CHECKING:
    from distributed import Client

PATIENCE_S = 10.0
"""Timeout in seconds for the scheduler to answer."""
WITHOUT_WORKERS_S = 60.0
"""Longest time in seconds that work waits at a scheduler without any worker, which may be starting anew."""
GLANCE_S = 1.0
"""Interval in seconds at which the workers are counted."""
INSTALL = "pip install 'hapteq[cluster]'"


@contextmanager
def cluster_workers(address: str, *, one_thread: bool = False) -> Iterator[Executor]:
    """address: of the scheduler, such as tcp://10.0.0.5:8786. A piece of work whose worker dies is done by another.
    one_thread: refuse workers that do several pieces at once, for work that draws figures or measures processor time.

    Raises StudyError where no scheduler answers, it has no workers, a worker has another version, or, later, where
    the scheduler is lost, workers die at the same piece again and again, or none is left for `WITHOUT_WORKERS_S`.
    """
    try:
        import dask
        from distributed import Client, KilledWorker
        from distributed.comm import CommClosedError
    except ImportError as missing:
        raise StudyError(
            "There is no access to a cluster",
            "The package distributed is not installed.",
            f"Install it: {INSTALL}. On this computer alone, use --workers.",
            saved="Nothing was begun.",
        ) from missing
    try:
        client = Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError) as problem:
        raise StudyError(
            "The scheduler does not answer",
            f"At {address}: {str(problem) or type(problem).__name__}.",
            "Start it with: dask scheduler. Then give the address that it prints.",
            saved="Nothing was begun.",
        ) from problem
    # A recording is sent to its worker as a value; distributed warns against such large arguments.
    with client, dask.config.set({"distributed.admin.large-graph-warning-threshold": "1 GB"}):
        _require_workers(client, address, one_thread)
        lone = threading.Event()
        try:
            with _executor(client) as executor, _watch(client, executor, lone):
                yield executor
        except (KilledWorker, CommClosedError, CancelledError) as problem:
            raise _undone_error(problem, address, lone) from problem
        except (RuntimeError, TypeError, ValueError) as problem:
            # A future that is lost with its scheduler has no result, and distributed's executor fails on unpacking it;
            # one that was given up for want of workers takes no more work.
            if client.status == "running" and not lone.is_set():
                raise
            raise _undone_error(problem, address, lone) from problem


@contextmanager
def _executor(client: "Client") -> Iterator[Executor]:
    """Of the client. What is not finished on leaving is cancelled: the executor's own end waits for it, and for what
    was finished and is made anew because its worker died."""
    executor = client.get_executor(pure=False)
    try:
        yield executor
    finally:
        executor.shutdown(wait=False)


@contextmanager
def _watch(client: "Client", executor: Executor, lone: threading.Event) -> Iterator[None]:
    """Cancel all work, and set `lone`, where there were no workers for `WITHOUT_WORKERS_S`."""
    left = threading.Event()
    watcher = threading.Thread(target=partial(_await_lone, client, executor, lone, left), daemon=True)
    watcher.start()
    try:
        yield
    finally:
        left.set()
        watcher.join()


def _await_lone(client: "Client", executor: Executor, lone: threading.Event, left: threading.Event) -> None:
    last_seen_s = time.monotonic()
    while not left.wait(GLANCE_S):
        try:
            workers = client.nthreads()
        except (OSError, TypeError, ValueError):  # of a scheduler that is lost, which the work itself notices
            return
        if workers:
            last_seen_s = time.monotonic()
        elif time.monotonic() - last_seen_s > WITHOUT_WORKERS_S:
            lone.set()
            executor.shutdown(wait=False)
            return


def _undone_error(problem: BaseException, address: str, lone: threading.Event) -> StudyError:
    kept = "What was finished is kept."
    if lone.is_set():
        return StudyError(
            "The cluster has no workers any more",
            f"For {WITHOUT_WORKERS_S:g} s the scheduler at {address} had none: they ended, or cannot reach it.",
            f"Start some: dask worker {address}. Then run the same command again: it goes on where it stopped.",
            saved=kept,
        )
    return StudyError(
        "The cluster did not do this",
        f"{type(problem).__name__}: {problem}.",
        "Look at the scheduler and its workers, then run the same command again: it goes on where it stopped.",
        saved=kept,
    )


def own_version() -> str:
    """Version of hapteq, here and on each worker; empty where it is not installed."""
    try:
        return version("hapteq")
    except PackageNotFoundError:
        return ""


def _require_workers(client: "Client", address: str, one_thread: bool) -> None:
    found: dict[str, str] = {}
    try:
        found = client.run(own_version)
    except ImportError:  # what a worker without hapteq says of the function that it is sent
        found = dict.fromkeys(client.scheduler_info()["workers"], "")
    if not found:
        raise _cluster_error(f"The scheduler at {address} has no workers.", f"Start some: dask worker {address}.")
    own = own_version()
    if wrong := sorted({each or "none" for each in found.values() if each != own}):
        raise _cluster_error(
            f"Workers at {address} have hapteq {', '.join(wrong)}; here it is {own}.",
            "Install the same version for all of them.",
        )
    threads = [worker["nthreads"] for worker in client.scheduler_info(n_workers=-1)["workers"].values()]
    if one_thread and max(threads) > 1:
        raise _cluster_error(
            f"Workers at {address} have up to {max(threads)} threads, and this work needs a process for each piece.",
            f"Start them with: dask worker {address} --nthreads 1 --nworkers auto.",
        )


def _cluster_error(happened: str, do_now: str) -> StudyError:
    return StudyError("The cluster cannot do this", happened, do_now, saved="Nothing was begun.")
