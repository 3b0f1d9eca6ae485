"""The mechanism simulator against the same recipe in plain numpy and scipy: 105 s at 1 kHz, three axes, 12 states."""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "contracts"))
import effect_bench

import equalizer.effects.simulation.simulator as simulator
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.simulation.simulator import simulate_mechanism, simulate_response
from equalizer.plant.linear_simulation import discretise_model

SAMPLES, RATE_HZ, REPEATS = 105_000, 1000.0, 7
PLAIN_SAMPLES = 10_000
"""Of the plain loop, whose time grows with them."""
NEEDED, AIMED_MS = {"nothing": 40.0, "quadratic_damping": 10.0}, {"nothing": 7.0, "quadratic_damping": 30.0}
"""Times faster than plainly. Aims, and no bars, for the time itself: others may use the processor's cache."""
FORCES = {
    "nothing": (),
    "quadratic_damping": ((0,), {"coefficient": 5.0}),
    "coulomb_friction": ((0,), {"level": 0.06}),
    "loose_joint": ((0,), {"gap": 1e-4, "stiffness": 1e3, "slip": 0.01}),
}


def plain(model, commands: np.ndarray) -> np.ndarray:
    """(n, p): state after state in numpy, the sensor's pole by scipy."""
    linear = discretise_model(model, 1 / RATE_HZ)
    state, before, out = np.zeros(len(linear.transition)), np.zeros(commands.shape[1]), []
    for u in commands:
        out.append(linear.response @ state + linear.response_by_command @ before)
        state, before = linear.transition @ state + linear.state_by_command @ u, u
    decay = np.exp(-2 * np.pi * model.sensor.bandwidth_hz / RATE_HZ)
    return lfilter([1 - decay], [1, -decay], out, axis=0)


def cpu_ms(action: Callable[[], object], repeats: int = REPEATS) -> float:
    """Of the quickest: the machine may be shared."""
    taken = []
    for _ in range(repeats):
        began = time.process_time()
        action()
        taken.append(time.process_time() - began)
    return min(taken) * 1e3


def report(line: str) -> None:
    sys.stdout.write(line + "\n")


def main() -> int:
    simulator.KEPT_BYTES = 0  # every repeat is simulated, none recalled
    model, some = effect_bench.three_axes(), effect_bench.commands(3)
    commands = np.tile(some, (SAMPLES // len(some) + 1, 1))[:SAMPLES]
    short = commands[:PLAIN_SAMPLES]
    off = np.abs(simulate_response(model, short, RATE_HZ).response - plain(model, short)).max()
    slow = cpu_ms(lambda: plain(model, short), 3) * SAMPLES / PLAIN_SAMPLES
    report(f"plain loop in numpy, without forces: {slow:.0f} ms; the responses differ by {off:.1e} m/s^2")
    good = bool(off < 1e-9)
    for name, force in FORCES.items():
        effects = [PlacedEffect(EFFECTS[name], *force)] if force else []
        taken = cpu_ms(lambda effects=effects: simulate_response(model, commands, RATE_HZ, effects))
        whole = cpu_ms(lambda effects=effects: simulate_mechanism(model, commands, RATE_HZ, effects), 3)
        aim, needed = AIMED_MS.get(name), NEEDED.get(name, 0.0)
        report(
            f"{name:18} {taken:6.1f} ms, {whole:6.1f} ms with the axes' motion; {slow / taken:5.0f} x the plain loop"
            + (f" (needed {needed:g}; aim {aim:g} ms)" if aim else "")
        )
        good &= slow / taken >= needed
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
