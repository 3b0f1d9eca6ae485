"""Option `--scheduler` of a command: its work is done by the workers of a dask cluster instead of local processes.

`study.workflows.cluster` opens the connection.
"""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Annotated

import typer

SchedulerOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Address of a dask scheduler, whose workers (dask worker ADDRESS --nthreads 1) do the work; no common "
        "disk is needed.",
    ),
]


@contextmanager
def connect_cluster(scheduler: str | None) -> Iterator[Executor | None]:
    """Connect to the scheduler's cluster and yield its executor; None without a scheduler. Raises StudyError where the
    cluster cannot be used, or its workers have several threads."""
    if scheduler is None:
        yield None
        return
    from study.workflows.cluster import open_cluster_workers

    with open_cluster_workers(scheduler, one_thread=True) as executor:
        yield executor
