"""An axis with physics of its own, integrated in fine steps with implicit dry friction (Moreau 1988): a truth for tests
of the force balance that shares nothing with the kernels of the product. Compiles."""

from dataclasses import dataclass, fields, replace

import numpy as np
from numba import njit

from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import Signal

STEPS = 20
"""Of the integration, per sample."""


@dataclass(frozen=True)
class Physics:
    mass: float = 0.3
    damping: float = 2.0
    stiffness: float = 100.0
    coulomb: float = 0.0
    stiction: float = 0.0
    stribeck_speed: float = 0.1
    dahl: float = 0.0
    dahl_stiffness: float = 1.0
    quadratic: float = 0.0
    cubic: float = 0.0
    square: float = 0.0
    cogging: float = 0.0
    pitch: float = 0.01
    phase: float = 0.0
    stop_at: float = 1e9
    stop_stiffness: float = 0.0
    inertia_per_m: float = 0.0
    rubbing_per_m: float = 0.0
    rubbing_per_m2: float = 0.0
    second_mass: float = 0.0
    second_hz: float = 20.0
    second_ratio: float = 0.05

    def numbers(self) -> np.ndarray:
        return np.array([getattr(self, field.name) for field in fields(self)])


@njit
def holding_force(p, q, v, bend):
    """What holds the axis back: all but inertia and dry friction."""
    held = p[1] * v + p[2] * q + bend + p[8] * v * abs(v) + p[9] * q**3 + p[10] * q**2
    held += p[15] * max(q - p[14], 0.0) + p[11] * np.sin(2 * np.pi * q / p[12] + p[13])
    return held + 0.5 * p[0] * p[16] * v * v


@njit
def friction_level(p, q, v):
    level = p[3] + p[4] * np.exp(-((v / p[5]) ** 2))
    return level * max(1 + p[17] * q + p[18] * q * q, 0.0)


@njit
def simulate_axis(p, drive, gains, noise, rate_hz):
    """drive: forces, or where gains are given a reference that they follow. Position and force, (n,) each."""
    n, dt = len(drive), 1 / (STEPS * rate_hz)
    position, force = np.zeros(n), np.zeros(n)
    q = v = bend = q2 = v2 = last = 0.0
    for k in range(n):
        position[k] = q + noise[k]
        push = drive[k]
        if gains[0] > 0:
            push = gains[0] * (drive[k] - position[k]) - gains[1] * v
        force[k] = push
        last = push
        for _ in range(STEPS):
            mass = p[0] * (1 + p[16] * q)
            other = 0.0
            if p[19] > 0:
                turn = 2 * np.pi * p[20]
                other = p[19] * (turn * turn * (q - q2) + 2 * p[21] * turn * (v - v2))
                v2 += dt * other / p[19]
                q2 += dt * v2
            free = v + dt * (last - holding_force(p, q, v, bend) - other) / mass
            grip = dt * friction_level(p, q, v) / mass
            v = np.sign(free) * max(abs(free) - grip, 0.0)
            q += dt * v
            if p[6] > 0:
                bend += dt * p[7] * (v - abs(v) * bend / p[6])
    return position, force


def random_course(seed, count, rate_hz, band=(0.2, 15.0)):
    """(count,): a random course of rms 1 within a band, not periodic."""
    spectrum = np.fft.rfft(np.random.default_rng([seed, 3]).standard_normal(count))
    frequency_hz = np.fft.rfftfreq(count, 1 / rate_hz)
    spectrum[(frequency_hz < band[0]) | (frequency_hz > band[1])] = 0.0
    course = np.fft.irfft(spectrum, count)
    return course / course.std()


def record_axis(
    physics=Physics(), seed=1, *, seconds=12.0, rate_hz=500.0, level=5.0, gains=None, noise=1e-6, force_noise=0.0,
    colour=0.0, swells=True,
):  # fmt: skip
    """One axis. gains: of a PD controller that follows a wave of 0.05 m. noise, m, of the position; force_noise, of
    the force's rms, of what else pushes and is not in the command; colour: from one sample to the next."""
    count = int(seconds * rate_hz)
    random = np.random.default_rng([seed, 7])
    drive = random_course(seed, count, rate_hz) * (0.05 / 2 if gains is not None else level)
    if swells:
        drive *= 0.6 + 0.4 * np.sin(2 * np.pi * np.arange(count) / count * 3)
    read = noise * random.standard_normal(count)
    position, force = simulate_axis(physics.numbers(), drive, np.array(gains or (0.0, 0.0)), read, rate_hz)
    if force_noise:
        force = force + force_noise * force.std() * coloured_noise(random, count, colour)
    return make_recording(force[:, None], position[:, None], rate_hz)


def coloured_noise(random, count, colour):
    white, left = random.standard_normal(count), np.empty(count)
    left[0] = white[0]
    for k in range(1, count):
        left[k] = colour * left[k - 1] + np.sqrt(1 - colour**2) * white[k]
    return left


def make_recording(force, position, rate_hz, hold=Hold.ZERO_ORDER):
    names = "xyz"[: position.shape[1]]
    return Recording(
        "invented",
        Signal(force, rate_hz, "force", "N", tuple(f"f{k}" for k in "xyz"[: force.shape[1]])),
        Signal(position, rate_hz, "position", "m", tuple(names)),
        hold=hold,
    )


def record_imposed_motion(physics, seed=1, *, seconds=12.0, rate_hz=500.0, travel=0.03, force_noise=0.005):
    """The motion is given and the force is read: dry friction by the sign of the velocity, no second body, no bend."""
    count = int(seconds * rate_hz)
    random, p = np.random.default_rng([seed, 8]), physics
    q = random_course(seed, count, rate_hz, (0.3, 8.0)) * travel
    turn = 2j * np.pi * np.fft.rfftfreq(count, 1 / rate_hz)
    v, a = (np.fft.irfft(turn**k * np.fft.rfft(q), count) for k in (1, 2))
    level = p.coulomb + p.stiction * np.exp(-((v / p.stribeck_speed) ** 2))
    force = p.mass * (1 + p.inertia_per_m * q) * a + level * (
        1 + p.rubbing_per_m * q + p.rubbing_per_m2 * q**2
    ) * np.sign(v)
    force += np.array([holding_force(p.numbers(), *pair, 0.0) for pair in zip(q, v, strict=True)])
    force += force_noise * force.std() * random.standard_normal(count)
    return replace(
        make_recording(force[:, None], q[:, None], rate_hz, Hold.BAND_LIMITED),
        meta={"imposed": "position"},
    )
