"""Bare rigs that write down every force they are given, for tests of the safety layer."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray, Signal
from study.devices.device import DeviceInfo, DeviceSettings
from study.devices.rig import READING_SIZE, CompiledRig
from study.session.stimulus.held_stimulus import HeldStimulus
from study.session.stimulus.limits import Limits

RATE_HZ = 1000.0
MASS_KG = 0.3
LEAN = 9
"""Where the state holds how far the handle is leant away, m."""
WRITES = 12
LOG = 13

INFO = DeviceInfo(name="mass", simulated=True, sample_rate_hz=RATE_HZ, max_force_n=12.0, effective_mass_kg=MASS_KG)
LIMITS = Limits(
    stimulus_cap_n=3.0, total_cap_n=4.5, slew_n_per_s=1500.0, longest_hold_s=20.0, watchdog_s=0.3, release_s=0.05
)
SETTINGS = DeviceSettings(
    limits=LIMITS, spring_frequency_hz=3.5, spring_damping_n_s_per_m=0.5, keep_s=0.5, hand_on_handle=True
)


@njit(cache=True)
def _sense(state, parameters, noise, reading) -> None:
    for i in range(3):
        reading[i] = state[i] + state[LEAN + i]
        reading[3 + i] = reading[6 + i] = state[6 + i]
    reading[9] = 1.0 if abs(state[6]) > parameters[2] else 0.0


@njit(cache=True)
def _advance(state, parameters, force_n) -> None:
    row = LOG + 3 * int(state[WRITES])
    state[WRITES] += 1
    for i in range(3):
        if row + i < state.size:
            state[row + i] = force_n[i]
        state[6 + i] = (force_n[i] - parameters[1] * state[3 + i]) / parameters[0]
        state[3 + i] += 0.001 * state[6 + i]
        state[i] += 0.001 * state[3 + i]


def compiled_rig(capacity: int = 60_000, pressed: Iterable[int] = ()) -> CompiledRig:
    """A free mass with a damper, from rest. Remembers `capacity` writes. `pressed` is asked anew each time."""
    return CompiledRig(
        info=INFO,
        state=np.zeros(LOG + 3 * capacity),
        parameters=np.array([MASS_KG, 2.0, 1e3]),
        noise=np.zeros(1, dtype=np.uint64),
        sense=_sense,
        advance=_advance,
        buttons=lambda: frozenset(pressed),
    )


def written(rig: CompiledRig) -> FloatArray:
    """Every force the rig was given, (n, 3)."""
    return rig.state[LOG : LOG + 3 * int(rig.state[WRITES])].reshape(-1, 3).copy()


class ScriptedRig:
    """The same mass, stepped from Python. It can be told to answer nonsense, to fail and to be slow."""

    def __init__(self, pressed: Iterable[int] = ()) -> None:
        self.drops_force_after_s = 0.1
        self.pressed = pressed
        self.mass = compiled_rig()
        self.closed = False
        self.instead_of_sensing: Callable[[], FloatArray] | None = None
        self.instead_of_writing: Callable[[], None] | None = None

    @property
    def info(self) -> DeviceInfo:
        return replace(INFO, simulated=False)

    def sense(self) -> FloatArray:
        if self.instead_of_sensing is not None:
            return self.instead_of_sensing()
        reading = np.zeros(READING_SIZE)
        _sense(self.mass.state, self.mass.parameters, self.mass.noise, reading)
        return reading

    def buttons(self) -> frozenset[int]:
        return frozenset(self.pressed)

    def write(self, force_n: FloatArray) -> None:
        if self.instead_of_writing is not None:
            self.instead_of_writing()
        _advance(self.mass.state, self.mass.parameters, force_n)

    def close(self) -> None:
        self.closed = True


class HeldForceRig:
    """Like hardware it keeps the last force it was given. Its driver can be made to hang and to fail. A hand holds it
    that trembles along y and z by the encoders' resolution: one that stood still under such forces would be stale."""

    def __init__(self) -> None:
        self.drops_force_after_s = 0.1
        self.last_n = np.zeros(3)
        self.sense_calls = 0
        self.written_n: list[FloatArray] = []
        self.closed = 0
        self.before_sensing: Callable[[], None] | None = None
        self.before_writing: Callable[[FloatArray], None] | None = None
        self.trembling_axes = [1, 2]

    @property
    def info(self) -> DeviceInfo:
        return replace(INFO, simulated=False)

    def sense(self) -> FloatArray:
        if self.before_sensing is not None:
            self.before_sensing()
        self.sense_calls += 1
        reading = np.zeros(READING_SIZE)
        reading[self.trembling_axes] = 1e-5 * (self.sense_calls % 2)
        return reading

    def buttons(self) -> frozenset[int]:
        return frozenset()

    def write(self, force_n: FloatArray) -> None:
        if self.before_writing is not None:
            self.before_writing(force_n)
        self.last_n = force_n.copy()
        self.written_n.append(self.last_n)

    def close(self) -> None:
        self.closed += 1


def push(force_n: float = 2.9) -> HeldStimulus:
    """A constant force along x."""
    return HeldStimulus(force(np.tile([[force_n, 0.0, 0.0]], (50, 1))), 0.05, 0.05, "linear")


def sine(amplitude_n: float = 1.0, periods_per_s: int = 5, fade_s: float = 0.1) -> HeldStimulus:
    samples = round(RATE_HZ) // periods_per_s
    phase = 2 * np.pi * np.arange(samples) / samples
    return HeldStimulus(force(amplitude_n * np.sin(phase)[:, None] * [0.0, 0.6, 0.8]), fade_s, fade_s, "raised_cosine")


def force(samples: FloatArray) -> Signal:
    return Signal(samples, RATE_HZ, "force", "N", ("fx", "fy", "fz"))


def violations(forces_n: FloatArray, limits: Limits) -> list[str]:
    """What a rig must never have been given, in words. forces_n (n, 3): every write, from rest to rest.

    A step above the slew limit is allowed in a safety release only: then the force shrinks from write to write along
    itself, never turning round, and is zero after `release_s`.
    """
    found = []
    if not np.isfinite(forces_n).all():
        found.append("not a number")
    norms = np.linalg.norm(forces_n, axis=1)
    if (norms > limits.total_cap_n).any():
        found.append(f"cap: {norms.max()} N")
    steps = np.linalg.norm(np.diff(forces_n, axis=0, prepend=0.0), axis=1)
    release = max(1, int(limits.release_s * RATE_HZ))
    for k in np.flatnonzero(steps > limits.slew_n_per_s / RATE_HZ + 1e-12):
        zeros = np.flatnonzero(norms[k : k + release] == 0.0)
        cut_off = len(norms) < k + release
        fading = norms[max(k - 1, 0) : k + (zeros[0] + 1 if len(zeros) else release)]
        if (np.diff(fading) > 0).any() or not (len(zeros) or cut_off):
            found.append(f"slew: {steps[k] * RATE_HZ} N/s at write {k}")
        faded = forces_n[max(k - 1, 0) : k + (zeros[0] + 1 if len(zeros) else release)]
        along = faded @ faded[0]
        if (along < -1e-12).any() or (np.linalg.norm(np.cross(faded, faded[0]), axis=1) > 1e-9).any():
            found.append(f"fade: it turns the force, at write {k}")
    return found
