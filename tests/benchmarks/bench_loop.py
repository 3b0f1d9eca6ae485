"""The loop of a real device against bare C, on the stub of the vendor's library, in one run.

What a tick costs: beside the library's two calls made by C alone, and beside the same loop stepped from Python. How
often it is late: beside a bare C loop with nothing in its ticks, while another thread of the same program computes.
"""

import contextlib
import ctypes
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from study.devices.clock import RealClock
from study.devices.device import Health
from study.devices.drive.stepped_runner import SteppedRunner
from study.devices.force_dimension.loop_cells import VENDOR_CALLS
from study.devices.governor import cells
from study.devices.governor.governor import Governor
from study.devices.safe import SafeDevice
from study.workflows.checks.bare_loop import compare_with_bare_loop, run_bare_loop_in_parallel

sys.path.insert(0, str(Path(__file__).parents[1]))
import rigs
import vendor_stub

TICKS, RUNS = 20_000, 7
TIMED_S, ATTENDED_EVERY_S = 10.0, 0.02
ALLOWED = 10.0
"""Times the library's two calls from C that a whole tick may take."""

TWO_CALLS = """
typedef int (*Read)(double *, double *, double *, char);
typedef int (*Send)(double, double, double, char);
void two_calls(Read read, Send send, int times) {
  double x, y, z;
  while (times--) read(&x, &y, &z, 0), send(0.1, 0.0, 0.0, 0);
}
"""


class Interpreted:
    """A rig without its compiled functions."""

    def __init__(self, rig) -> None:
        self.sense, self.write, self.buttons, self.close = rig.sense, rig.write, rig.buttons, rig.close
        self.info, self.drops_force_after_s = rig.info, rig.drops_force_after_s


def us_of_c(folder: Path, rig) -> float:
    source, library = folder / "two_calls.c", folder / "two_calls.so"
    source.write_text(TWO_CALLS)
    command = [*vendor_stub.compiler(), "-std=c11", "-O2", "-shared", "-fPIC", "-o", str(library), str(source)]
    subprocess.run(command, check=True, timeout=240)
    two_calls = ctypes.CDLL(str(library)).two_calls
    read, send = (ctypes.c_void_p(int(address)) for address in rig._handle.library.find_addresses(VENDOR_CALLS[:2]))
    return us_each(lambda: two_calls(read, send, TICKS))


def us_of_ticks(rig) -> float:
    governor = Governor(rig.info, rigs.SETTINGS)
    runner = SteppedRunner(rig, governor, False, time.monotonic, monotonic=True)
    governor.begin_hold(rigs.sine(1.0))
    # Ticks follow each other at once, so the handle hardly moves.
    governor.settings[[cells.WATCHDOG_TICKS, cells.STALE_TICKS, cells.REDUCTION_TICKS]] = np.inf
    governor.state[cells.LONGEST_HOLD] = np.inf
    us = us_each(lambda: runner.run(TICKS))
    assert governor.moving, (governor.fault, runner.failure)
    return us


def us_each(run) -> float:
    """Processor time of the quickest run: the others were disturbed."""
    taken = []
    for _ in range(RUNS):
        began = time.thread_time()
        run()
        taken.append(time.thread_time() - began)
    return 1e6 * min(taken) / TICKS


@contextlib.contextmanager
def computing() -> Iterator[None]:
    """Another thread of this program, which keeps the interpreter for as long as it may."""
    over = threading.Event()

    def compute() -> None:
        while not over.is_set():
            sum(range(10_000))

    thread = threading.Thread(target=compute)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def timed(rig) -> Health:
    limits = replace(rigs.LIMITS, longest_hold_s=60.0, watchdog_s=1.0)
    still = replace(rigs.SETTINGS, limits=limits, spring_frequency_hz=0.0, spring_damping_n_s_per_m=0.0)
    device = SafeDevice(rig, still, RealClock())
    with contextlib.closing(device), computing():
        device.hold(rigs.sine(0.01))
        until_s = time.monotonic() + TIMED_S
        while time.monotonic() < until_s:
            device.keep_alive()
            time.sleep(ATTENDED_EVERY_S)
        return device.release().health


def report(line: str) -> None:
    sys.stdout.write(line + "\n")


def main() -> int:
    good = True
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        compiled = vendor_stub.compile_stub(folder / vendor_stub.FILE)
        with vendor_stub.copied(compiled, folder / "costs") as stub:
            stub.set("watchdog_stretch", 1e3)
            stub.set("friction", 3.0)  # it stays where it is
            rig = stub.rig(sensed=False)
            c_us, ours_us, python_us = us_of_c(folder, rig), us_of_ticks(rig), us_of_ticks(Interpreted(rig))
            rig.close()
        report(
            f"a tick: {ours_us:.2f} us, {ours_us / c_us:.2f} times the library's two calls from C ({c_us:.2f} us; at "
            f"most {ALLOWED:g} wanted); from Python {python_us / c_us:.2f} times"
        )
        good &= ours_us <= ALLOWED * c_us
        for way in ("compiled", "from Python"):
            with (
                vendor_stub.copied(compiled, folder / way) as stub,
                run_bare_loop_in_parallel(TIMED_S, rigs.RATE_HZ, True) as bare,
            ):
                stub.set("watchdog_stretch", 10)
                rig = stub.rig(sensed=False)
                health = timed(rig if way == "compiled" else Interpreted(rig))
            found = compare_with_bare_loop(health.late_ticks + health.missed_ticks, health.ticks, bare)
            report(f"{way}: {health.fault.name}, the latest {1000 * health.latest_s:.1f} ms; {found.value}")
            good &= found.fine or way != "compiled"
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
