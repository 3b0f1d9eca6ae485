"""The forms of the tracker against each other: 0.5 s at 1 kHz, three axes, order 26; growth; what a tick costs."""

import ctypes
import importlib.util
import sys
import time
import timeit
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numba import njit

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.tracking.lqr import lqr_kernel
from equalizer.tracking.lqr.changing_direction import TurningTransient, make_rotatable_transient
from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.riccati import compute_backward_gains
from equalizer.tracking.lqr.rotation import compute_normal_basis, compute_rotation_basis
from equalizer.tracking.lqr.tracking_problem import TrackingProblem, TrackingWeights, make_tracking_problem

_DENSE = Path(__file__).parents[1] / "equalizer" / "tracking" / "lqr" / "dense_least_squares.py"
_spec = importlib.util.spec_from_file_location(_DENSE.stem, _DENSE)
dense_least_squares = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(dense_least_squares)

ORDER, SAMPLES = 26, 500
NEEDED = {"stored gains": (10.0, 100.0), "rotation basis": (500.0, 5000.0)}
"""Times faster than the compiled, and than the plain recursion."""
ALLOWED_TICK_US = 1.0
TICKS = 60_000
"""A minute at 1 kHz."""

_clock = ctypes.CDLL(None).clock_gettime
_clock.argtypes = [ctypes.c_int, ctypes.c_void_p]
MONOTONIC = time.CLOCK_MONOTONIC


def problem_of(order: int) -> TrackingProblem:
    draw = np.random.default_rng(order).standard_normal
    A = draw((order, order))
    A *= 0.97 / np.abs(np.linalg.eigvals(A)).max()
    names = ("fx", "fy", "fz"), ("ax", "ay", "az")
    model = IdentifiedModel(
        A, draw((order, 3)), draw((3, order)), draw((3, 3)), 1000.0, (5.0, 35.0), "N", "m/s^2", *names
    )
    return make_tracking_problem(model, TrackingWeights())


def plain(problem: TrackingProblem, wanted: np.ndarray) -> np.ndarray:
    """The recipe, written in numpy: gains backward, costate backward, model forward; every trajectory anew."""
    gains = compute_backward_gains(problem, len(wanted))
    A, B, C, D, Q = problem.A, problem.B, problem.C, problem.D, problem.Q
    g, v, x = np.empty((len(wanted), 3)), np.zeros(problem.order), np.zeros(problem.order)
    for k in range(len(wanted) - 1, -1, -1):
        t = B.T @ v + D.T @ Q @ wanted[k]
        g[k] = gains.H_inverse[k] @ t
        v = A.T @ v + C.T @ Q @ wanted[k] - gains.K[k].T @ t
    for k in range(len(wanted)):
        g[k] -= gains.K[k] @ x
        x = A @ x + B @ g[k]
    return g


def seconds(action: Callable[[], object], times: int) -> float:
    """Per call, of the quickest batch: the others were disturbed."""
    return min(timeit.repeat(action, number=max(1, times // 50), repeat=min(times, 50))) / max(1, times // 50)


def forms(order: int, samples: int, dense: bool) -> dict[str, tuple[Callable[[], np.ndarray], int]]:
    """Each with how often it is timed. All give the forces for one trajectory."""
    problem, wanted = problem_of(order), np.random.default_rng(0).standard_normal((samples, 3))
    gains, axes = compute_stored_gains(problem, samples), np.eye(3)
    nine, three = compute_rotation_basis(gains, wanted), compute_normal_basis(gains, wanted[:, 0])
    every: dict[str, tuple[Callable[[], np.ndarray], int]] = {
        "plain numpy recursion": (lambda: plain(problem, wanted), max(2, 7500 // samples)),
        "compiled recursion": (lambda: track(compute_stored_gains(problem, samples), wanted).forces, 20),
        "stored gains": (lambda: track(gains, wanted).forces, 100),
        "rotation basis": (lambda: nine.compute_forces(axes), 10_000),
        "basis of a normal": (lambda: three.compute_forces(axes[0]), 10_000),
    }
    if dense:
        every["dense least squares"] = (lambda: dense_least_squares.least_squares_forces(problem, wanted), 1)
    return every


def timed(order: int, samples: int, dense: bool = False) -> dict[str, float]:
    return {name: seconds(action, times) for name, (action, times) in forms(order, samples, dense).items()}


def compare() -> bool:
    taken = timed(ORDER, SAMPLES, dense=True)
    slow, compiled = taken["plain numpy recursion"], taken["compiled recursion"]
    for name, s in taken.items():
        report(f"{name:22} {s * 1e6:10.1f} us {compiled / s:10.3g} x compiled {slow / s:10.3g} x numpy")
    reached = True
    for name, (over_compiled, over_plain) in NEEDED.items():
        found = compiled / taken[name], slow / taken[name]
        reached &= found[0] >= over_compiled and found[1] >= over_plain
        report(f"{name}: {found[0]:.0f} (needed {over_compiled:.0f}) and {found[1]:.0f} (needed {over_plain:.0f})")
    return reached


def grow() -> None:
    for order, samples in ((26, 100), (26, 500), (26, 2000), (26, 10_000), (14, 500), (40, 500)):
        line = ", ".join(f"{name} {s * 1e6:.3g}" for name, s in timed(order, samples).items())
        report(f"order {order}, {samples / 1000:g} s [us]: {line}")


@njit
def time_ticks(step, K, g, directions, live, taken, before, after) -> None:
    """Each tick by itself; the transient starts anew at its end. taken: ns."""
    for row in range(taken.size):
        _clock(MONOTONIC, before.ctypes)
        lqr_kernel.simulate_tick(step, K, g, directions[row % directions.shape[0]], row % K.shape[0], live)
        _clock(MONOTONIC, after.ctypes)
        taken[row] = (after[0] - before[0]) * 1_000_000_000 + after[1] - before[1]


def tick_times_ns(transient: TurningTransient) -> np.ndarray:
    """(TICKS,): the clock's own cost, some 20 ns, is left in."""
    rotations = np.array([np.linalg.qr(np.random.default_rng(k).standard_normal((3, 3)))[0].ravel() for k in range(64)])
    taken, live = np.zeros(TICKS, dtype=np.int64), np.zeros(2 * transient.problem.order + 6)
    clocks = np.zeros(2, dtype=np.int64), np.zeros(2, dtype=np.int64)
    for _ in range(2):
        live[:] = 0
        time_ticks(transient.problem.step, transient.K, transient.g, rotations, live, taken, *clocks)
    return taken


def ticks() -> bool:
    problem = problem_of(ORDER)
    gains = compute_stored_gains(problem, SAMPLES)
    taken = tick_times_ns(make_rotatable_transient(gains, np.random.default_rng(0).standard_normal((SAMPLES, 3)))) / 1e3
    shares = ", ".join(f"{share:g} % {np.percentile(taken, share):.3f}" for share in (50, 90, 99, 99.9, 99.99))
    over = int((taken > ALLOWED_TICK_US).sum())
    report(f"a tick whose direction turns, {TICKS} in a row [us]: {shares}, worst {taken.max():.3f}")
    report(f"above {ALLOWED_TICK_US:g} us: {over} of {TICKS} (an interrupted process among them)")
    return float(np.percentile(taken, 99.9)) <= ALLOWED_TICK_US


def report(line: str) -> None:
    sys.stdout.write(line + "\n")


def main() -> int:
    reached = [compare(), ticks()]
    grow()
    return int(not all(reached))


if __name__ == "__main__":
    sys.exit(main())
