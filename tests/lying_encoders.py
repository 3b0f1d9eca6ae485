"""A handle with or without a hand, encoders that lie about it in ten ways, and ticks that come late: one hold each."""

import math
from dataclasses import dataclass, replace

import force_judge
import numpy as np
import rigs
from numba import njit, types

from equalizer.signals.signal import FloatArray
from study.devices.device import DeviceSettings, Fault
from study.devices.drive.runner import _TICK_TYPE
from study.devices.governor import cells
from study.devices.governor.govern import MATRIX_TYPE, VECTOR_TYPE
from study.devices.governor.governor import Governor
from study.devices.rig import READING_SIZE
from study.session.stimulus.held_stimulus import HeldStimulus

LIES = (
    "none", "jump", "oscillation", "freeze", "drift", "swapped axes", "sign", "noise", "quantisation", "delay", "nan",
)  # fmt: skip
PLAIN = frozenset({"none", "quantisation", "faint noise"})
"""Nothing of what an honest encoder does."""

DEVICE_KG, DEVICE_N_S_PER_M = 0.3, 8.0
STOP_M, STOP_N_PER_M = 0.075, 2500.0
DELAY_TICKS = 60


@dataclass(frozen=True, eq=False)
class Hold:
    """All that happens in one hold. Arrays have a row per tick."""

    lie: str
    settings: DeviceSettings
    stimulus: HeldStimulus
    hand: FloatArray
    """Its mass, damping, stiffness, and where it rests: (6,)"""
    matrix: FloatArray
    """(3, 3): what the encoders make of the position once they lie."""
    offsets_m: FloatArray
    """(n, 3), added to that."""
    lies_from: int
    frozen: bool
    delay: int
    late: FloatArray
    silent_from: int
    release_at: int
    told_by: int
    garbage: FloatArray
    """(k, 3) of tick, cell, value: written into the safety layer's own state."""


@njit(error_model="numpy")
def _sense(k, hold, matrix, offsets, world, log, reading) -> None:
    lying = k >= hold[0]
    back = max(k - int(hold[2]), 0) if lying else k
    for i in range(3):
        reading[i] = offsets[k, i]
        for j in range(3):
            true = world[j] if back == k else log[back, 6 + j]
            reading[i] += true * (matrix[i, j] if lying else (1.0 if i == j else 0.0))
        if lying and hold[1] != 0.0 and k > 0:
            reading[i] = log[k - 1, 3 + i]


@njit(error_model="numpy")
def _move(hold, force, world) -> None:
    radius = math.sqrt(world[0] ** 2 + world[1] ** 2 + world[2] ** 2)
    stop = STOP_N_PER_M * (1.0 - STOP_M / radius) if radius > STOP_M else 0.0
    for i in range(3):
        held = hold[8] * (world[i] - hold[9 + i])
        push = force[i] - (DEVICE_N_S_PER_M + hold[7]) * world[3 + i] - held - stop * world[i]
        world[3 + i] += hold[5] * push / (DEVICE_KG + hold[6])
        world[i] += hold[5] * world[3 + i]


@njit(error_model="numpy")
def _disturb(k, hold, garbage, state) -> None:
    for row in range(len(garbage)):
        if int(garbage[row, 0]) == k:
            state[int(garbage[row, 1])] = garbage[row, 2]
    if k < hold[3]:
        state[cells.KEEP_ALIVE] = 1.0
    if k >= hold[4]:
        state[cells.RELEASE_REQUEST] = 1.0


def _play(tick, state, settings, loop, buffer, force, hold, matrix, offsets, late, garbage, world, log) -> int:
    """How many ticks there were. hold: lies_from, frozen, delay, silent_from, release_at, tick length, then the hand;
    world (6,): position and speed; log (n, 9): force, reading, position."""
    reading = np.zeros(READING_SIZE)
    n, over = len(log), False
    for k in range(n):
        _disturb(k, hold, garbage, state)
        if late[k] != 0.0:
            state[cells.TICK] += 1.0
            state[cells.TICKS] += 1.0
            state[cells.MISSED] += 1.0
        else:
            _sense(k, hold, matrix, offsets, world, log, reading)
            over = tick(state, settings, loop, buffer, reading, force)
        for i in range(3):
            log[k, i], log[k, 3 + i], log[k, 6 + i] = force[i], reading[i], world[i]
        _move(hold, force, world)
        if over:
            return k + 1
    return n


