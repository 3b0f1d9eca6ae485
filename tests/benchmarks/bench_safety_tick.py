"""What the safety layer costs per tick, against the same loop without it; how much faster than real time it runs."""

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numba import njit

from study.devices.clock import VirtualClock
from study.devices.drive.runner import PUBLISH_POINTER, run_block
from study.devices.governor import govern
from study.devices.governor.governor import Governor
from study.devices.opening import open_device
from study.devices.rig import READING_SIZE, CompiledRig
from study.devices.safe import SafeDevice

sys.path.insert(0, str(Path(__file__).parents[1]))
import rigs

TICKS = 200_000
ALLOWED_NS = 300.0
ALLOWED_SPEED = 200.0


@njit(govern.TICK_SIGNATURE)
def ungoverned(state, settings, loop, buffer, reading, force) -> bool:
    return False


def best_of(times: int, action: Callable[[], None]) -> float:
    """Seconds of the quickest: the others were disturbed."""
    taken = []
    for _ in range(times):
        start = time.perf_counter()
        action()
        taken.append(time.perf_counter() - start)
    return min(taken)


def ns_per_tick(rig: CompiledRig, tick) -> float:
    limits = replace(rigs.LIMITS, longest_hold_s=600.0, watchdog_s=5.0)
    governor = Governor(rig.info, replace(rigs.SETTINGS, limits=limits))
    governor.begin_hold(rigs.sine(2.0))
    arrays = (governor.state, governor.settings, governor.loop, governor.buffer, governor.force, governor.ring)

    def run() -> None:
        governor.state[govern.TICK] = governor.state[govern.LAST_KEEP_ALIVE_TICK] = 0.0
        governor.settings[govern.WATCHDOG_TICKS] = np.inf
        run_block(
            rig.sense,
            tick,
            rig.advance,
            PUBLISH_POINTER,
            (rig.state, rig.parameters, rig.noise, np.zeros(READING_SIZE)),
            arrays,
            TICKS,
        )

    return best_of(7, run) / TICKS * 1e9


def speed(device, clock: VirtualClock, seconds: float) -> float:
    def trial() -> None:
        device.hold(rigs.sine(2.0))
        for _ in range(round(seconds / 0.1)):
            clock.sleep(0.1)
            device.keep_alive()
        device.release()

    return seconds / best_of(5, trial)


def report(line: str) -> None:
    sys.stdout.write(line + "\n")


def main() -> int:
    bare, governed = ns_per_tick(rigs.compiled_rig(), ungoverned), ns_per_tick(rigs.compiled_rig(), govern.tick)
    report(f"safety layer and recording: {governed - bare:.0f} ns per tick (mass {bare:.0f}, allowed {ALLOWED_NS:.0f})")
    clock = VirtualClock()
    omega = open_device("simulated", replace(rigs.SETTINGS, hand_on_handle=True), clock, seed=1)
    fast = speed(omega, clock, 10.0)
    report(f"simulated omega.3 behind it: {fast:.0f} x real time (needed {ALLOWED_SPEED:.0f})")
    stepped = speed(SafeDevice(rigs.ScriptedRig(), rigs.SETTINGS, clock), clock, 2.0)
    report(f"a mass stepped from Python: {stepped:.0f} x real time")
    return int(governed - bare > ALLOWED_NS or fast < ALLOWED_SPEED)


if __name__ == "__main__":
    sys.exit(main())
