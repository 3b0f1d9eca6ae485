"""Work on the workers of a dask scheduler: the same executor interface as for the processes of this computer.

Each worker imports hapteq itself, so that all must have the same version: other code could give other numbers.
"""

from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

from study.errors import StudyError

if TYPE_CHECKING:
    from distributed import Client

PATIENCE_S = 10.0
"""Timeout in seconds for the scheduler to answer."""
INSTALL = "pip install 'hapteq[cluster]'"


@contextmanager
def cluster_workers(address: str, *, one_thread: bool = False) -> Iterator[Executor]:
    """address: of the scheduler, such as tcp://10.0.0.5:8786. A piece of work whose worker dies is done by another.
    one_thread: refuse workers that do several pieces at once, for work that draws figures or measures processor time.

    Raises StudyError where no scheduler answers, it has no workers, a worker has another version, or, later, where
    the scheduler is lost or workers die at the same piece again and again.
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
        try:
            with client.get_executor(pure=False) as executor:
                yield executor
        except (KilledWorker, CommClosedError, CancelledError) as problem:
            raise _undone_error(problem) from problem
        except (TypeError, ValueError) as problem:
            # A future that is lost with its scheduler has no result, and distributed's executor fails on unpacking it.
            if client.status == "running":
                raise
            raise _undone_error(problem) from problem


def _undone_error(problem: BaseException) -> StudyError:
    return StudyError(
        "The cluster did not do this",
        f"{type(problem).__name__}: {problem}.",
        "Look at the scheduler and its workers, then run the same command again: it goes on where it stopped.",
        saved="What was finished is kept.",
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
