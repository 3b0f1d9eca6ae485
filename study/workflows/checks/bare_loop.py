"""A bare C loop, timed beside a device's loop: what this computer allows at best, under the same load.

Compiled anew each time, by the system's compiler or the one of the extra `compiler`; without a compiler or POSIX
clocks, the report says that nothing was compared.
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
"""The loop, compiled when it is measured."""
COMPILERS = ("cc", "gcc", "clang")
"""C compilers that are looked for, in this order."""
PRIORITY = 40
"""Real-time priority, as that of a device's loop."""

WORSE_BY = 1.5
"""Accepted ratio of the late ticks of the device's loop, which runs the safety layer, to those of a bare loop."""
CHANCE = 3.0
"""Standard errors of the two counts, as of independent events, within which a difference counts as chance."""

COMPILING_S = 120.0
"""Longest compilation of the C loop (s)."""
OVERTIME_S = 30.0
"""Longest delay of the C loop's end beyond its duration (s)."""
NAME = "Bare C loop"
"""Title of the finding."""
ADVICE = (
    "The computer can do better than this loop did: close other programs, measure again, and report it if it stays."
)


@dataclass(frozen=True, slots=True)
class BareLoop:
    """Result of a timed loop in C, with which the device's loop is compared."""

    ticks: int
    late_ticks: int
    """Ticks whose work ended after the next was due, missed ones included."""
    latest_s: float
    raised_priority: bool
    """Whether it got the real-time priority that was requested."""


@dataclass(slots=True)
class BareRun:
    """A bare loop that runs, or has run, beside the device's. result: None until the loop has ended; why: reason if
    there is none."""

    result: BareLoop | None = None
    why: str = ""


@contextlib.contextmanager
def run_bare_loop_beside(seconds: float, rate_hz: float, raised_priority: bool) -> Iterator[BareRun]:
    """Run a bare loop during the block or, where that is shorter, to its own end; the result is available after the
    block."""
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
            run.why = f"it could not be started ({problem.strerror})"
            yield run
            return
        with process:
            try:
                yield run
                _read(process, seconds, run)
            finally:
                process.kill()


def _read(process: "subprocess.Popen[bytes]", seconds: float, run: BareRun) -> None:
    try:
        output, _ = process.communicate(timeout=seconds + OVERTIME_S)
        ticks, late, latest_s, granted = output.split()
        run.result = BareLoop(int(ticks), int(late), float(latest_s), int(granted) > 0)
    except (subprocess.TimeoutExpired, ValueError):
        run.why = "it gave no result"


def judge_beside(late_ticks: int, ticks: int, run: BareRun) -> DeviceFinding:
    """Compare the late ticks of the device's loop with those of the bare loop. late_ticks: of the loop beside it,
    missed ones included."""
    if run.result is None:
        return DeviceFinding(NAME, f"not compared: {run.why}", fine=True)
    bare = run.result
    most = _most_late(WORSE_BY * bare.late_ticks * ticks / max(bare.ticks, 1))
    fine = late_ticks <= most
    value = (
        f"{bare.late_ticks} of {bare.ticks} late ({bare.late_ticks / max(bare.ticks, 1):.2%}) at the same time, the "
        f"latest by {1000 * bare.latest_s:.1f} ms; this loop: {late_ticks} of {ticks} "
        f"({late_ticks / max(ticks, 1):.2%}), where up to {most} are fine ({WORSE_BY:g} times as many, and chance)"
    )
    return DeviceFinding(NAME, value, fine, "" if fine else ADVICE, warning=not fine)


def _most_late(expected: float) -> int:
    """The largest count within CHANCE standard errors of `expected`, which is WORSE_BY times another count."""
    spread = math.sqrt((1.0 + WORSE_BY) * expected + CHANCE**2 / 4.0)
    return math.floor(expected + CHANCE**2 / 2.0 + CHANCE * spread)


def _compile(folder: Path, run: BareRun) -> Path | None:
    compiler = _compiler()
    if sys.platform == "win32" or compiler is None:
        run.why = "no C compiler is here (pip install '.[compiler]')" if compiler is None else "not on Windows"
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
        run.why = f"it could not be compiled ({type(problem).__name__})"
        return None
    return program


def _compiler() -> list[str] | None:
    found = next((path for name in COMPILERS if (path := shutil.which(name))), None)
    if found is not None:
        return [found]
    return [sys.executable, "-m", "ziglang", "cc"] if find_spec("ziglang") else None
