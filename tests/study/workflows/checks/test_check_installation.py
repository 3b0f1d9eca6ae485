"""What an installation can lack, one thing at a time."""

import errno
import importlib
import shutil
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import study
from study.workflows.checks import check_installation as module
from study.workflows.checks.check_installation import (
    Terminal,
    check_data_folder,
    check_import_name,
    check_installation,
    check_packages,
    check_privacy,
    check_requirement,
    check_terminal,
    detect_terminal,
)

HOME = Path(study.__file__).parents[1]
GOOD = Terminal("utf-8", "xterm-256color", 80, 24)


@pytest.mark.parametrize(
    ("requirement", "fine", "value"),
    [
        ("numpy>=1.0", True, "(needs >=1.0)"),
        ("numpy>=999", False, "(needs >=999)"),
        ("no-such-package-of-no-author>=1", False, "not installed"),
    ],
)
def test_an_installed_package_is_compared_with_its_requirement(requirement, fine, value):
    finding = check_requirement(Requirement(requirement))
    assert finding.fine is fine
    assert finding.value.endswith(value)
    assert finding.advice == ("" if fine else "Run `make study` in hapteq's folder, or install hapteq again.")


def test_packages_for_tests_are_not_asked_for(distribution):
    distribution("hapteq", requires=["numpy>=1", 'pytest-of-no-author>=1; extra == "test"'])
    assert [finding.name for finding in check_packages()] == ["hapteq", "Python", "numpy"]
    assert all(finding.fine for finding in check_packages())


def test_a_python_that_is_too_old_is_found(distribution):
    distribution("hapteq", python=">=99")
    assert [finding.name for finding in check_packages() if not finding.fine] == ["Python"]


def test_a_checkout_without_installation_says_what_to_do(monkeypatch):
    monkeypatch.setattr(module, "DISTRIBUTION_NAME", "hapteq-of-no-author")
    (finding,) = check_packages()
    assert finding.value == "not installed, so what it needs is not known"
    assert finding.advice == "Run `make study` in its folder once: that installs hapteq and what it needs."


@pytest.fixture
def distribution(tmp_path, monkeypatch):
    """Installs a distribution, as far as its metadata go, in front of all others."""

    def install(name: str, requires=(), python=">=3.11", top_level="") -> None:
        folder = tmp_path / "site" / f"{name}-1.0.dist-info"
        folder.mkdir(parents=True)
        lines = ["Metadata-Version: 2.1", f"Name: {name}", "Version: 1.0", f"Requires-Python: {python}"]
        (folder / "METADATA").write_text(
            "\n".join([*lines, *(f"Requires-Dist: {require}" for require in requires), ""])
        )
        (folder / "top_level.txt").write_text(top_level)
        monkeypatch.syspath_prepend(tmp_path / "site")
        importlib.invalidate_caches()

    return install


def test_another_program_that_owns_a_name_of_ours_is_named(distribution):
    distribution("other-program", top_level="analysis\n")
    finding = check_import_name("analysis", packages_distributions(), HOME)
    assert finding.value == "belongs to other-program as well"
    assert finding.advice == "Install hapteq into an environment of its own: other-program must not share one with it."
    assert check_import_name("study", packages_distributions(), HOME).fine


def test_a_package_that_comes_from_elsewhere_is_found(tmp_path):
    finding = check_import_name("protocols", {}, tmp_path)
    assert finding.value == f"taken from {HOME / 'protocols' / '__init__.py'}"
    assert finding.advice == "Rename that file, or start hapteq without its folder on PYTHONPATH."
    assert check_import_name("no_such_package", {}, HOME).value == "nowhere to be found"


def test_a_good_terminal_is_fine():
    assert all(finding.fine and not finding.advice for finding in check_terminal(GOOD))


