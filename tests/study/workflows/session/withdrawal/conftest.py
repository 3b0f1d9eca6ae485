"""A data folder of two participants, and a folder that no withdrawal may touch."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.study.workflows.session.withdrawal.data_folder import copy_session, files, write_analysis


@pytest.fixture
def data(tmp_path) -> Path:
    """Two sessions of P01, one of P02, and their analysis."""
    data = tmp_path / "data"
    for name in ("P01_001", "P01_002", "P02_001"):
        copy_session(data, name)
    write_analysis(data / "analysis", "P01", "P02")
    return data


@pytest.fixture
def elsewhere(tmp_path) -> Iterator[Path]:
    """A folder that no withdrawal may touch."""
    copy_session(tmp_path / "other", "P01_002")
    folder = tmp_path / "other" / "P01_002"
    before = files(folder)
    yield folder
    assert files(folder) == before
