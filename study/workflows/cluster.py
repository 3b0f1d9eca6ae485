"""Execution of work on the workers of a dask cluster, by the `Executor` interface that local processes also have.

Each worker imports its own installation of hapteq. All must have the same version, because other code could give other
numbers. `open_cluster_workers` opens the executor.
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
"""Longest wait (s) for an answer of the scheduler (chosen)."""
WORKER_TIMEOUT_S = 60.0
"""Time (s) without a worker or an answer of the scheduler after which work is given up; also the time limit of the
first request. Chosen: long enough for either to restart."""
POLL_INTERVAL_S = 1.0
"""Interval (s) at which the workers are counted (chosen: short beside `WORKER_TIMEOUT_S`)."""
RESULTS_KEPT_TEXT = "What was finished is kept."
"""Sentence on what was saved, for errors after the work began."""
INSTALL_COMMAND = "pip install 'hapteq[cluster]'"
"""Command that installs dask with its scheduler."""


@contextmanager
def open_cluster_workers(address: str, *, one_thread: bool = False) -> Iterator[Executor]:
    """Open an executor on the workers of the scheduler at `address`, such as tcp://10.0.0.5:8786. A task whose worker
    dies is repeated by another. one_thread: refuse workers with several threads, for tasks that draw figures or
    measure processor time.

    Raises StudyError where the package distributed is missing, no scheduler answers, it has no workers, or a worker has
    another version or is refused by `one_thread`; later, where the scheduler is lost, a task repeatedly kills its
    workers, or for `WORKER_TIMEOUT_S` there is no worker or the scheduler does not answer.
    """
    try:
        import dask
        from distributed import Client, KilledWorker
        from distributed.client import ClosedClientError
        from distributed.comm import CommClosedError
    except ImportError as import_error:
        raise StudyError(
            "There is no access to a cluster",
            "The package distributed is not installed.",
            f"Install it: {INSTALL_COMMAND}. On this computer alone, use --workers.",
            saved="Nothing was begun.",
        ) from import_error
    try:
        client = Client(address, timeout=SCHEDULER_TIMEOUT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise StudyError(
            "The scheduler does not answer",
            f"At {address}: {str(error) or type(error).__name__}.",
            "Start it with: dask scheduler. Then give the address that it prints.",
            saved="Nothing was begun.",
        ) from error
    # A recording is sent to its worker as a value; distributed warns against such large arguments.
    with client, dask.config.set({"distributed.admin.large-graph-warning-threshold": "1 GB"}):
        _require_workers(client, address, one_thread)
        loss_errors: list[StudyError] = []
        try:
            with _open_executor(client) as executor, _watch_workers(client, executor, address, loss_errors):
                yield executor
        except (KilledWorker, ClosedClientError, CommClosedError, CancelledError) as error:
            raise loss_errors[0] if loss_errors else _make_lost_work_error(error) from error
        except (RuntimeError, TypeError, ValueError) as error:
            # A future that was lost with its scheduler has no result, on which distributed's executor fails; an
            # executor that `_watch_workers` cancelled refuses further tasks. Both are errors of the cluster.
            if client.status == "running" and not loss_errors:
                raise
            raise loss_errors[0] if loss_errors else _make_lost_work_error(error) from error


@contextmanager
def _open_executor(client: "Client") -> Iterator[Executor]:
    """Open the executor of the client. Unfinished tasks are cancelled on exit: the executor's own exit would wait for
    them, and for finished ones that are computed again because their worker died."""
    executor = client.get_executor(pure=False)
    try:
        yield executor
    finally:
        _cancel_tasks(executor)


def _cancel_tasks(executor: Executor) -> None:
    """Cancel all tasks of the executor, without waiting for an answer of the scheduler."""
    from distributed.client import ClosedClientError

    with suppress(ClosedClientError):  # the client has lost its scheduler, and with it all tasks
        executor.shutdown(wait=False)


@contextmanager
def _watch_workers(client: "Client", executor: Executor, address: str, loss_errors: list[StudyError]) -> Iterator[None]:
    """While the context lasts: cancel all tasks, and append the cause to `loss_errors`, if for `WORKER_TIMEOUT_S` the
    scheduler has no worker or does not answer."""
    stop_event = threading.Event()
    watcher = threading.Thread(
        target=partial(_watch_until_loss, client, executor, address, loss_errors, stop_event), daemon=True
    )
    watcher.start()
    try:
        yield
    finally:
        stop_event.set()
        # If the scheduler does not answer, the thread still waits for it, and does nothing more.
        watcher.join(POLL_INTERVAL_S)


def _watch_until_loss(
    client: "Client", executor: Executor, address: str, loss_errors: list[StudyError], stop_event: threading.Event
) -> None:
    """Count the workers every `POLL_INTERVAL_S` until `stop_event` is set or there was none for `WORKER_TIMEOUT_S`; in
    the second case, append the cause to `loss_errors` and cancel all tasks."""
    last_seen_s = time.monotonic()
    while not stop_event.wait(POLL_INTERVAL_S):
        workers, error = _count_workers(client)
        if workers:
            last_seen_s = time.monotonic()
        elif time.monotonic() - last_seen_s > WORKER_TIMEOUT_S and not stop_event.is_set():
            loss_errors.append(
                _make_no_workers_error(address) if error is None else _make_silent_scheduler_error(address, error)
            )
            _cancel_tasks(executor)
            return


def _count_workers(client: "Client") -> tuple[int, Exception | None]:
    """Count the scheduler's workers; 0 and the error where asking fails or takes longer than `SCHEDULER_TIMEOUT_S`."""
    try:
        return len(client.nthreads(callback_timeout=SCHEDULER_TIMEOUT_S)), None
    except Exception as error:  # noqa: BLE001 — distributed has many for a lost scheduler, and none may end the watch
        return 0, error