@pytest.mark.parametrize(
    ("terminal", "name", "value", "advice"),
    [
        (Terminal("latin-1", "xterm", 80, 24), "Characters", "latin-1", "Set LANG=C.UTF-8"),
        (Terminal("utf-8", "xterm", 79, 24), "Terminal size", "79 x 24 (needs 80 x 24)", "Make the window larger"),
        (Terminal("utf-8", "xterm", 200, 23), "Terminal size", "200 x 23 (needs 80 x 24)", "Make the window larger"),
        (Terminal("utf-8", "dumb", 80, 24), "Colours", "few (TERM=dumb)", "Take another terminal"),
        (Terminal("utf-8", "", 80, 24), "Colours", "few (TERM=not set)", "Take another terminal"),
    ],
)
def test_a_terminal_in_which_the_screens_would_not_work_is_found(monkeypatch, terminal, name, value, advice):
    monkeypatch.delenv("COLORTERM", raising=False)
    monkeypatch.delenv("NO_COLOR", raising=False)
    (wrong,) = [finding for finding in check_terminal(terminal) if not finding.fine]
    assert (wrong.name, wrong.value) == (name, value)
    assert wrong.advice == f"{advice}, or use `hapteq study --plain`."


@pytest.mark.parametrize(
    ("variables", "value"),
    [
        ({"COLORTERM": "truecolor"}, "16 million"),
        ({}, "256"),
        ({"NO_COLOR": "1"}, "switched off by NO_COLOR; no information is given by colour alone"),
    ],
)
def test_colours_are_reported_and_can_be_done_without(monkeypatch, variables, value):
    for name in ("COLORTERM", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    for name, setting in variables.items():
        monkeypatch.setenv(name, setting)
    colours = check_terminal(GOOD)[-1]
    assert (colours.value, colours.fine) == (value, True)


def test_where_there_is_no_terminal_none_is_checked(tmp_path, monkeypatch):
    with (tmp_path / "out").open("w") as out:
        monkeypatch.setattr("sys.stdout", out)
        monkeypatch.setattr("sys.stderr", None)
        assert detect_terminal() is None
    (finding,) = check_terminal(None)
    assert (finding.value, finding.fine) == ("none here, so it was not checked", True)


def test_a_terminal_is_found_where_output_goes_to_one(monkeypatch):
    import os
    import pty

    leader, follower = pty.openpty()
    monkeypatch.setenv("TERM", "vt100")
    with open(follower, "w", encoding="utf-8") as out:  # noqa: PTH123 - a descriptor
        monkeypatch.setattr("sys.stdout", out)
        terminal = detect_terminal()
    os.close(leader)
    assert terminal is not None
    assert (terminal.encoding, terminal.kind) == ("utf-8", "vt100")


def test_a_folder_that_can_be_written_is_fine_and_stays_as_it_was(tmp_path):
    for data in (tmp_path, tmp_path / "not" / "yet"):
        assert ": can be written, " in check_data_folder(data).value
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_found(tmp_path):
    (tmp_path / "data").write_text("a file")
    finding = check_data_folder(tmp_path / "data")
    assert finding.value == f"{tmp_path / 'data'}: Not a directory"
    assert finding.advice == "Choose another folder with --data, or change the rights of this one."


@pytest.mark.parametrize("check", [check_data_folder, check_privacy])
def test_a_folder_that_this_account_may_not_look_into_is_found(tmp_path, monkeypatch, check):
    """A superuser may look into all: the system's answer to others is simulated."""
    examined_path, stat = tmp_path / "closed" / "data", Path.stat

    def refuse(path: Path, **options: bool):
        if path == examined_path:
            raise PermissionError(errno.EACCES, "Permission denied")
        return stat(path, **options)

    monkeypatch.setattr(Path, "stat", refuse)
    finding = check(examined_path)
    assert (finding.value, finding.fine) == (f"{examined_path}: Permission denied", False)
    assert finding.advice == "Choose another folder with --data, or change the rights of this one."


def test_a_full_disk_is_found(tmp_path, monkeypatch):
    usage = type(shutil.disk_usage(tmp_path))
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(10**12, 10**12 - 10**8, 10**8))
    finding = check_data_folder(tmp_path)
    assert (finding.value, finding.fine) == (f"{tmp_path}: can be written, 0.1 GB free", False)
    assert finding.advice == "Make room, or choose another folder with --data."


def test_the_check_covers_packages_terminal_and_data_folder(tmp_path):
    names = [finding.name for finding in check_installation(tmp_path, GOOD)]
    assert names[0] == "hapteq"
    assert names[-9:] == [
        "import study", "import analysis", "import equalizer", "import protocols",
        "Characters", "Terminal size", "Colours", "Data folder", "Data rights",
    ]  # fmt: skip
