"""Work on the workers of a dask scheduler: the same executor as the processes of this computer, on others.

Each worker imports hapteq itself, so that all must have the version that asks: other code could give other numbers.
"""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

from study.errors import StudyError

if TYPE_CHECKING:
    from distributed import Client

PATIENCE_S = 10.0
"""For the scheduler to answer."""
INSTALL = "pip install 'hapteq[cluster]'"


@contextmanager
def cluster_workers(address: str) -> Iterator[Executor]:
    """address: of the scheduler, such as tcp://10.0.0.5:8786. A piece of work whose worker dies is done by another.

    Raises StudyError where no scheduler answers, it has no workers, or a worker has another version.
    """
    try:
        from distributed import Client
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
    with client:
        _require_workers(client, address)
        with client.get_executor(pure=False) as executor:
            yield executor


def own_version() -> str:
    """Also asked of each worker; empty where hapteq is not installed."""
    try:
        return version("hapteq")
    except PackageNotFoundError:
        return ""


def _require_workers(client: "Client", address: str) -> None:
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


def _cluster_error(happened: str, do_now: str) -> StudyError:
    return StudyError("The cluster cannot do this", happened, do_now, saved="Nothing was begun.")
