"""Work on the workers of a dask scheduler: the same executor interface as for the processes of this computer.

Each worker imports hapteq itself, so that all must have the same version: other code could give other numbers.
"""

import threading
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

from study.errors import StudyError

if TYPE_CHECKING:
    from distributed import Client

SCHEDULER_TIMEOUT_S = 10.0
"""Timeout in seconds for the scheduler to answer."""
WORKER_TIMEOUT_S = 60.0
"""Longest time in seconds that work waits without any worker, or for a scheduler that names none: either may be
starting anew."""
POLL_S = 1.0
"""Interval in seconds at which the workers are counted."""
KEPT = "What was finished is kept."
"""What was saved, in errors of a cluster."""
INSTALL = "pip install 'hapteq[cluster]'"


@contextmanager
def cluster_workers(address: str, *, one_thread: bool = False) -> Iterator[Executor]:
    """address: of the scheduler, such as tcp://10.0.0.5:8786. A piece of work whose worker dies is done by another.
    one_thread: refuse workers that do several pieces at once, for work that draws figures or measures processor time.

    Raises StudyError where no scheduler answers, it has no workers, a worker has another version, or, later, where
    the scheduler is lost, workers die at the same piece again and again, or for `WORKER_TIMEOUT_S` none is left or
    the scheduler does not answer.
    """
    try:
        import dask
        from distributed import Client, KilledWorker
        from distributed.client import ClosedClientError
        from distributed.comm import CommClosedError
    except ImportError as missing:
        raise StudyError(
            "There is no access to a cluster",
            "The package distributed is not installed.",
            f"Install it: {INSTALL}. On this computer alone, use --workers.",
            saved="Nothing was begun.",
        ) from missing
    try:
        client = Client(address, timeout=SCHEDULER_TIMEOUT_S, set_as_default=False)
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
        causes: list[StudyError] = []
        try:
            with _executor(client) as executor, _watch(client, executor, address, causes):
                yield executor
        except (KilledWorker, ClosedClientError, CommClosedError, CancelledError) as problem:
            raise causes[0] if causes else _undone_error(problem) from problem
        except (RuntimeError, TypeError, ValueError) as problem:
            # A future that is lost with its scheduler has no result, and distributed's executor fails on unpacking it;
            # one that was given up for want of workers takes no more work.
            if client.status == "running" and not causes:
                raise
            raise causes[0] if causes else _undone_error(problem) from problem


@contextmanager
def _executor(client: "Client") -> Iterator[Executor]:
    """Executor of the client. Unfinished tasks are cancelled on exit: the executor's own exit would wait for them, and
    for finished ones that are computed again because their worker died."""
    executor = client.get_executor(pure=False)
    try:
        yield executor
    finally:
        _cancel(executor)


def _cancel(executor: Executor) -> None:
    """Cancel all its work, which the scheduler need not answer."""
    from distributed.client import ClosedClientError

    with suppress(ClosedClientError):  # a client that gave its scheduler up: there is no work any more
        executor.shutdown(wait=False)


@contextmanager
def _watch(client: "Client", executor: Executor, address: str, causes: list[StudyError]) -> Iterator[None]:
    """Cancel all work, and append why to `causes`, where no worker was seen for `WORKER_TIMEOUT_S`."""
    left = threading.Event()
    watcher = threading.Thread(target=partial(_await_loss, client, executor, address, causes, left), daemon=True)
    watcher.start()
    try:
        yield
    finally:
        left.set()
        watcher.join(POLL_S)  # it may still wait for a scheduler that does not answer, and does nothing after that


def _await_loss(
    client: "Client", executor: Executor, address: str, causes: list[StudyError], left: threading.Event
) -> None:
    last_seen_s = time.monotonic()
    while not left.wait(POLL_S):
        workers, problem = _workers(client)
        if workers:
            last_seen_s = time.monotonic()
        elif time.monotonic() - last_seen_s > WORKER_TIMEOUT_S and not left.is_set():
            causes.append(_no_workers_error(address) if problem is None else _silent_error(address, problem))
            _cancel(executor)
            return


