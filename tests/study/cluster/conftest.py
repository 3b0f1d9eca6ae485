"""A real dask scheduler with two workers on this computer."""

import pytest


@pytest.fixture(scope="package")
def local():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as started:
        yield started


@pytest.fixture
def kill_a_worker(local):
    """To be called with how many pieces are finished: at the first one it kills a worker, once. `killed` says which."""
    import os
    import signal

    def kill(finished: int, *_) -> None:
        if finished and not kill.killed:
            kill.killed.append(next(iter(local.workers.values())).pid)
            os.kill(kill.killed[0], signal.SIGKILL)

    kill.killed = []
    return kill
