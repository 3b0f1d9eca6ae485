"""`prove` and `real` on a dask scheduler with two workers: the same answers, also where a worker dies."""

import json
import shutil

import numpy as np
import pytest

from study.errors import WrongUseError
from study.evaluation.bank.proof_folder import ANSWER_FILE, RECORDING_FILE
from study.evaluation.bank.prove import prove
from study.evaluation.bank.seal_cases import BankPlan
from study.evaluation.bank.sealed_bank import BankOptions
from study.evaluation.real.real_recordings import RealPlan, diagnose_folder
from study.workflows.cluster import open_cluster_workers
from tests.one_axis_recording import MAP, MODEL, OFFSET, played

pytestmark = pytest.mark.real_time
pytest.importorskip("distributed")
TIMES = {"seconds", "cpu_seconds"}


def without_times(text):
    return {key: value for key, value in json.loads(text).items() if key not in TIMES}


def answers(path):
    return {str(each.relative_to(path)): without_times(each.read_text()) for each in path.rglob(ANSWER_FILE)}


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("cases", [1, 3])
def test_a_bank_is_answered_on_a_cluster_as_it_is_here(local, kill_a_worker, tmp_path, cases):
    plan = BankPlan(51_404, cases, brief=True)
    here = prove(tmp_path / "here", plan, BankOptions(keep=True), lambda *_: None)
    shutil.copytree(tmp_path / "here", tmp_path / "there")
    for path in (tmp_path / "there" / "open").glob(f"*/{ANSWER_FILE}"):
        path.unlink()
    steps = []

    def on_progress(what, done, of):
        steps.append((what, done))
        if what == "diagnosing":
            kill_a_worker(done)

    with open_cluster_workers(local.scheduler_address, one_thread=True) as pool:
        there = prove(tmp_path / "there", plan, BankOptions(executor=pool), on_progress)
    assert kill_a_worker.killed
    assert ("diagnosing", 1) in steps and steps[-1][1] == len(here.outcomes)
    assert answers(tmp_path / "there" / "open") == answers(tmp_path / "here" / "open")
    assert [each.verdict for each in there.outcomes] == [each.verdict for each in here.outcomes]
    assert "failed" not in {each.verdict for each in there.outcomes}
    assert not list((tmp_path / "there" / "open").glob(f"*/{RECORDING_FILE}"))  # answered, and not to be kept


@pytest.fixture
def folder(tmp_path):
    """Three devices, the last with a torn file."""
    whole = tmp_path / "recordings"
    for number, name in enumerate(("one", "torn", "two")):
        (whole / name).mkdir(parents=True)
        np.savez(whole / name / "run.npz", **played(OFFSET * number))
        (whole / name / "run.toml").write_text(MAP)
        (whole / name / "axis.model.toml").write_text(MODEL)
    (whole / "torn" / "run.npz").write_bytes(b"no archive")
    return whole


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_real_recordings_are_answered_on_a_cluster_as_they_are_here(folder, local, kill_a_worker, tmp_path):
    here = diagnose_folder(RealPlan(folder, tmp_path / "here"), lambda *_: None)

    def on_progress(what, share):
        if "answered" in what:
            kill_a_worker(1)

    plan = RealPlan(folder, tmp_path / "there")
    with open_cluster_workers(local.scheduler_address, one_thread=True) as pool:
        there = diagnose_folder(plan, on_progress, executor=pool)
        assert kill_a_worker.killed
        kept = {path: path.stat().st_mtime_ns for path in plan.out.rglob(ANSWER_FILE)}
        diagnose_folder(plan, lambda *_: None, executor=pool)
    assert {path: path.stat().st_mtime_ns for path in plan.out.rglob(ANSWER_FILE)} == kept
    assert answers(plan.out) == answers(tmp_path / "here")
    assert [each.verdict for each in there.results.answers] == [each.verdict for each in here.results.answers]
    assert sorted(path.relative_to(plan.out) for path in plan.out.rglob("*")) == sorted(
        path.relative_to(tmp_path / "here") for path in (tmp_path / "here").rglob("*")
    )


def test_seconds_of_a_processor_are_no_limit_on_other_machines(folder, local, tmp_path):
    refused = pytest.raises(WrongUseError, match="Leave --seconds out")
    with open_cluster_workers(local.scheduler_address) as pool, refused:
        diagnose_folder(RealPlan(folder, tmp_path / "out", seconds=20.0), lambda *_: None, executor=pool)
    assert not (tmp_path / "out").exists()