_ARRAYS = (
    VECTOR_TYPE,
    VECTOR_TYPE,
    MATRIX_TYPE,
    MATRIX_TYPE,
    VECTOR_TYPE,
    VECTOR_TYPE,
    MATRIX_TYPE,
    MATRIX_TYPE,
    VECTOR_TYPE,
    MATRIX_TYPE,
    VECTOR_TYPE,
    MATRIX_TYPE,
)
_compiled = njit(types.int64(types.FunctionType(_TICK_TYPE.signature), *_ARRAYS), error_model="numpy")(_play)


def draw(rng: np.random.Generator, lie: str, ticks: int) -> Hold:
    frequency, amplitude = float(rng.choice([5, 10, 20, 25, 40, 50])), float(rng.uniform(0.0, 3.0))
    period = round(rigs.RATE_HZ / frequency)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    wave = np.sin(2 * np.pi * np.arange(period) / period)[:, None] * direction * amplitude
    fades = (float(rng.choice([0.05, 0.1, 0.3])), float(rng.choice([0.05, 0.1, 0.3])))
    stimulus = HeldStimulus(rigs.force(wave), *fades, str(rng.choice(["raised_cosine", "linear"])))
    spring = rng.random() < 0.7
    limits = replace(rigs.LIMITS, slew_n_per_s=1500.0, longest_hold_s=60.0, release_s=float(rng.uniform(0.005, 0.1)))
    settings = replace(
        rigs.SETTINGS,
        limits=limits,
        spring_frequency_hz=3.5 if spring else 0.0,
        spring_damping_n_s_per_m=float(rng.choice([0.0, 2.0, 20.0])) if spring else 0.0,
    )
    held = rng.random() < 0.6
    hand = [0.09, 4.0, 120.0, *rng.normal(scale=0.004, size=3)] if held else [0.0] * 6
    late = _late(rng, ticks)
    late[0] = 0.0
    hold = Hold(
        lie, settings, stimulus, np.array(hand), np.eye(3), np.zeros((ticks, 3)), ticks, False, 0, late,
        silent_from=int(rng.integers(ticks)) if rng.random() < 0.2 else force_judge.NEVER,
        release_at=int(rng.integers(ticks)) if rng.random() < 0.5 else force_judge.NEVER,
        told_by=force_judge.NEVER, garbage=np.zeros((0, 3)),
    )  # fmt: skip
    return _with_lie(rng, hold, lie, amplitude, period)


def _late(rng: np.random.Generator, ticks: int) -> FloatArray:
    late = (rng.random(ticks) < rng.choice([0.0, 0.0, 0.02, 0.3])).astype(float)
    for _ in range(rng.choice([0, 0, 1, 3])):
        start = int(rng.integers(ticks))
        late[start : start + int(rng.integers(1, 91))] = 1.0
    # A loop that does not turn for longer is let go by the drive.
    awake = np.flatnonzero(late == 0.0)
    for gap_end in awake[1:][np.diff(awake) > 91]:
        late[gap_end - 45] = 0.0
    return late


