"""A dask scheduler whose last worker dies: the work waits a declared time for another, then says what to do."""

import os
import re
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest

from analysis.psychophysics.power.simulated_study import Crowd
from study.errors import StudyError
from study.workflows import cluster
from study.workflows.cluster import open_cluster_workers
from study.workflows.planning.simulate_power import PowerPlan, simulate_power
from tests.analysis.conftest import PUBLISHED

pytestmark = [pytest.mark.real_time, pytest.mark.timeout(180)]
distributed = pytest.importorskip("distributed")

PLAN = PowerPlan(Crowd((5.0, 45.0), (0.7, 1.4)), PUBLISHED, (3,), 40, 3)
"""Four pieces of work."""


@contextmanager
def a_worker(address):
    """Without the nanny that would start it anew."""
    command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--no-nanny", "--nthreads", "1"]
    process = subprocess.Popen([*command, "--no-dashboard"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with distributed.Client(address, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=60)
        yield process
    finally:
        process.kill()
        process.wait()


@pytest.fixture
def address():
    """Of a scheduler on loopback without workers."""
    with distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0") as alone:
        yield alone.scheduler_address


@pytest.fixture
def scheduler():
    """Process and address of a scheduler on loopback without workers, in a process of its own."""
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    with subprocess.Popen([*command, "--no-dashboard"], stderr=subprocess.PIPE, text=True) as process:
        try:
            found = next(filter(None, (re.search(r"tcp://127\.0\.0\.1:\d+", line) for line in process.stderr)))
            rest = threading.Thread(target=process.stderr.read, daemon=True)  # a full pipe would stop it
            rest.start()
            yield process, found[0]
        finally:
            process.kill()
        rest.join()


@pytest.fixture
def here(tmp_path):
    with ThreadPoolExecutor(1) as pool:
        return simulate_power(PLAN, tmp_path / "here", pool, lambda _: None)


def killing(worker, then=lambda: None):
    """To be called with the number of finished studies: kills the worker at the first ones, and then calls `then`."""

    def on_finished(finished):
        if finished and worker.poll() is None:
            os.kill(worker.pid, signal.SIGKILL)
            worker.wait()
            then()

    return on_finished


@pytest.mark.slow
def test_without_workers_it_ends_in_words_and_goes_on_with_another(address, here, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "WORKER_TIMEOUT_S", 2.0)
    out = tmp_path / "power"
    with (
        a_worker(address) as worker,
        pytest.raises(StudyError, match="For 2 s the scheduler at .* had none") as ended,
        open_cluster_workers(address) as pool,
    ):
        simulate_power(PLAN, out, pool, killing(worker))
    assert f"dask worker {address}" in ended.value.do_now
    assert "the same command again" in ended.value.do_now
    assert ended.value.saved == "What was finished is kept."
    kept = (out / "studies.jsonl").read_text("utf-8").splitlines()
    assert 1 < len(kept) < 5  # the plan, and some of four pieces
    with a_worker(address), open_cluster_workers(address) as pool:
        assert simulate_power(PLAN, out, pool, lambda _: None) == here
    assert (out / "studies.jsonl").read_text("utf-8").splitlines()[: len(kept)] == kept


@pytest.mark.slow
def test_another_worker_within_the_time_goes_on(address, here, tmp_path):
    with a_worker(address) as worker, open_cluster_workers(address) as pool:
        late = []
        comes = threading.Timer(3.0, lambda: late.append(a_worker(address)) or late[0].__enter__())
        found = simulate_power(PLAN, tmp_path / "power", pool, killing(worker, comes.start))
        assert found == here
        comes.join()
        late[0].__exit__(None, None, None)


@pytest.mark.slow
def test_the_wait_for_a_worker_ends_at_once_by_ctrl_c(address, tmp_path):
    main = threading.main_thread().ident
    interrupt = threading.Timer(3.0, lambda: signal.pthread_kill(main, signal.SIGINT))
    began = []

    def begin():
        began.append(time.monotonic())
        interrupt.start()

    with a_worker(address) as worker, pytest.raises(KeyboardInterrupt), open_cluster_workers(address) as pool:
        simulate_power(PLAN, tmp_path / "power", pool, killing(worker, begin))
    assert time.monotonic() - began[0] < 15.0


@pytest.mark.slow
def test_a_scheduler_that_stands_still_ends_the_work_in_words(scheduler, monkeypatch):
    process, address = scheduler
    monkeypatch.setattr(cluster, "WORKER_TIMEOUT_S", 2.0)
    with (
        a_worker(address),
        pytest.raises(StudyError, match="The scheduler does not answer any more") as ended,
        open_cluster_workers(address) as pool,
    ):
        pending = pool.submit(time.sleep, 600.0)
        monkeypatch.setattr(cluster, "SCHEDULER_TIMEOUT_S", 1.0)
        process.send_signal(signal.SIGSTOP)
        began = time.monotonic()
        pending.result()
    assert time.monotonic() - began < 15.0
    assert address in str(ended.value) and ended.value.saved == "What was finished is kept."


def test_a_scheduler_that_stands_still_after_it_was_reached_ends_before_anything_is_begun(scheduler, monkeypatch):
    process, address = scheduler
    own = distributed.Client

    def reach(*args, **settings):
        client = own(*args, **settings)
        process.send_signal(signal.SIGSTOP)
        return client

    with a_worker(address):
        monkeypatch.setattr(cluster, "WORKER_TIMEOUT_S", 2.0)
        monkeypatch.setattr(distributed, "Client", reach)
        began = time.monotonic()
        with pytest.raises(StudyError, match="The cluster does not answer") as ended, open_cluster_workers(address):
            pass
        monkeypatch.setattr(distributed, "Client", own)
    assert time.monotonic() - began < 30.0
    assert address in str(ended.value) and ended.value.saved == "Nothing was begun."


@pytest.mark.slow
def test_ctrl_c_ends_the_wait_for_a_scheduler_that_stands_still(scheduler):
    process, address = scheduler
    main = threading.main_thread().ident
    interrupt = threading.Timer(2.0, lambda: signal.pthread_kill(main, signal.SIGINT))
    with a_worker(address), pytest.raises(KeyboardInterrupt), open_cluster_workers(address) as pool:
        pending = pool.submit(time.sleep, 600.0)
        process.send_signal(signal.SIGSTOP)
        began = time.monotonic()
        interrupt.start()
        pending.result()
    assert time.monotonic() - began < 8.0


def test_the_watch_outlives_a_count_that_fails_in_an_unforeseen_way(address, monkeypatch):
    monkeypatch.setattr(cluster, "WORKER_TIMEOUT_S", 1.0)

    def fail(*_, **__):
        raise AttributeError("unforeseen")

    with (
        a_worker(address),
        pytest.raises(StudyError, match="AttributeError: unforeseen"),
        open_cluster_workers(address) as pool,
    ):
        monkeypatch.setattr(distributed.Client, "nthreads", fail)
        pool.submit(time.sleep, 600.0).result()


def test_workers_that_leave_while_they_are_asked_are_no_workers(monkeypatch):
    monkeypatch.setattr(
        cluster,
        "_request_worker_setup",
        lambda client: cluster._WorkerSetup({"tcp://w": cluster.read_hapteq_version()}, ()),
    )
    with pytest.raises(StudyError, match=r"The scheduler at tcp://s has no workers\."):
        cluster._require_workers(None, "tcp://s", one_thread=True)


@pytest.mark.parametrize(
    "error",
    [
        TimeoutError("Timed out during handshake"),
        OSError("Timed out trying to connect"),
        distributed.comm.CommClosedError("ConnectionPool closing."),
        distributed.client.ClosedClientError("Client is closed"),
    ],
)
def test_a_question_that_fails_before_the_time_limit_is_no_silence(monkeypatch, error):
    def fail(_):
        raise error

    monkeypatch.setattr(cluster, "_request_worker_setup", fail)
    with pytest.raises(StudyError, match=f"asking its workers failed: {error}") as ended:
        cluster._require_workers(None, "tcp://s", one_thread=False)
    assert "said nothing more" not in str(ended.value) and ended.value.saved == "Nothing was begun."
