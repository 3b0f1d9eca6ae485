"""Files that take their reader down."""

import os
import time
from pathlib import Path

import pytest

from study.errors import StudyError
from study.workflows.files import validate_in_process
from study.workflows.files.validate import Validation, validate_file
from study.workflows.files.validate_in_process import validate_files

pytestmark = pytest.mark.real_time


def crash_or_hang(path: Path) -> Validation:
    """Stands for the HDF5 library on a file damaged in a way that it does not survive; found by name here."""
    if "crash" in path.name:
        os.abort()
    if "hang" in path.name:
        time.sleep(600)
    return validate_file(path)


@pytest.mark.timeout(120)
def test_a_crash_and_a_hang_are_problems_of_their_files_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(validate_in_process, "_validate_safely", crash_or_hang)
    names = ("sound.toml", "crash.h5", "hang.h5", "last.toml")
    paths = [tmp_path / name for name in names]
    for path in paths:
        path.write_text("x = 1\n")
    found = list(validate_files(paths, timeout_s=5.0))
    assert [v.path for v in found] == paths
    assert found[1].problems == ("The file is damaged: reading it crashes the HDF5 library. Restore it from a copy.",)
    assert "does not end within 5 s" in found[2].problems[0]
    for other in (found[0], found[3]):
        assert other == validate_file(other.path)


def die_at_the_start() -> None:
    os._exit(1)


def hang_at_the_start() -> None:
    time.sleep(600)


@pytest.mark.timeout(120)
@pytest.mark.parametrize("start", [die_at_the_start, hang_at_the_start])
def test_a_worker_that_does_not_start_is_no_fault_of_a_file(tmp_path, monkeypatch, start):
    path = tmp_path / "sound.toml"
    path.write_text("x = 1\n")
    monkeypatch.setattr(validate_in_process, "_confirm_start", start)
    monkeypatch.setattr(validate_in_process, "START_TIMEOUT_S", 2.0)
    with pytest.raises(StudyError) as refused:
        list(validate_files([path]))
    assert refused.value.title == "Files cannot be validated"
    assert "does not start" in refused.value.happened
