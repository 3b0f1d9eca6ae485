"""Two cores, and no time or failure remembered from before."""

import pytest

from study.workflows import forked_map as module
from tests.study.workflows.forked_map.child_processes import children, left_by_earlier_tests


@pytest.fixture(autouse=True)
def two_cores_and_nothing_known(monkeypatch):
    monkeypatch.setattr(module, "count_cores", lambda: 2)
    monkeypatch.setattr(module, "_mean_task_s", {})
    monkeypatch.setattr(module, "_unforkable", set())


@pytest.fixture(autouse=True)
def others():
    left_by_earlier_tests.clear()
    left_by_earlier_tests.update(children())
