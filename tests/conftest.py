"""Shared by all tests: small protocols, and where shared test material lies."""

import gc
import importlib.util
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import ModuleType

import pytest
from hypothesis import settings

from protocols.definition.study_protocol import StudyProtocol
from protocols.document.loading import load_protocol
from tests.machine_pauses import PauseMeter
from tests.small_protocols import BRIEF, SMALL

# The same examples each time: what fails, fails on every machine. `--hypothesis-profile explore` draws new ones.
# No deadline: a test that fails where the machine is busy says nothing about the code.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("explore", derandomize=False, deadline=None)
settings.load_profile("repeatable")


# Ten thousand tests keep much alive that the garbage collector would look through again and again (6 % of their time).
gc.set_threshold(100_000, 50, 50)

# People read times by the clock of the machine: here it stands in one place, for programs that tests start as well.
os.environ["TZ"] = "UTC"
time.tzset()

# A shell that runs the tests in the background has Ctrl-C ignored, and programs that tests start inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

FSYNC = os.fsync
# For people a crashing effect is left out and the run goes on; a test must see it.
os.environ["HAPTEQ_STRICT"] = "1"


@pytest.fixture(scope="session", autouse=True)
def power_stays_on() -> Iterator[None]:
    """Files reach the operating system, not the disk, for which a trial waits several times: tests kill programs, and
    never cut the power. That the log is synchronised before anything acts on it: `test_order_of_acts.py`. Programs that
    tests start do it as ever."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(os, "fsync", os.fstat)  # refuses a closed descriptor alike
        yield


@pytest.fixture
def synchronising_disk(monkeypatch) -> None:
    """Files reach the disk after all."""
    monkeypatch.setattr(os, "fsync", FSYNC)


@pytest.fixture
def summer_and_winter(monkeypatch) -> Iterator[None]:
    """The machine stands in central Europe: +01:00, in summer +02:00."""
    monkeypatch.setenv("TZ", "CET-1CEST,M3.5.0,M10.5.0/3")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


PAUSES = PauseMeter()
IN_PROCESS = tuple(
    f"tests/study/devices/{part}"
    for part in (
        "test_",
        "hung_driver/",
        "drive/",
        "safe/",
        "governor/",
        "loop_process/",
        "accelerometer/",
        "replay/",
        "telemetry/",
        "force_dimension/",
    )
)
"""Tests here run the haptic loop or a sensor's board in the tests' own process, or must give a loop signs of life."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A busy machine shows a screen late, and a trial whose screen fell silent is void, as it must be: again, then.

    So is a test of the haptic loop in whose course the process is known to have stood still for longer than the loop
    waits for it. Never another: an answer that is lost, a process that is killed, a race of threads.
    """
    for item in items:
        if item.get_closest_marker("may_be_late"):
            item.add_marker(pytest.mark.flaky(reruns=2, reruns_delay=2))
        elif item.get_closest_marker("real_time") and item.nodeid.startswith(IN_PROCESS):
            item.add_marker(pytest.mark.flaky(reruns=2, reruns_delay=2, condition=PAUSES.paused))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_call(item: pytest.Item) -> None:
    if item.get_closest_marker("real_time"):
        PAUSES.reset()


@pytest.fixture(scope="session")
def small_text() -> str:
    return SMALL


@pytest.fixture(scope="session")
def brief_text() -> str:
    return BRIEF


@pytest.fixture(scope="session")
def brief_protocol() -> StudyProtocol:
    protocol = load_protocol(BRIEF, "brief.toml")
    assert isinstance(protocol, StudyProtocol)
    return protocol


@pytest.fixture(scope="session")
def small_protocol() -> StudyProtocol:
    protocol = load_protocol(SMALL, "small.toml")
    assert isinstance(protocol, StudyProtocol)
    return protocol


@pytest.fixture
def shared() -> Path:
    """The folder of shared test material beside the checkout; tests that need it skip without it."""
    folder = Path(__file__).resolve().parents[2] / "shared"
    if not folder.is_dir():
        pytest.skip("the shared recordings and cases are not beside this checkout")
    return folder


@pytest.fixture(scope="session")
def rigs() -> ModuleType:
    """`tests/rigs.py`, bare rigs that write down every force. Imported late: it compiles."""
    return _module_at(Path(__file__).parent / "rigs.py")


@pytest.fixture(scope="session")
def force_judge() -> ModuleType:
    """`tests/force_judge.py`, what a hand may be given, without a look at the safety layer."""
    return _module_at(Path(__file__).parent / "force_judge.py")


@pytest.fixture(scope="session")
def lying(rigs, force_judge) -> ModuleType:
    """`tests/lying_encoders.py`, handles whose encoders lie, and ticks that come late. Imported late: it compiles."""
    return _module_at(Path(__file__).parent / "lying_encoders.py")


@pytest.fixture(scope="session")
def vendor() -> ModuleType:
    """`tests/vendor_stub.py`, a device library of Force Dimension's kind, for tests of its driver."""
    return _module_at(Path(__file__).parent / "vendor_stub.py")