def _make_no_workers_error(address: str) -> StudyError:
    """Make the error for a scheduler that had no worker for `WORKER_TIMEOUT_S`."""
    return StudyError(
        "The cluster has no workers any more",
        f"For {WORKER_TIMEOUT_S:g} s the scheduler at {address} had none: they ended, or cannot reach it.",
        f"Start some: dask worker {address}. Then run the same command again: it continues where it stopped.",
        saved=RESULTS_KEPT_TEXT,
    )


def _make_silent_scheduler_error(address: str, error: Exception) -> StudyError:
    """Make the error for a scheduler that did not answer for `WORKER_TIMEOUT_S`."""
    return StudyError(
        "The scheduler does not answer any more",
        f"For {WORKER_TIMEOUT_S:g} s the scheduler at {address} named no worker. When last asked: "
        f"{type(error).__name__}: {error}".rstrip(" :.")
        + ".",
        "Look at the scheduler and the network, then run the same command again: it continues where it stopped.",
        saved=RESULTS_KEPT_TEXT,
    )


def _make_lost_work_error(error: BaseException) -> StudyError:
    """Make the error for tasks that were lost with a worker or the scheduler."""
    return StudyError(
        "The cluster did not do this",
        f"{type(error).__name__}: {error}.",
        "Look at the scheduler and its workers, then run the same command again: it continues where it stopped.",
        saved=RESULTS_KEPT_TEXT,
    )


def read_hapteq_version() -> str:
    """Read the version of hapteq in the process that calls it, this one or a worker; empty where hapteq is not
    installed."""
    try:
        return version("hapteq")
    except PackageNotFoundError:
        return ""


@dataclass(frozen=True, slots=True)
class _WorkerSetup:
    """Versions and threads of the workers of a scheduler."""

    versions: dict[str, str]
    """Version of hapteq by the worker's address; empty for all of them where a worker cannot import hapteq."""
    threads: tuple[int, ...]
    """Number of threads of each worker."""


def _request_worker_setup(client: "Client") -> _WorkerSetup:
    """Ask the workers for their version of hapteq, and the scheduler for their threads."""
    try:
        versions: dict[str, str] = client.run(read_hapteq_version)
    except ImportError:  # raised by a worker without hapteq, which cannot import `read_hapteq_version`
        versions = dict.fromkeys(client.scheduler_info(n_workers=-1)["workers"], "")
    workers = client.scheduler_info(n_workers=-1)["workers"].values()
    return _WorkerSetup(versions, tuple(worker["nthreads"] for worker in workers))


def _request_setup_with_timeout(client: "Client", address: str) -> _WorkerSetup:
    """Call `_request_worker_setup` with the time limit `WORKER_TIMEOUT_S`: distributed waits without a limit for a
    scheduler or a worker that does not answer. Raises StudyError for it, and where the connection is lost meanwhile."""
    from distributed.client import ClosedClientError

    setup_future = Future[_WorkerSetup]()

    def store_setup() -> None:
        try:
            setup_future.set_result(_request_worker_setup(client))
        except BaseException as error:  # noqa: BLE001 — raised where the result is waited for
            setup_future.set_exception(error)

    threading.Thread(target=store_setup, daemon=True).start()
    try:
        return setup_future.result(timeout=WORKER_TIMEOUT_S)
    except (OSError, ClosedClientError) as error:  # TimeoutError and CommClosedError are kinds of OSError
        if setup_future.done():  # the error was raised by `_request_worker_setup` itself, before the time limit
            raise _make_unusable_cluster_error(
                f"The scheduler at {address} was reached, and asking its workers failed: "
                f"{str(error) or type(error).__name__}.",
                "Look at the scheduler, its workers and the network, then run the same command again.",
            ) from error
        raise StudyError(
            "The cluster does not answer",
            f"The scheduler at {address} was reached, but it or a worker said nothing more for {WORKER_TIMEOUT_S:g} s.",
            "Look at the scheduler, its workers and the network, then run the same command again.",
            saved="Nothing was begun.",
        ) from error


def _require_workers(client: "Client", address: str, one_thread: bool) -> None:
    """Raise StudyError unless there are workers, with this version of hapteq, and with one thread each if needed."""
    worker_setup = _request_setup_with_timeout(client, address)
    versions = worker_setup.versions
    if not versions or not worker_setup.threads:  # workers may have left between the two requests
        raise _make_unusable_cluster_error(
            f"The scheduler at {address} has no workers.", f"Start some: dask worker {address}."
        )
    local_version = read_hapteq_version()
    if other_versions := sorted(
        {worker_version or "none" for worker_version in versions.values() if worker_version != local_version}
    ):
        raise _make_unusable_cluster_error(
            f"Workers at {address} have hapteq {', '.join(other_versions)}; here it is {local_version}.",
            "Install the same version for all of them.",
        )
    max_threads = max(worker_setup.threads)
    if one_thread and max_threads > 1:
        raise _make_unusable_cluster_error(
            f"Workers at {address} have up to {max_threads} threads, and this work needs a process for each piece.",
            f"Start them with: dask worker {address} --nthreads 1 --nworkers auto.",
        )


def _make_unusable_cluster_error(explanation: str, advice: str) -> StudyError:
    """Make the error for a cluster that is refused before work begins."""
    return StudyError("The cluster cannot do this", explanation, advice, saved="Nothing was begun.")