def _workers(client: "Client") -> tuple[int, Exception | None]:
    """How many the scheduler names; none, and why, where it does not answer in `SCHEDULER_TIMEOUT_S`."""
    try:
        return len(client.nthreads(callback_timeout=SCHEDULER_TIMEOUT_S)), None
    except Exception as problem:  # noqa: BLE001 — distributed has many for a lost scheduler, and none may end the watch
        return 0, problem


def _no_workers_error(address: str) -> StudyError:
    return StudyError(
        "The cluster has no workers any more",
        f"For {WORKER_TIMEOUT_S:g} s the scheduler at {address} had none: they ended, or cannot reach it.",
        f"Start some: dask worker {address}. Then run the same command again: it goes on where it stopped.",
        saved=KEPT,
    )


def _silent_error(address: str, problem: Exception) -> StudyError:
    return StudyError(
        "The scheduler does not answer any more",
        f"For {WORKER_TIMEOUT_S:g} s the scheduler at {address} named no worker. When last asked: "
        f"{type(problem).__name__}: {problem}".rstrip(" :.")
        + ".",
        "Look at the scheduler and the network, then run the same command again: it goes on where it stopped.",
        saved=KEPT,
    )


def _undone_error(problem: BaseException) -> StudyError:
    return StudyError(
        "The cluster did not do this",
        f"{type(problem).__name__}: {problem}.",
        "Look at the scheduler and its workers, then run the same command again: it goes on where it stopped.",
        saved=KEPT,
    )


def own_version() -> str:
    """Version of hapteq, here and on each worker; empty where it is not installed."""
    try:
        return version("hapteq")
    except PackageNotFoundError:
        return ""


@dataclass(frozen=True, slots=True)
class _Found:
    """The workers of a scheduler."""

    versions: dict[str, str]
    """Of hapteq, by address; empty where it is not installed."""
    threads: tuple[int, ...]


def _ask(client: "Client") -> _Found:
    try:
        versions: dict[str, str] = client.run(own_version)
    except ImportError:  # what a worker without hapteq says of the function that it is sent
        versions = dict.fromkeys(client.scheduler_info()["workers"], "")
    workers = client.scheduler_info(n_workers=-1)["workers"].values()
    return _Found(versions, tuple(worker["nthreads"] for worker in workers))


def _ask_in_time(client: "Client", address: str) -> _Found:
    """distributed waits without a limit for a scheduler that stands still, and for a worker that does."""
    asked = Future[_Found]()

    def ask() -> None:
        try:
            asked.set_result(_ask(client))
        except BaseException as problem:  # noqa: BLE001 — raised where the result is waited for
            asked.set_exception(problem)

    threading.Thread(target=ask, daemon=True).start()
    try:
        return asked.result(timeout=WORKER_TIMEOUT_S)
    except TimeoutError as problem:
        if asked.done():  # an error of the question itself, which came before the time was up
            raise _cluster_error(
                f"The scheduler at {address} was reached, and asking its workers failed: "
                f"{str(problem) or type(problem).__name__}.",
                "Look at the scheduler, its workers and the network, then run the same command again.",
            ) from problem
        raise StudyError(
            "The cluster does not answer",
            f"The scheduler at {address} was reached, but it or a worker said nothing more for {WORKER_TIMEOUT_S:g} s.",
            "Look at the scheduler, its workers and the network, then run the same command again.",
            saved="Nothing was begun.",
        ) from problem


def _require_workers(client: "Client", address: str, one_thread: bool) -> None:
    asked = _ask_in_time(client, address)
    found = asked.versions
    if not found or not asked.threads:  # they may have left between the two questions
        raise _cluster_error(f"The scheduler at {address} has no workers.", f"Start some: dask worker {address}.")
    own = own_version()
    if wrong := sorted({each or "none" for each in found.values() if each != own}):
        raise _cluster_error(
            f"Workers at {address} have hapteq {', '.join(wrong)}; here it is {own}.",
            "Install the same version for all of them.",
        )
    threads = max(asked.threads)
    if one_thread and threads > 1:
        raise _cluster_error(
            f"Workers at {address} have up to {threads} threads, and this work needs a process for each piece.",
            f"Start them with: dask worker {address} --nthreads 1 --nworkers auto.",
        )


def _cluster_error(happened: str, do_now: str) -> StudyError:
    return StudyError("The cluster cannot do this", happened, do_now, saved="Nothing was begun.")
