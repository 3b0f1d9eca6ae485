"""A withdrawal that was interrupted at any point goes on and finishes; a repeated one erases nothing more."""

import json
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from study.cli.main import main
from study.errors import StudyError
from study.store.sessions.archive import SessionFolder
from study.workflows.files.validate import validate_file
from study.workflows.results.collect_sessions import collect_sessions
from study.workflows.results.fold_session import fold_session
from study.workflows.session.participant_number import find_participant_number
from study.workflows.session.participant_traces import MAX_SEARCHED_BYTES, is_subject_in_analysis
from study.workflows.session.withdraw_participant import plan_withdrawal
from study.workflows.views.view_home import list_session_lines
from study.workflows.views.view_session import make_session_view
from tests.study.workflows.session.withdrawal.data_folder import UTC, erase, files, write_analysis

PART = ".anova.json.0123abcd.part"


def test_what_an_earlier_version_left_half_erased_is_reported_and_erased(data):
    """It wrote the tombstone first, and said that nothing was left but it."""
    left = {"format": "hapteq-tombstone", "version": 1, "session": "P01_001", "withdrawn_utc": UTC, "begun": None}
    (data / "P01_001" / "withdrawn.json").write_text(json.dumps(left))
    (data / "P01_001" / "events.jsonl").unlink()
    problems = " ".join(validate_file(data / "P01_001").problems)
    assert "Still there: recordings/, session.json, thresholds.csv, trials.csv." in problems
    assert f"hapteq withdraw P01_001 --data {data}" in problems
    erase(data)
    assert validate_file(data / "P01_001").problems == ()


class Killed(BaseException):
    """In the place of a SIGKILL: from here on no operation is done any more."""


class _Killer:
    """Counts what changes a file system, and ends the program before the operation `at`."""

    CHANGING = ("os.remove", "os.rmdir", "os.rename", "os.link", "os.mkdir", "os.chmod", "os.truncate", "os.symlink")

    def __init__(self) -> None:
        self.active, self.done, self.at = False, 0, 0

    def __call__(self, event: str, arguments: tuple) -> None:
        if not self.active:
            return
        writes = event == "open" and isinstance(arguments[2], int) and arguments[2] & (os.O_WRONLY | os.O_RDWR)
        if writes or event in self.CHANGING:
            self.done += 1
            if self.done >= self.at:
                raise Killed

    @contextmanager
    def before(self, operation: int) -> Iterator[None]:
        self.active, self.done, self.at = True, 0, operation
        try:
            yield
        finally:
            self.active = False


@pytest.fixture(scope="module")
def killer() -> _Killer:
    """An audit hook cannot be taken off; this one sleeps between tests."""
    killer = _Killer()
    sys.addaudithook(killer)
    return killer


def check_half_erased(data: Path) -> None:
    """Nothing of P01 counts as data, and it is said how to go on."""
    for line in list_session_lines(data):
        if line.subject == "P01":
            assert line.standing == "withdrawn"
            assert "hapteq withdraw P01_" in line.remark
    assert [folder.name for folder in collect_sessions(data).sessions] == ["P02_001"]
    for name in ("P01_001", "P01_002"):
        view = make_session_view(data / name)
        assert (view.line.standing, view.thresholds, view.events) == ("withdrawn", (), ())
        with pytest.raises(StudyError, match="was withdrawn"):
            fold_session(SessionFolder(data / name))
        validation = validate_file(data / name)
        assert f"hapteq withdraw {name} --data {data}" in " ".join(validation.problems)
        if not (data / name / "events.jsonl").exists():
            assert {path.suffix for path in (data / name).iterdir()} <= {".json", ".lock", ".part"}
            assert not (data / name / "session.json").exists()
        for left in (path for path in (data / name).iterdir() if not path.name.startswith(("with", "session.lock"))):
            assert left.name in " ".join(validation.problems)
    assert find_participant_number(data, "P09", "corpus", simulated=True) == 1


def test_killed_before_any_operation_it_continues_and_finishes(data, elsewhere, killer, tmp_path, monkeypatch):
    (data / "P01_001" / "recordings" / "more").symlink_to(elsewhere)
    monkeypatch.setattr("study.devices.clock.RealClock.utc", lambda clock: UTC)
    whole = shutil.copytree(data, tmp_path / "whole", symlinks=True)
    erase(whole)
    operation, begun = 0, 0
    while True:
        operation += 1
        place = shutil.copytree(data, tmp_path / f"killed-{operation}", symlinks=True)
        try:
            with killer.before(operation):
                erase(place)
            break
        except Killed:
            pass
        untouched = {name: held for name, held in files(data).items() if name.startswith("P01")}
        if (place / "P01.withdrawal.json").exists():
            begun += 1
            check_half_erased(place)
        else:
            now = files(place)
            over = "P01_001/withdrawn.json" in now and "P01_002/withdrawn.json" in now
            assert over or all(now.get(name) == held for name, held in untouched.items())
        assert main(["withdraw", "P01_001", "--data", str(place), "--yes"]) == 0
        assert files(place) == files(whole)
        assert validate_file(place / "P01_001").problems == validate_file(place / "P01_002").problems == ()
        shutil.rmtree(place)
    assert begun > 15


def test_an_analysis_of_others_made_after_the_withdrawal_stays_when_it_is_repeated(data):
    """Its report says that the participant withdrew, as the tombstones do."""
    erase(data)
    left_out = collect_sessions(data).exclusions
    assert "P01_001 was withdrawn by the participant." in left_out
    write_analysis(data / "analysis", "P02")
    report = data / "analysis" / "report.html"
    report.write_text(" ".join(left_out))
    assert plan_withdrawal(SessionFolder(data / "P01_001")).derived == ()
    report.write_text(f"{' '.join(left_out)} P01_001 does not take part: excluded.")
    assert plan_withdrawal(SessionFolder(data / "P01_001")).derived_roots == ("analysis",)


def test_a_report_too_large_to_be_searched_does_not_count_as_one_of_others(data):
    write_analysis(data / "large", "P02")
    assert is_subject_in_analysis(data / "large", "P01") is False
    os.truncate(data / "large" / "report.html", MAX_SEARCHED_BYTES + 1)
    assert is_subject_in_analysis(data / "large", "P01") is None
