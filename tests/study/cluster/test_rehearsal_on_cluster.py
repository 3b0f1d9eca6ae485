"""Rehearsals on a dask scheduler with two workers: the sessions are those that processes of this computer play."""

import csv
from dataclasses import replace

import pytest

from protocols.document.loading import load_protocol
from study.store.sessions.archive import list_session_folders
from study.workflows.cluster import open_cluster_workers
from study.workflows.results.fold_session import fold_session
from study.workflows.session.rehearse_study import Rehearsal, rehearse_study

pytestmark = pytest.mark.real_time
pytest.importorskip("distributed")
CLOCKED = {"onset_s"}
"""Columns of the wall clock."""


@pytest.fixture(scope="module")
def rehearsal(small_text, tmp_path_factory) -> Rehearsal:
    folder = tmp_path_factory.mktemp("here") / "data"
    return Rehearsal(load_protocol(small_text, "small.toml"), small_text, subjects=3, seed=5, data=folder)


@pytest.fixture(scope="module")
def here(rehearsal):
    rehearse_study(rehearsal, 2, lambda done: None)
    return tables(rehearsal.data)


def tables(data):
    """Thresholds and trials of all sessions."""
    found = {}
    for folder in list_session_folders(data):
        found[folder.name] = (folder.path / "thresholds.csv").read_bytes()
        with (folder.path / "trials.csv").open(newline="") as table:
            rows = [
                {name: value for name, value in row.items() if name not in CLOCKED} for row in csv.DictReader(table)
            ]
        found[f"{folder.name} trials"] = rows
    return found


def elsewhere(rehearsal, tmp_path):
    return replace(rehearsal, data=tmp_path / "data")


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_cluster_plays_the_same_sessions_and_keeps_those_that_are_there(rehearsal, local, here, tmp_path):
    there, done = elsewhere(rehearsal, tmp_path), []
    with open_cluster_workers(local.scheduler_address, one_thread=True) as pool:
        rehearse_study(there, pool, done.append)
        assert done == [1, 2, 3]
        assert tables(there.data) == here
        logs = [folder.log.stat().st_mtime_ns for folder in list_session_folders(there.data)]
        rehearse_study(there, pool, done.append)
    assert done == [1, 2, 3, 1, 2, 3]
    assert [folder.log.stat().st_mtime_ns for folder in list_session_folders(there.data)] == logs
    assert all(fold_session(folder).state.closed for folder in list_session_folders(there.data))
    assert {path.stat().st_mode & 0o077 for path in there.data.rglob("*")} == {0}


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_worker_that_dies_loses_no_session(rehearsal, local, here, kill_a_worker, tmp_path):
    there = elsewhere(rehearsal, tmp_path)
    with open_cluster_workers(local.scheduler_address, one_thread=True) as pool:
        rehearse_study(there, pool, kill_a_worker)
    assert kill_a_worker.killed
    assert tables(there.data) == here


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_session_that_was_begun_here_is_finished(rehearsal, local, here, session_logs, tmp_path):
    there = elsewhere(rehearsal, tmp_path)
    with open_cluster_workers(local.scheduler_address, one_thread=True) as pool:
        rehearse_study(there, pool, lambda done: None)
        first, second = list_session_folders(there.data)[:2]
        log = first.log.read_bytes()
        first.log.write_bytes(log[: len(log) // 2])
        session_logs.unsealed(first.path)
        for path in sorted(second.path.rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()
        second.path.rmdir()
        rehearse_study(there, pool, lambda done: None)
    assert all(fold_session(folder).state.closed for folder in list_session_folders(there.data))
    after = tables(there.data)
    untouched = [name for name in here if not name.startswith(first.name)]
    assert {name: after[name] for name in untouched} == {name: here[name] for name in untouched}
