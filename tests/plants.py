"""Synthetic haptic devices with a known truth. They share no code with the estimators: continuous modes, exact hold.

Three rigid modes on a weak spring, coupled resonances from 11 Hz on, structure from 84 Hz, motor and sensor poles,
one millisecond of delay: |G| is 1.5 to 10 in 5 to 35 Hz, and coupling begins near 10 Hz.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

RATE_HZ = 1000.0
SENSOR_RMS = np.array([0.042, 0.042, 0.083])
"""Of an ADXL335 at 500 Hz, m/s²."""
MASS_KG = 0.28

RIGID_HZ, RIGID_DAMPING = (3.4, 3.55, 3.7), (1.3, 1.45, 1.6)
MODES_HZ = (11.0, 13.2, 22.5, 31.0, 84.0, 110.0, 146.0, 187.0, 236.0, 289.0, 351.0, 420.0)
MODES_DAMPING = (0.06, 0.075, 0.05, 0.05, 0.022, 0.03, 0.025, 0.03, 0.035, 0.03, 0.04, 0.03)
MODES_PER_KG = (0.55, 0.5, 0.45, 0.4, 4.0, 2.5, 2.0, 1.5, 1.2, 1.0, 1.0, 0.8)


@dataclass(frozen=True)
class Plant:
    """Linear and exactly sampled: x+ = A x + B u, y = C x; y[k] is taken just before u[k] is written."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray

    def response(self, frequency_hz) -> np.ndarray:
        """(lines, 3, 3) in m/s² per N."""
        z = np.exp(2j * np.pi * np.atleast_1d(frequency_hz) / RATE_HZ)
        inverse = np.linalg.solve(z[:, None, None] * np.eye(len(self.A)) - self.A, self.B.astype(complex)[None])
        return self.C @ inverse

    def play(self, commands, state=None) -> np.ndarray:
        """True accelerations (N, 3) for commands (N, 3) from rest."""
        values, vectors = np.linalg.eig(self.A)
        if np.linalg.cond(vectors) > 1e10:
            return self._step_by_step(commands, state)
        from scipy.signal import lfilter

        driven = (np.linalg.solve(vectors, self.B.astype(complex)) @ commands.T).T
        start = np.zeros(len(values), complex) if state is None else np.linalg.solve(vectors, state.astype(complex))
        modal = np.empty((len(commands), len(values)), complex)
        for mode, pole in enumerate(values):
            modal[:, mode] = lfilter([0, 1], [1, -pole], driven[:, mode], zi=[start[mode]])[0]
        return (modal @ (self.C @ vectors).T).real

    def _step_by_step(self, commands, state) -> np.ndarray:
        x = np.zeros(len(self.A)) if state is None else state.copy()
        out = np.empty((len(commands), 3))
        for k, u in enumerate(commands):
            out[k] = self.C @ x
            x = self.A @ x + self.B @ u
        return out

    def measured(self, commands, seed, periods=1) -> np.ndarray:
        """What the accelerometer reads, from rest."""
        noise = np.random.default_rng(seed).standard_normal((len(commands), 3)) * SENSOR_RMS
        return self.play(commands) + noise


def omega_like(shift: float = 0.0, turn_deg: float = 0.0, bend: float = 0.0, hand: bool = False) -> Plant:
    """The device at one place; see `modes_of`."""
    return _sampled(modes_of(shift, turn_deg, bend, hand))


def modes_of(shift=0.0, turn_deg=0.0, bend=0.0, hand=False) -> list:
    """(Hz, damping ratio, shape / sqrt(mass)) of each mode. shift: relative change of the frequencies of modes 11 to 31
    Hz, 0 to 0.2 along a path (bend, 0 to 1, makes that path not linear in the modes' parameters); turn_deg: how far
    mode shapes have turned.
    hand: in a light grip, a stiffer, heavier rigid body whose resonances are lower and more damped."""
    modes = []
    for axis in range(3):
        frequency, damping, mass = RIGID_HZ[axis], RIGID_DAMPING[axis], MASS_KG
        if hand:
            frequency, damping, mass = frequency * 1.5, damping * 0.8, mass * 1.35
        modes.append((frequency, damping, np.eye(3)[axis] / np.sqrt(mass)))
    shapes = np.random.default_rng(20).standard_normal((len(MODES_HZ), 3))
    shapes /= np.linalg.norm(shapes, axis=1)[:, None]
    path = shift + bend * np.sin(np.pi * shift / 0.2) * 0.05
    for number, (frequency, damping) in enumerate(zip(MODES_HZ, MODES_DAMPING, strict=True)):
        low = frequency < 50
        shape = _turn(turn_deg * (1 + 0.3 * number) if low else 0.0, shapes[(number + 5) % 12]) @ shapes[number]
        grown = frequency * (1 + path * (1.0 if low else 0.2))
        softer = (0.94, 1.6) if hand and low else (1.0, 1.0)
        modes.append((grown * softer[0], damping * softer[1], np.sqrt(MODES_PER_KG[number]) * shape))
    return modes


def _turn(degrees, axis) -> np.ndarray:
    x, y, z = np.radians(degrees) * axis / np.linalg.norm(axis)
    return expm(np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]))


def _sampled(modes) -> Plant:
    """Acceleration of all modes, behind motor (600 Hz) and sensor (500 Hz) poles and a delay of one tick."""
    n = 2 * len(modes) + 6
    A, B, C = np.zeros((n, n)), np.zeros((n, 3)), np.zeros((3, n))
    motor, sensor = slice(n - 6, n - 3), slice(n - 3, n)
    A[motor, motor], B[motor] = -2 * np.pi * 600 * np.eye(3), 2 * np.pi * 600 * np.eye(3)
    A[sensor, sensor], C[:, sensor] = -2 * np.pi * 500 * np.eye(3), np.eye(3)
    for number, (frequency, damping, shape) in enumerate(modes):
        w, q, v = 2 * np.pi * frequency, 2 * number, 2 * number + 1
        A[q, v], A[v, q], A[v, v], A[v, motor] = 1.0, -(w**2), -2 * damping * w, shape
        A[sensor, :] += 2 * np.pi * 500 * np.outer(shape, A[v, :])
    stepped = expm(np.block([[A, B], [np.zeros((3, n + 3))]]) / RATE_HZ)
    held, step = stepped[:n, :n], stepped[:n, n:]
    late = np.zeros((n + 3, n + 3))
    late[:n, :n], late[:n, n:] = held, step
    return Plant(late, np.vstack([np.zeros((n, 3)), np.eye(3)]), np.hstack([C, np.zeros((3, 3))]))


def sweep(low_hz, high_hz, seconds=30.0, amplitude=1.0) -> np.ndarray:
    """One period of a logarithmic sweep (N,)."""
    n = round(seconds * RATE_HZ)
    octaves = np.log(high_hz / low_hz)
    scale = low_hz * seconds / octaves
    whole = scale * (np.exp(octaves) - 1)
    cycles = scale * (np.exp(octaves * np.arange(n) / n) - 1) * np.floor(whole) / whole
    return amplitude * np.sin(2 * np.pi * cycles)


def multisine(low_hz, high_hz, seconds=10.0, rms=0.5, seed=99) -> np.ndarray:
    """(N, 3): random phases on every line, all axes at once."""
    n = round(seconds * RATE_HZ)
    lines = np.fft.rfftfreq(n, 1 / RATE_HZ)
    chosen = (lines >= low_hz) & (lines <= high_hz)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, (len(lines), 3))
    wave = np.fft.irfft(chosen[:, None] * np.exp(1j * phases), n, axis=0)
    return rms * wave / wave.std(axis=0)
