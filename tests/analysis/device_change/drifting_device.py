"""A device of its own in plain steps of time, in a hand, whose friction, grip, gain or delay changes in mid-session.

It shares no code with what is tested: masses that hang on masses, friction with a bristle, commands that wait, encoders
that round, an accelerometer with noise.
"""

from dataclasses import dataclass, replace

import numpy as np

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
    draw = np.random.default_rng(seed)
    each = {name: np.array([getattr(t, name) for t in truths], float)[:, None] for name in vars(Truth())}
    shape, dt = (len(truths), 3), 1.0 / RATE_HZ / SUBSTEPS
    x, v, bristle = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    modes = [[np.zeros(shape), np.zeros(shape)] for _ in MODES]
    n, levels = len(wave_n), np.asarray(levels_n)[:, None]
    waiting = [np.zeros(shape)] * 10
    felt = np.zeros(shape)
    rows = {"command": [], "excitation": [], "position": [], "acceleration": []}
    for tick in range(PERIODS * n):
        read = ROUNDING_M * np.round(x / ROUNDING_M)
        excitation = levels * wave_n[tick % n] * min(1.0, tick / 250)
        command = excitation - SPRING_N_PER_M * read
        waiting = [command, *waiting[:-1]]
        late = np.choose(each["delay_ticks"].astype(int), waiting[:4])
        for _ in range(SUBSTEPS):
            force = each["gain"] * late - (DAMPING + each["hand_n_s_per_m"]) * v - each["hand_n_per_m"] * x
            bristle = np.clip(bristle + v * dt / BRISTLE_M * (1 - np.sign(v) * bristle), -1, 1)
            force = force - each["friction_n"] * bristle
            for (kg, hz, ratio), mode in zip(MODES, modes, strict=True):
                w = 2 * np.pi * hz
                pull = kg * (w**2 * (mode[0] - x) + 2 * ratio * w * (mode[1] - v))
                force = force + pull
                mode[1] = mode[1] - pull / kg * dt
                mode[0] = mode[0] + mode[1] * dt
            a = force / (MASS_KG + each["hand_kg"])
            v = v + a * dt
            x = x + v * dt
        if tick >= (PERIODS - 1) * n:
            for name, row in zip(rows, (command, excitation, read, felt), strict=True):
                rows[name].append(row)
        felt = a + draw.normal(size=shape) * NOISE_MPS2
    return [_recording({name: np.array(found)[:, probe] for name, found in rows.items()}) for probe in range(shape[0])]


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
