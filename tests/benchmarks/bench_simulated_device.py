"""How much faster than real time the simulated omega.3 runs, and than the same equations without compilation."""

import os
import subprocess
import sys
import time

import numpy as np
from numba import njit

from study.devices.rig import READING_SIZE
from study.devices.simulated.omega3 import build_omega3

PLAIN = os.environ.get("NUMBA_DISABLE_JIT") == "1"
TICKS = 300 if PLAIN else 100_000
RUNS = 3 if PLAIN else 9
ALLOWED_SPEED = 200.0


@njit
def block(sense, advance, state, parameters, noise, forces) -> None:
    reading = np.empty(READING_SIZE)
    for k in range(forces.shape[0]):
        sense(state, parameters, noise, reading)
        advance(state, parameters, forces[k])


def microseconds_per_tick() -> float:
    """CPU time of the quickest run: the others were disturbed."""
    rig = build_omega3(1, hand=True)
    forces = np.random.default_rng(0).normal(size=(TICKS, 3))
    block(rig.sense, rig.advance, rig.state, rig.parameters, rig.noise, forces[:10])
    taken = []
    for _ in range(RUNS):
        start = time.process_time()
        block(rig.sense, rig.advance, rig.state, rig.parameters, rig.noise, forces)
        taken.append(time.process_time() - start)
    return min(taken) / TICKS * 1e6


def plain_python() -> float:
    plain = subprocess.run(
        [sys.executable, "-W", "ignore", __file__],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    return float(plain.stdout)


def main() -> int:
    ours = microseconds_per_tick()
    if PLAIN:
        sys.stdout.write(f"{ours}\n")
        return 0
    plain, speed = plain_python(), 1000 / ours
    sys.stdout.write(
        f"simulated omega.3, reading and millisecond of motion: {ours:.2f} us a tick, {speed:.0f} times real time "
        f"(at least {ALLOWED_SPEED:.0f} wanted)\n"
        f"the same equations in plain Python: {plain:.0f} us a tick; compiled is {plain / ours:.0f} times faster\n"
    )
    return 0 if speed >= ALLOWED_SPEED else 1


if __name__ == "__main__":
    sys.exit(main())
