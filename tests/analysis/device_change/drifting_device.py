"""A device of its own in plain steps of time, in a hand, whose friction, grip, gain or delay changes in mid-session.

It shares no code with what is tested: masses that hang on masses, friction with a bristle, commands that wait, encoders
that round, an accelerometer with noise.
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ, SUBSTEPS = 1000, 10
PERIODS = 3
"""Two to settle, one to keep."""


@dataclass(frozen=True)
class Truth:
    friction_n: float = 0.12
    hand_kg: float = 0.09
    hand_n_s_per_m: float = 4.0
    hand_n_per_m: float = 120.0
    gain: float = 1.0
    delay_ticks: int = 0


MASS_KG, DAMPING, SPRING_N_PER_M = 0.2, 8.0, 110.0
MODES = ((0.03, 11.0, 0.05), (0.05, 24.0, 0.05))
"""Mass, frequency, damping ratio of what hangs on the handle."""
BRISTLE_M = 1.5e-5
ROUNDING_M, NOISE_MPS2 = 8.8e-6, (0.04, 0.04, 0.07)


def play(wave_n, truths: list[Truth], levels_n, seed: int) -> list[Recording]:
    """One kept period for each probe. wave_n (n, 3); truths, levels_n: of each probe."""
    each = np.array([list(vars(truth).values()) for truth in truths], float)
    noise = np.random.default_rng(seed).normal(size=(PERIODS * len(wave_n), len(truths), 3)) * NOISE_MPS2
    levels = np.asarray(levels_n, float)
    rows = _move(np.asarray(wave_n, float), each, levels, noise, np.reshape(MODES, (-1, 3)).astype(float), BRISTLE_M)
    names = ("command", "excitation", "position", "acceleration")
    return [_recording(dict(zip(names, rows[:, :, probe], strict=True))) for probe in range(len(truths))]


@njit(cache=True)
def _move(wave_n, truths, levels, noise, hung, bristle_m):
    """(4, n, probes, 3): command, excitation, position and acceleration as they are read."""
    n, shape, dt = len(wave_n), (len(truths), 3), 1.0 / RATE_HZ / SUBSTEPS
    rows = np.zeros((4, n, *shape))
    for probe in range(shape[0]):
        friction_n, hand_kg, hand_n_s_per_m, hand_n_per_m, gain, delay_ticks = truths[probe]
        for axis in range(3):
            x, v, bristle, felt = 0.0, 0.0, 0.0, 0.0
            modes, waiting = np.zeros((len(hung), 2)), np.zeros(11)
            for tick in range(PERIODS * n):
                read = ROUNDING_M * np.round(x / ROUNDING_M)
                excitation = levels[probe] * wave_n[tick % n, axis] * min(1.0, tick / 250)
                command = excitation - SPRING_N_PER_M * read
                waiting[1:] = waiting[:-1].copy()
                waiting[0] = command
                a = 0.0
                for _ in range(SUBSTEPS):
                    force = gain * waiting[int(delay_ticks)] - (DAMPING + hand_n_s_per_m) * v - hand_n_per_m * x
                    bristle = min(max(bristle + v * dt / bristle_m * (1 - np.sign(v) * bristle), -1.0), 1.0)
                    force -= friction_n * bristle
                    for mode, (kg, hz, ratio) in zip(modes, hung):  # noqa: B905 - numba knows no `strict`
                        w = 2 * np.pi * hz
                        pull = kg * (w**2 * (mode[0] - x) + 2 * ratio * w * (mode[1] - v))
                        force += pull
                        mode[1] -= pull / kg * dt
                        mode[0] += mode[1] * dt
                    a = force / (MASS_KG + hand_kg)
                    v += a * dt
                    x += v * dt
                kept = tick - (PERIODS - 1) * n
                if kept >= 0:
                    rows[:, kept, probe, axis] = command, excitation, read, felt
                felt = a + noise[tick, probe, axis]
    return rows


def _recording(rows) -> Recording:
    force = ("force", "N", ("fx", "fy", "fz"))
    return Recording(
        device="of its own",
        command=Signal(rows["command"], RATE_HZ, *force),
        excitation=Signal(rows["excitation"], RATE_HZ, *force),
        response=Signal(rows["acceleration"], RATE_HZ, "acceleration", "m/s^2", ("ax", "ay", "az")),
        position=Signal(rows["position"], RATE_HZ, "position", "m", ("x", "y", "z")),
    )


def make_truth(**changes) -> Truth:
    return replace(Truth(), **changes)
