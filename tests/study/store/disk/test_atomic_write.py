import contextlib
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from study.errors import ExitCode
from study.store.disk import atomic_write
from study.store.disk.atomic_write import reserve_space, write_atomically
from study.store.disk.file_errors import AlreadyExistsError, CannotWriteError, NotSyncedError

REPOSITORY = Path(__file__).parents[4]


@contextlib.contextmanager
def files_no_larger_than(size: int):
    """What a full disk does to a program: a write fails in the middle."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@contextlib.contextmanager
def without_rights_in(folder: Path):
    """Also for the superuser, whom no mode of a folder stops."""
    folder.chmod(0o555)
    superuser = os.geteuid() == 0
    if superuser:
        os.seteuid(65534)
    try:
        yield
    finally:
        if superuser:
            os.seteuid(0)
        folder.chmod(0o755)


def test_a_file_appears_under_its_name_alone(tmp_path):
    write_atomically(tmp_path / "a.txt", b"one")
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_bytes() == b"one"


def test_a_file_gets_the_usual_rights(tmp_path):
    tmp_path.chmod(0o755)  # in a private folder, a file is private too: test_privacy.py
    write_atomically(tmp_path / "a.txt", b"one")
    (tmp_path / "b.txt").write_bytes(b"one")
    assert (tmp_path / "a.txt").stat().st_mode == (tmp_path / "b.txt").stat().st_mode


def test_nothing_existing_is_overwritten_unless_asked_for(tmp_path):
    path = tmp_path / "a.txt"
    write_atomically(path, b"one")
    with pytest.raises(AlreadyExistsError, match=r"a\.txt already exists. Nothing that exists is overwritten"):
        write_atomically(path, b"two")
    assert path.read_bytes() == b"one"
    write_atomically(path, b"two", overwrite=True)
    assert path.read_bytes() == b"two"


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_write_that_fails_half_way_leaves_the_old_state(tmp_path, overwrite):
    path = tmp_path / "a.bin"
    if overwrite:
        path.write_bytes(b"old")
    with files_no_larger_than(1000), pytest.raises(CannotWriteError) as refused:
        write_atomically(path, bytes(100_000), overwrite=overwrite)
    assert [kept.read_bytes() for kept in tmp_path.iterdir()] == ([b"old"] if overwrite else [])
    assert "It would be larger than the system allows for one file" in str(refused.value)
    assert "Nothing was changed: no half-written file remains" in refused.value.saved
    assert refused.value.exit_code is ExitCode.ERROR


def test_a_full_disk_is_named():
    error = CannotWriteError(Path("a.h5"), OSError(28, os.strerror(28)))
    assert (error.title, error.happened) == ("a.h5 was not written", "The disk is full.")
    assert error.do_now == "Make room and do it again."


def test_a_folder_without_rights_is_named(tmp_path):
    folder = tmp_path / "closed"
    folder.mkdir()
    with without_rights_in(folder), pytest.raises(CannotWriteError, match=r"You have no right to write in .*closed"):
        write_atomically(folder / "a.txt", b"one")
    assert list(folder.iterdir()) == []


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(CannotWriteError, match=r"There is no folder .*missing. .*Make the folder first"):
        write_atomically(tmp_path / "missing" / "a.txt", b"one")


def test_a_folder_in_place_of_the_file_is_named(tmp_path):
    (tmp_path / "a").mkdir()
    with pytest.raises(CannotWriteError, match=r"a is a folder. .*Choose a name for a file"):
        write_atomically(tmp_path / "a", b"one", overwrite=True)


@pytest.mark.parametrize("overwrite", [False, True])
def test_where_only_the_folder_is_not_synced_the_file_is_said_to_be_there(tmp_path, monkeypatch, overwrite):
    (tmp_path / "a").write_bytes(b"old") if overwrite else None
    monkeypatch.setattr(atomic_write, "sync_folder", fail_to_sync)
    with pytest.raises(NotSyncedError, match="is in place and complete") as refused:
        write_atomically(tmp_path / "a", b"one", overwrite=overwrite)
    assert "Nothing was changed" not in str(refused.value)
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"one"]


def fail_to_sync(folder: Path) -> None:
    raise OSError(5, "Input/output error")


def test_any_other_trouble_is_reported_in_the_systems_words():
    assert (
        CannotWriteError(Path("a"), OSError(5, "Input/output error")).happened == "The system says: Input/output error."
    )


def test_a_program_killed_while_writing_leaves_a_whole_file(tmp_path):
    path = tmp_path / "a.bin"
    program = (
        "import itertools, sys; from pathlib import Path; from study.store.disk.atomic_write import write_atomically\n"
        "for i in itertools.count(): write_atomically(Path(sys.argv[1]), bytes([i % 256]) * 2_000_000, overwrite=True)"
    )
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    writer = subprocess.Popen([sys.executable, "-c", program, str(path)], env=environment)
    deadline = time.monotonic() + 20
    while not path.exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    time.sleep(0.05)
    writer.send_signal(signal.SIGKILL)
    writer.wait()
    content = path.read_bytes()
    assert len(content) == 2_000_000
    assert len(set(content)) == 1


def test_space_is_reserved_until_the_end_of_the_context_and_leaves_nothing(tmp_path):
    with reserve_space(tmp_path / "a.h5", 1_000_000):
        write_atomically(tmp_path / "b.txt", b"one")
    write_atomically(tmp_path / "a.h5", b"one")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.h5", "b.txt"]


@pytest.mark.parametrize("name", ["a.h5", f"{'a' * 245}.h5"])
def test_where_there_is_no_space_or_the_name_is_too_long_the_body_is_not_run(tmp_path, name):
    size = 1000 if len(name) > 200 else 100_000
    with files_no_larger_than(10_000), pytest.raises(CannotWriteError), reserve_space(tmp_path / name, size):
        pytest.fail("it was run")
    assert list(tmp_path.iterdir()) == []


def test_where_the_system_reserves_nothing_the_free_space_is_compared(tmp_path, monkeypatch):
    monkeypatch.delattr(os, "posix_fallocate")
    with reserve_space(tmp_path / "a.h5", 1000):
        pass
    with pytest.raises(CannotWriteError, match="The disk is full"), reserve_space(tmp_path / "a.h5", 10**18):
        pytest.fail("it was run")
    assert list(tmp_path.iterdir()) == []
