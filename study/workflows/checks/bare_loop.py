"""Reference for the timing of a device's control loop: an empty real-time loop in C (`bare_loop.c`), run in parallel.

It estimates the least number of late ticks that this computer can reach under the same load. The program is compiled
for each measurement, by the system's compiler or that of the optional dependency `compiler`; without a compiler, on
Windows, and where compiling or running it fails, the finding states that no comparison was made.
"""

import contextlib
import math
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from study.session.views.participant_views import DeviceFinding

SOURCE = Path(__file__).with_name("bare_loop.c")
"""Source of the C loop."""
COMPILERS = ("cc", "gcc", "clang")
"""C compilers, in the order in which they are looked up on the search path."""
PRIORITY = 40
"""Real-time priority (SCHED_FIFO) of the C loop, if requested. Must equal that of a device's loop,
`study.devices.drive.real_time_class.PRIORITY`, so that both compete for the processor on equal terms."""

ACCEPTED_RATIO = 1.5
"""Accepted ratio of the late ticks of the device's loop to those of the C loop: the device's loop has more work (safety
layer). Heuristic."""
ACCEPTED_STANDARD_ERRORS = 3.0
"""Number of standard errors within which a difference of the two counts is attributed to chance; late ticks are taken
as independent events (Poisson). Chosen: a loop at the accepted ratio is reported about once in 1000 measurements."""

COMPILE_TIMEOUT_S = 120.0
"""Time limit of the compilation (s). Chosen: long enough for a busy computer."""
EXTRA_TIMEOUT_S = 30.0
"""Time (s) after the planned end of the C loop at which it is taken to have failed. Chosen."""
FINDING_NAME = "Bare C loop"
"""Name of the finding in the report."""
LATE_TICKS_ADVICE = (
    "The computer can do better than this loop did: close other programs, measure again, and report it if it persists."
)
"""Advice in the finding if the device's loop has too many late ticks."""


@dataclass(frozen=True, slots=True)
class BareLoopTiming:
    """Measured timing of the C loop, with which the device's loop is compared."""

    ticks: int
    late_ticks: int
    """Ticks whose work ended after the next tick was due, missed ticks included."""
    latest_s: float
    """Largest time from a tick's due time to the end of its work (s)."""
    raised_priority: bool
    """Whether the operating system granted real-time priority."""


@dataclass(slots=True)
class BareLoopRun:
    """A run of the C loop in parallel with the device's loop."""

    result: BareLoopTiming | None = None
    """Timing; None until the loop has ended, and if it failed."""
    failure_reason: str = ""
    """Why the loop gave no timing; empty if it did not fail."""


@contextlib.contextmanager
def run_bare_loop_in_parallel(duration_s: float, rate_hz: float, raised_priority: bool) -> Iterator[BareLoopRun]:
    """Context manager that runs the C loop while the `with` block is executed. At the end of the block it waits for the
    end of the loop and stores the result in the `BareLoopRun`; after an exception in the block the loop is killed.

    duration_s: duration of the loop (s). rate_hz: its tick rate. raised_priority: whether to request real-time
    priority. A missing compiler, a failed compilation, a failed start and a missing result raise no exception:
    `BareLoopRun.failure_reason` states them.
    """
    run = BareLoopRun()
    with tempfile.TemporaryDirectory() as folder:
        program = _compile_loop(Path(folder), run)
        if program is None:
            yield run
            return
        command = [str(program), f"{duration_s:g}", f"{rate_hz:g}", str(PRIORITY if raised_priority else 0)]
        try:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
        except OSError as error:
            run.failure_reason = f"it could not be started ({error.strerror})"
            yield run
            return
        with process:
            try:
                yield run
                _read_timing(process, duration_s, run)
            finally:
                process.kill()