def _with_lie(rng: np.random.Generator, hold: Hold, lie: str, amplitude_n: float, period: int) -> Hold:
    """Where a lie must be told (and not only be harmless), `told_by` says by when."""
    ticks = len(hold.late)
    at = int(rng.integers(ticks // 10, ticks // 2))
    release = round(hold.settings.limits.release_s * rigs.RATE_HZ)
    if lie in ("none", "faint noise"):
        return replace(hold, offsets_m=rng.normal(scale=2e-5, size=(ticks, 3))) if lie == "faint noise" else hold
    lying = replace(hold, lies_from=at)
    changes = {
        "freeze": {"frozen": True},
        "swapped axes": {"matrix": np.eye(3)[rng.permutation(3)]},
        "sign": {"matrix": -np.eye(3)},
        "delay": {"delay": int(rng.integers(1, DELAY_TICKS))},
    }
    if lie in changes:
        lying = replace(lying, **changes[lie])
        loud = lie == "freeze" and amplitude_n > 1.2 and period >= 40 and hold.release_at == force_judge.NEVER
        return replace(lying, told_by=max(at, 300) + 100 + 2 * period + 150 + release) if loud else lying
    offsets, told_after = OFFSETS[lie](rng, np.maximum(np.arange(ticks) - at, 0)[:, None], hold.late.any())
    offsets = np.ascontiguousarray(offsets * (np.arange(ticks) >= at)[:, None])
    return replace(lying, offsets_m=offsets, told_by=min(at + told_after + release, force_judge.NEVER))


def _direction(rng: np.random.Generator) -> FloatArray:
    direction = rng.normal(size=3)
    return direction / np.linalg.norm(direction)


def _jump(rng: np.random.Generator, since: FloatArray, late: bool) -> tuple[FloatArray, int]:
    """With 91 ticks of lateness a handle may have gone 0.05 m."""
    size = float(10 ** rng.uniform(-4, -0.35))
    return np.ones(since.shape) * _direction(rng) * size, 2 if size > 0.06 else force_judge.NEVER


def _oscillation(rng: np.random.Generator, since: FloatArray, late: bool) -> tuple[FloatArray, int]:
    size, hz = float(10 ** rng.uniform(-4, -0.4)), float(rng.uniform(1, 400))
    turns = 2 * np.pi * hz / rigs.RATE_HZ
    told = not late and turns * size > 0.005 and hz < 200
    return np.sin(turns * since) * _direction(rng) * size, round(rigs.RATE_HZ / hz) + 3 if told else force_judge.NEVER


def _drift(rng: np.random.Generator, since: FloatArray, late: bool) -> tuple[FloatArray, int]:
    return since * rng.uniform(0.001, 1.0) / rigs.RATE_HZ * _direction(rng), force_judge.NEVER


def _noise(rng: np.random.Generator, since: FloatArray, late: bool) -> tuple[FloatArray, int]:
    size = float(10 ** rng.uniform(-6, -2))
    told = size > 0.001 and not late
    return rng.normal(scale=size, size=(len(since), 3)), 150 if told else force_judge.NEVER


def _quantisation(rng: np.random.Generator, since: FloatArray, late: bool) -> tuple[FloatArray, int]:
    """As of an encoder with so coarse steps, of which the handle's way knows nothing."""
    return rng.uniform(-1, 1, size=(len(since), 3)) * 10 ** rng.uniform(-6, -4.5), force_judge.NEVER


def _nan(rng: np.random.Generator, since: FloatArray, late: bool) -> tuple[FloatArray, int]:
    offsets, bad = np.zeros((len(since), 3)), int(rng.integers(1, 50))
    offsets[since[:, 0] == bad, rng.integers(3)] = rng.choice([np.nan, np.inf, -1e300])
    return offsets, bad + 1 if not late else force_judge.NEVER


OFFSETS = {
    "jump": _jump,
    "oscillation": _oscillation,
    "drift": _drift,
    "noise": _noise,
    "quantisation": _quantisation,
    "nan": _nan,
}


@dataclass(frozen=True, eq=False)
class Played:
    found: list[str]
    ticks: int
    fault: Fault
    forces_n: FloatArray


def play(hold: Hold, tick=None) -> Played:
    """`tick`: of `study.devices.governor.govern`, compiled, or a plain function in its place."""
    from study.devices.governor import govern

    governor = Governor(rigs.INFO, hold.settings)
    governor.begin_hold(hold.stimulus)
    log = np.zeros((len(hold.late), 9))
    told = [hold.lies_from, hold.frozen, hold.delay, hold.silent_from, hold.release_at, 1 / rigs.RATE_HZ, *hold.hand]
    world = np.zeros(6)
    world[:3] = hold.hand[3:]
    run = _compiled if tick is None else _play
    n = run(
        tick or govern.tick, governor.state, governor.settings, governor.loop, governor.buffer, governor.force,
        np.array(told, dtype=float), np.ascontiguousarray(hold.matrix), hold.offsets_m, hold.late, hold.garbage,
        world, log,
    )  # fmt: skip
    judged = force_judge.Run(
        stimulus=hold.stimulus, settings=hold.settings, stiffness=governor.settings[cells.STIFFNESS],
        rate_hz=rigs.RATE_HZ, forces_n=log[:n, :3], readings_m=log[:n, 3:6], late=hold.late[:n] != 0.0,
        over=not governor.moving, release_at=hold.release_at, silent_from=hold.silent_from, told_by=hold.told_by,
        corrupted=len(hold.garbage) > 0,
    )  # fmt: skip
    found = force_judge.violations_of(judged)
    return Played([f"{violation} ({hold.lie})" for violation in found], n, governor.fault, log[:n, :3])
