"""A dask scheduler with two workers on this computer: the same numbers, also where a worker dies."""

import time
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import replace

import pytest

from protocols.definition.staircase_rule import StaircaseRule, StepPhase
from study.cli.main import main
from study.errors import StudyError
from study.workflows import cluster
from study.workflows.cluster import open_cluster_workers
from study.workflows.planning.simulate_power import PowerPlan, simulate_power

pytestmark = pytest.mark.real_time
distributed = pytest.importorskip("distributed")

RULE = StaircaseRule(1.0, 3.0, 1, 3, (StepPhase(4.0, 3), StepPhase(1.0, 10)), 13, 10)


@pytest.fixture(scope="module")
def plan():
    from analysis.psychophysics.power.simulated_study import Crowd

    return PowerPlan(Crowd((5.0, 45.0), (0.7, 1.4)), RULE, (3, 5), 30, 3)


@pytest.fixture(scope="module")
def here(plan, tmp_path_factory):
    with ThreadPoolExecutor(1) as pool:
        return simulate_power(plan, tmp_path_factory.mktemp("here") / "power", pool, lambda _: None)


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_cluster_gives_the_same_numbers_to_the_bit(plan, local, here, tmp_path):
    finished = []
    with open_cluster_workers(local.scheduler_address) as pool:
        assert simulate_power(plan, tmp_path / "power", pool, finished.append) == here
    assert finished[-1] == 60


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_worker_that_dies_loses_no_study(plan, local, here, kill_a_worker, tmp_path):
    with open_cluster_workers(local.scheduler_address) as pool:
        assert simulate_power(plan, tmp_path / "power", pool, kill_a_worker) == here
    assert kill_a_worker.killed


@pytest.mark.timeout(300)
def test_workers_of_another_version_are_refused(plan, local, monkeypatch):
    monkeypatch.setattr(cluster, "version", lambda _: "0.0.0")  # of this process: workers import their own
    with pytest.raises(StudyError, match="same version"), open_cluster_workers(local.scheduler_address):
        pass


@pytest.mark.timeout(120)
def test_a_scheduler_without_workers_is_refused():
    alone = distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0")
    with alone, pytest.raises(StudyError, match="has no workers"), open_cluster_workers(alone.scheduler_address):
        pass


@pytest.mark.timeout(120)
def test_workers_with_several_threads_are_refused_for_work_that_needs_a_process():
    two = distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=True, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    )
    refused = pytest.raises(StudyError, match="--nthreads 1")
    with two, refused, open_cluster_workers(two.scheduler_address, one_thread=True):
        pass


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_a_scheduler_that_is_lost_is_reported(plan, tmp_path):
    lost = distributed.LocalCluster(n_workers=1, host="127.0.0.1", dashboard_address="127.0.0.1:0")
    with lost, pytest.raises(StudyError, match="did not do this"), open_cluster_workers(lost.scheduler_address) as pool:
        simulate_power(plan, tmp_path / "power", pool, lambda finished: finished and lost.close())
    kept = (tmp_path / "power" / "studies.jsonl").read_text("utf-8").splitlines()
    assert 1 < len(kept) < 7  # the plan, and some of six pieces


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_an_error_of_the_executor_is_a_lost_scheduler_only_where_one_is_lost():
    here = distributed.LocalCluster(n_workers=1, host="127.0.0.1", dashboard_address="127.0.0.1:0")
    with pytest.raises(ValueError, match="of the work itself"), open_cluster_workers(here.scheduler_address):
        raise ValueError("of the work itself")
    with here, pytest.raises(StudyError, match="did not do this"), open_cluster_workers(here.scheduler_address) as pool:
        here.close()
        wait([pool.submit(len, ())], timeout=60)
        raise ValueError("too many values to unpack")


@pytest.mark.slow
@pytest.mark.timeout(120)
@pytest.mark.parametrize("given", ["before", "after"])
def test_work_of_a_client_that_gave_its_scheduler_up_is_reported(given, monkeypatch):
    clients = []
    own = distributed.Client
    monkeypatch.setattr(
        distributed, "Client", lambda *args, **settings: clients.append(own(*args, **settings)) or clients[0]
    )
    gone = distributed.LocalCluster(n_workers=1, host="127.0.0.1", dashboard_address="127.0.0.1:0")
    with gone, pytest.raises(StudyError, match="did not do this"), open_cluster_workers(gone.scheduler_address) as pool:
        gone.close()
        begun = [pool.submit(len, ())] if given == "before" else []
        while clients[0].status != "closed":
            time.sleep(0.1)
        (begun or [pool.submit(len, ())])[0].result(timeout=60)


def test_no_scheduler_is_reported_and_nothing_is_begun(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(cluster, "SCHEDULER_TIMEOUT_S", 1.0)
    code = main(["power", "--scheduler", "tcp://127.0.0.1:9", "--out", str(tmp_path / "power"), "--subjects", "5"])
    assert code == 1
    assert "The scheduler does not answer" in capsys.readouterr().err
    assert not (tmp_path / "power").exists()


def test_without_the_package_it_is_said_what_to_install(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(StudyError, match=r"hapteq\[cluster\]"), open_cluster_workers("tcp://127.0.0.1:9"):
        pass


@pytest.mark.slow
def test_the_numbers_depend_on_the_seed(plan, here, tmp_path):
    with ThreadPoolExecutor(1) as pool:
        other = simulate_power(replace(plan, seed=4), tmp_path / "power", pool, lambda _: None)
    assert other != here
