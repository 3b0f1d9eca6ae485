"""Reference for the timing of a device's loop: an empty real-time loop in C (`bare_loop.c`), run at the same time.

It shows how many late ticks this computer causes at best under the same load. The program is compiled for each
measurement, by the system's compiler or that of the extra `compiler`; without a compiler, and on Windows, the report
says that nothing was compared.
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

from study.session.views.views import DeviceFinding

SOURCE = Path(__file__).with_name("bare_loop.c")
"""Source of the loop, compiled for each measurement."""
COMPILERS = ("cc", "gcc", "clang")
"""C compilers that are searched for in the path, in this order."""
PRIORITY = 40
"""Real-time priority (SCHED_FIFO) of the C loop, if one is requested; that of a device's loop."""

WORSE_BY = 1.5
"""Accepted ratio of the late ticks of the device's loop, which has more work (safety layer), to those of the C loop.
Heuristic."""
CHANCE = 3.0
"""Number of standard errors within which a difference of the two counts is taken as chance, with late ticks as
independent events (Poisson)."""

COMPILING_S = 120.0
"""Time limit of the compilation (s)."""
OVERTIME_S = 30.0
"""Time (s) beyond the duration of the C loop after which it is taken to have failed."""
NAME = "Bare C loop"
"""Name of the finding."""
ADVICE = (
    "The computer can do better than this loop did: close other programs, measure again, and report it if it persists."
)
"""Advice where the device's loop has too many late ticks."""


@dataclass(frozen=True, slots=True)
class BareLoop:
    """Timing of the C loop, with which the device's loop is compared."""

    ticks: int
    late_ticks: int
    """Ticks whose work ended after the next was due, missed ones included."""
    latest_s: float
    """Largest delay of a tick's end after the time at which the tick was due (s)."""
    raised_priority: bool
    """Whether the system granted real-time priority."""


@dataclass(slots=True)
class BareRun:
    """A C loop that runs, or has run, at the same time as the device's loop. result: None until it has ended, or if it
    failed; why: the reason, if it failed."""

    result: BareLoop | None = None
    failure_reason: str = ""


@contextlib.contextmanager
def run_bare_loop_beside(seconds: float, rate_hz: float, raised_priority: bool) -> Iterator[BareRun]:
    """Run the C loop while the block is executed; after the block its end is awaited, and the result is available.

    seconds: its duration; rate_hz: its rate; raised_priority: whether real-time priority is requested. A missing
    compiler or a failed start raises nothing: `BareRun.why` says so.
    """
    run = BareRun()
    with tempfile.TemporaryDirectory() as folder:
        program = _compile(Path(folder), run)
        if program is None:
            yield run
            return
        words = [str(program), f"{seconds:g}", f"{rate_hz:g}", str(PRIORITY if raised_priority else 0)]
        try:
            process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
        except OSError as problem:
            run.failure_reason = f"it could not be started ({problem.strerror})"
            yield run
            return
        with process:
            try:
                yield run
                _read(process, seconds, run)
            finally:
                process.kill()


def _read(process: "subprocess.Popen[bytes]", seconds: float, run: BareRun) -> None:
    """Wait for the end of the C loop and read the four numbers that it prints."""
    try:
        output, _ = process.communicate(timeout=seconds + OVERTIME_S)
        ticks, late, latest_s, granted = output.split()
        run.result = BareLoop(int(ticks), int(late), float(latest_s), int(granted) > 0)
    except (subprocess.TimeoutExpired, ValueError):
        run.failure_reason = "it gave no result"


def compare_with_bare_loop(late_ticks: int, ticks: int, run: BareRun) -> DeviceFinding:
    """Compare the late ticks of the device's loop with those of the C loop. late_ticks, ticks: of the device's loop,
    missed ticks included. Too many late ticks are a warning, not an obstacle."""
    if run.result is None:
        return DeviceFinding(NAME, f"not compared: {run.failure_reason}", fine=True)
    reference = run.result
    max_late = _most_late(WORSE_BY * reference.late_ticks * ticks / max(reference.ticks, 1))
    fine = late_ticks <= max_late
    value = (
        f"{reference.late_ticks} of {reference.ticks} late "
        f"({reference.late_ticks / max(reference.ticks, 1):.2%}) at the same time, the latest by "
        f"{1000 * reference.latest_s:.1f} ms; this loop: {late_ticks} of {ticks} "
        f"({late_ticks / max(ticks, 1):.2%}), where up to {max_late} are fine ({WORSE_BY:g} times as many, and chance)"
    )
    return DeviceFinding(NAME, value, fine, "" if fine else ADVICE, warning=not fine)


def _most_late(expected: float) -> int:
    """Largest count n that is compatible with `expected` = r k, where r = WORSE_BY and k is a count too.

    n is the larger root of (n - r k)² = CHANCE² (n + r² k): the variance of a Poisson count is estimated by the count
    itself, and that of r k by r² k = r expected.
    """
    spread = math.sqrt((1.0 + WORSE_BY) * expected + CHANCE**2 / 4.0)
    return math.floor(expected + CHANCE**2 / 2.0 + CHANCE * spread)


def _compile(folder: Path, run: BareRun) -> Path | None:
    """Path of the compiled program; None, with the reason in `run.why`, if it could not be compiled."""
    compiler = _compiler()
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
            timeout=COMPILING_S,
        )
    except (OSError, subprocess.SubprocessError) as problem:
        run.failure_reason = f"it could not be compiled ({type(problem).__name__})"
        return None
    return program


def _compiler() -> list[str] | None:
    """Command of a C compiler; the Python package `ziglang` contains one."""
    compiler_path = next((path for name in COMPILERS if (path := shutil.which(name))), None)
    if compiler_path is not None:
        return [compiler_path]
    return [sys.executable, "-m", "ziglang", "cc"] if find_spec("ziglang") else None