@pytest.fixture(scope="session")
def served() -> ModuleType:
    """`tests/served_device.py`, a device behind the pipes of the loop's process. Imported late: it compiles."""
    return _module_at(Path(__file__).parent / "served_device.py")


@pytest.fixture(scope="session")
def compiled_stub(vendor, tmp_path_factory) -> Path:
    return vendor.compile_stub(tmp_path_factory.mktemp("stub") / vendor.FILE)


@pytest.fixture
def stub(vendor, compiled_stub, tmp_path, monkeypatch):
    """A device of its own in wall time, which the driver finds as it finds the real library, and accepted for hands. It
    lives in a file: for the test and the process of the loop alike, and on when a program that drives it is killed."""
    monkeypatch.setenv("FDSDK", str(tmp_path / "sdk"))
    monkeypatch.setenv("HAPTEQ_STUB_FILE", str(tmp_path / "device"))
    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(tmp_path / "none.toml"))
    vendor.accept("omega.3")
    with vendor.copied(compiled_stub, tmp_path / "sdk") as device:
        yield device


@pytest.fixture
def validated_here(monkeypatch) -> None:
    """By a thread, where a test is not about the process of its own: that one reads files that end their reader, see
    `test_validate_in_process.py`, and takes seconds to start."""
    from study.workflows.files import validate_in_process

    monkeypatch.setattr(validate_in_process, "_start_worker", lambda: ThreadPoolExecutor(max_workers=1))


@pytest.fixture(scope="session")
def sketching() -> Callable[[], AbstractContextManager[None]]:
    """`tests/sketches.py`, for fixtures of a module."""
    return _sketching


@contextmanager
def _sketching() -> Iterator[None]:
    from tests.sketches import list_replacements

    with pytest.MonkeyPatch.context() as patched:
        for replacement in list(list_replacements()):
            patched.setattr(*replacement)
        yield


@pytest.fixture
def sketched() -> Iterator[None]:
    """`tests/sketches.py`. Fixtures of a module still draw where they do not use `sketching`."""
    with _sketching():
        yield


@pytest.fixture
def stepped_stub(stub):
    """Its time passes with the forces that it gets: a millisecond each."""
    stub.set("wall_time", 0)
    return stub


@pytest.fixture
def small_file(tmp_path, small_text) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(small_text)
    return path


@pytest.fixture(scope="session")
def session_logs() -> ModuleType:
    """`tests/session_logs.py`, logs as a crash, an older version or a forger leaves them."""
    return _module_at(Path(__file__).parent / "session_logs.py")


@pytest.fixture(scope="session")
def plants() -> ModuleType:
    """`tests/plants.py`, synthetic devices with a known truth."""
    return _module_at(Path(__file__).parent / "plants.py")


@pytest.fixture(scope="session")
def rubbing() -> ModuleType:
    """`tests/rubbing.py`, the synthetic device with dry friction. Imported late: it compiles."""
    return _module_at(Path(__file__).parent / "rubbing.py")


@pytest.fixture(scope="session")
def diagnosed() -> ModuleType:
    """`tests/diagnosed.py`, a diagnosis from real fits. Imported late: it compiles."""
    return _module_at(Path(__file__).parent / "diagnosed.py")


@pytest.fixture(scope="session")
def module_at() -> Callable[[Path], ModuleType]:
    """Loads a module of a test folder, which is no package."""
    return _module_at


def _module_at(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = sys.modules[path.stem] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
