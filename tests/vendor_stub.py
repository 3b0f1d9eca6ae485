"""The stub of the vendor's library: compiled once a run, and copied for each test, since each copy is a device."""

import contextlib
import ctypes
import math
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.accelerometer.newest_sample import NewestSample
from study.devices.device import DeviceInfo
from study.devices.force_dimension.acceptance import Acceptance, write_acceptance
from study.devices.force_dimension.connect import make_ready
from study.devices.force_dimension.device_models import MODELS
from study.devices.force_dimension.handle import Handle
from study.devices.force_dimension.library import Library
from study.devices.force_dimension.open_rig import read_info
from study.devices.force_dimension.rig import ForceDimensionRig

SOURCE = Path(__file__).parent / "study" / "devices" / "force_dimension" / "dhd_stub.c"
FILE = "libdrd.so.3.17.5"


def compiler(names: tuple[str, ...] = ("cc", "gcc", "clang"), of_zig: str = "cc") -> list[str]:
    """The system's, or the one that pip installs. Without one these tests fail: none of them is skipped."""
    found = next((path for name in names if (path := shutil.which(name))), None)
    if found:
        return [found]
    if find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", of_zig]
    raise RuntimeError(f"No compiler ({names[0]}) is here: install one, or `pip install '.[compiler]'`.")


def cpp_compiler() -> list[str]:
    return compiler(("c++", "g++", "clang++"), "c++")


def compile_stub(out: Path, with_compiler: list[str] | None = None) -> Path:
    command = [*(with_compiler or compiler()), "-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    subprocess.run([*command, "-o", str(out), str(SOURCE), "-lm"], check=True, capture_output=True, timeout=240)
    return out


class Stub:
    """One device. Its switches and what it knows: the list in dhd_stub.c."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.seed = 0
        """Of the noise on the accelerometer's readings."""
        self._library = ctypes.CDLL(str(path))
        self._library.stub_set.argtypes = [ctypes.c_char_p, ctypes.c_double]
        self._library.stub_get.argtypes, self._library.stub_get.restype = [ctypes.c_char_p], ctypes.c_double
        self._library.stub_peek.argtypes, self._library.stub_peek.restype = [ctypes.c_char_p], ctypes.c_double
        self._library.stub_sensor.argtypes = [ctypes.c_void_p, ctypes.c_int]
        self._library.stub_advance.argtypes = [ctypes.c_double]
        self._library.stub_move.argtypes = [ctypes.c_double] * 3
        self._library.stub_fail.argtypes = [ctypes.c_char_p, ctypes.c_double, ctypes.c_double]
        self._library.stub_delay.argtypes = [ctypes.c_char_p, ctypes.c_double, ctypes.c_double]

    def set(self, name: str, value: float) -> None:
        self._library.stub_set(name.encode(), value)

    def get(self, name: str) -> float:
        value = float(self._library.stub_get(name.encode()))
        assert value == value, f"the stub knows no {name}"
        return value

    def peek(self, name: str) -> float:
        """While another program drives the device: what it knows as of its last call."""
        return float(self._library.stub_peek(name.encode()))

    def fail(self, function: str, code: int = 2, times: float = math.inf) -> None:
        """The next calls of this function of the vendor's answer an error. The last function that was named counts."""
        self._library.stub_fail(function.encode(), code, times)

    def delay(self, function: str, seconds: float, times: float = math.inf) -> None:
        """The next calls of it take so long."""
        self._library.stub_delay(function.encode(), seconds, times)

    def advance(self, seconds: float) -> None:
        self._library.stub_advance(seconds)

    def move(self, x_m: float, y_m: float, z_m: float) -> None:
        self._library.stub_move(x_m, y_m, z_m)

    def sense_into(self, rows: FloatArray) -> None:
        """From now on, a sample at each reading."""
        self._sensed_into = rows  # which must outlive every reading
        self._library.stub_sensor(rows.ctypes.data, self.seed)

    @property
    def applied_n(self) -> FloatArray:
        return np.array([self.get(f"f{axis}") for axis in "xyz"])

    @property
    def safe(self) -> bool:
        """No force, and braked."""
        return not self.get("force_on") and bool(self.get("brake")) and not self.applied_n.any()

    def opened(self) -> Handle:
        """As the library opens a device, before anything is set."""
        library = Library(self.path)
        return Handle(library, library.call("dhdOpenID", 0))

    def rig(self, cap_n: float = 4.5, sensed: bool = True, rests: bool = False) -> ForceDimensionRig:
        """Ready for forces. sensed: with an accelerometer that tells the truth."""
        model, handle = MODELS["omega3"], self.opened()
        drops_after_s = make_ready(handle, model, cap_n, None)
        info: DeviceInfo = read_info(handle, handle.library, model, None)
        return ForceDimensionRig(handle, info, drops_after_s, cap_n, TrueSensor(self) if sensed else None, rests)


def accept(
    device: str,
    on: str = "",
    details: str = "serial 4242, firmware 2.41, SDK 3.17.5.0",
    baseline: tuple[str, str] = ("", ""),
) -> None:
    """As an operator would have, today or on that day."""
    today = datetime.now(UTC).date().isoformat()
    write_acceptance(Acceptance(device, details, "the tests", on or today, 0.5, 0.03, 1.0, 0.5, *baseline))


class TrueSensor:
    """What the stub knows, in memory that a loop reads."""

    def __init__(self, stub: Stub) -> None:
        self._newest = NewestSample()
        self.samples = self._newest.rows
        self.closed = False
        stub.sense_into(self.samples)

    def read_latest(self) -> tuple[FloatArray, bool]:
        return self._newest.read_zeroed(time.monotonic())

    def sensed(self, since_s: float, tick_s: FloatArray, rate_hz: float) -> None:
        """It is read at each tick."""

    def close(self) -> None:
        self.closed = True


@contextlib.contextmanager
def copied(compiled: Path, folder: Path) -> Iterator[Stub]:
    """In the place below `folder` where the SDK would be."""
    place = folder / "lib" / FILE
    place.parent.mkdir(parents=True)
    shutil.copy(compiled, place)
    yield Stub(place)