def _read_timing(process: "subprocess.Popen[bytes]", duration_s: float, run: BareLoopRun) -> None:
    """Wait for the end of the C loop and read what it prints: ticks, late ticks, largest lateness (s), and priority
    (0 = not granted)."""
    try:
        output, _ = process.communicate(timeout=duration_s + EXTRA_TIMEOUT_S)
        ticks, late_ticks, latest_s, granted_priority = output.split()
        run.result = BareLoopTiming(int(ticks), int(late_ticks), float(latest_s), int(granted_priority) > 0)
    except (subprocess.TimeoutExpired, ValueError):
        run.failure_reason = "it gave no result"


def compare_with_bare_loop(late_ticks: int, ticks: int, run: BareLoopRun) -> DeviceFinding:
    """Compare the late ticks of the device's loop with those of the C loop. late_ticks, ticks: counts of the device's
    loop, missed ticks included. Too many late ticks give a warning, which prevents no session."""
    if run.result is None:
        return DeviceFinding(FINDING_NAME, f"not compared: {run.failure_reason}", fine=True)
    reference = run.result
    late_limit = _compute_late_limit(ACCEPTED_RATIO * reference.late_ticks * ticks / max(reference.ticks, 1))
    fine = late_ticks <= late_limit
    comparison_text = (
        f"{reference.late_ticks} of {reference.ticks} late "
        f"({reference.late_ticks / max(reference.ticks, 1):.2%}) at the same time, "
        f"{'with' if reference.raised_priority else 'without'} real-time priority, the latest by "
        f"{1000 * reference.latest_s:.1f} ms; this loop: {late_ticks} of {ticks} "
        f"({late_ticks / max(ticks, 1):.2%}), where up to {late_limit} are fine ({ACCEPTED_RATIO:g} times as many, and "
        "chance)"
    )
    return DeviceFinding(FINDING_NAME, comparison_text, fine, "" if fine else LATE_TICKS_ADVICE, warning=not fine)


def _compute_late_limit(expected_late_ticks: float) -> int:
    """Compute the largest accepted count n of late ticks of the device's loop. expected_late_ticks: r k, with r =
    ACCEPTED_RATIO and the count k of the C loop, scaled to the number of ticks of the device's loop.

    n is the larger root of (n - r k)² = z² (n + r² k), z = ACCEPTED_STANDARD_ERRORS: the variance of a Poisson count is
    estimated by the count itself, and that of r k by r² k, for loops of equal length.
    """
    root_term = math.sqrt((1.0 + ACCEPTED_RATIO) * expected_late_ticks + ACCEPTED_STANDARD_ERRORS**2 / 4.0)
    return math.floor(expected_late_ticks + ACCEPTED_STANDARD_ERRORS**2 / 2.0 + ACCEPTED_STANDARD_ERRORS * root_term)


def _compile_loop(folder: Path, run: BareLoopRun) -> Path | None:
    """Compile the C loop into a folder. Returns the program's path; None, with the reason in `run.failure_reason`, if
    it cannot be compiled."""
    compiler = _find_compiler()
    if sys.platform == "win32" or compiler is None:
        run.failure_reason = (
            "no C compiler is here (pip install '.[compiler]')" if compiler is None else "not on Windows"
        )
        return None
    program = folder / "bare_loop"
    try:
        subprocess.run(
            [*compiler, "-std=c11", "-O2", "-o", str(program), str(SOURCE)],
            check=True,
            capture_output=True,
            timeout=COMPILE_TIMEOUT_S,
        )
    except (OSError, subprocess.SubprocessError) as error:
        run.failure_reason = f"it could not be compiled ({type(error).__name__})"
        return None
    return program


def _find_compiler() -> list[str] | None:
    """Find the command of a C compiler: of the system, else of the Python package `ziglang`; None without either."""
    compiler_path = next((path for name in COMPILERS if (path := shutil.which(name))), None)
    if compiler_path is not None:
        return [compiler_path]
    return [sys.executable, "-m", "ziglang", "cc"] if find_spec("ziglang") else None
