"""The synthetic device of `plants` with dry friction at its handle. Nothing of an estimator is in it: modes stepped
exactly at 20 kHz, friction a set-valued force solved at each step (Moreau's time stepping), so it truly sticks.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.linalg import expm

RATE_HZ, SUBSTEPS = 1000.0, 20
SENSOR_RMS = np.array([0.042, 0.042, 0.083])
"""Of an ADXL335 at 500 Hz, m/s²."""


@dataclass(frozen=True)
class Rubbing:
    shapes: np.ndarray
    """(modes, 3)"""
    stiff: np.ndarray
    """(modes, 2): squared angular frequency, damping over mass"""
    step: np.ndarray
    """(modes, 2, 3): [position, speed, force] to [position, speed] one substep later"""
    friction_n: np.ndarray
    """(3,): per axis of the handle"""

    def play(self, commands) -> np.ndarray:
        """True accelerations (N, 3), as `Plant.play`, from rest."""
        W = np.einsum("ji,j,jk->ik", self.shapes, self.step[:, 1, 2], self.shapes)
        return _play(np.ascontiguousarray(commands), self.shapes, self.stiff, self.step, W, self.friction_n)

    def measured(self, commands, seed) -> np.ndarray:
        """What the accelerometer reads."""
        noise = np.random.default_rng(seed).standard_normal((len(commands), 3)) * SENSOR_RMS
        return self.play(commands) + noise


def rubbing(modes, friction_n) -> Rubbing:
    """modes: of `plants.modes_of`. friction_n: one for all axes, or three."""
    shapes = np.array([shape for _, _, shape in modes])
    stiff = np.array([((2 * np.pi * f) ** 2, 4 * np.pi * zeta * f) for f, zeta, _ in modes])
    step = np.empty((len(modes), 2, 3))
    for row, (k, d) in zip(step, stiff, strict=True):
        row[:] = expm(np.array([[0, 1, 0], [-k, -d, 1], [0, 0, 0]]) / (RATE_HZ * SUBSTEPS))[:2]
    return Rubbing(shapes, stiff, step, np.broadcast_to(np.asarray(friction_n, float), 3).copy())


# Entry by entry: small arrays that are made at each substep would take most of the time.


@njit(cache=True)
def _hold(free, W, friction_n, rub):
    """Sets the friction `rub` (3,) that holds the axes, as far as it can, against the speeds `free` (3,)."""
    for _sweep in range(8):
        for i in range(3):
            rest = free[i]
            for m in range(3):
                if m != i:
                    rest += W[i, m] * rub[m]
            rub[i] = min(friction_n[i], max(-friction_n[i], -rest / W[i, i]))


@njit(cache=True)
def _add(total, shape, factor):
    for i in range(3):
        total[i] += shape[i] * factor


@njit(cache=True)
def _along(shape, forces):
    return shape[0] * forces[0] + shape[1] * forces[1] + shape[2] * forces[2]


@njit(cache=True)
def _lag(value, share, target, mean):
    """Moves `value` (3,) by a share of its way to the target; `mean` becomes that of before and after."""
    for i in range(3):
        before = value[i]
        value[i] += share * (target[i] - before)
        mean[i] = (before + value[i]) / 2


@njit(cache=True)
def _play(commands, shapes, stiff, step, W, friction_n):
    h = 1 / (1000.0 * 20)
    to_motor, to_sensor = 1 - np.exp(-2 * np.pi * 600 * h), 1 - np.exp(-2 * np.pi * 500 * h)
    modes = len(shapes)
    q, v, motor, sensor, unused = np.zeros(modes), np.zeros(modes), np.zeros(3), np.zeros(3), np.zeros(3)
    held, rub, free, read, mean = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    out = np.empty(commands.shape)
    for k in range(len(commands)):
        out[k] = sensor
        for _ in range(20):
            _lag(motor, to_motor, held, mean)
            free[:] = 0.0
            for j in range(modes):
                force = _along(shapes[j], mean)
                _add(free, shapes[j], step[j, 1, 0] * q[j] + step[j, 1, 1] * v[j] + step[j, 1, 2] * force)
            _hold(free, W, friction_n, rub)
            read[:] = 0.0
            for j in range(modes):
                force = _along(shapes[j], mean) + _along(shapes[j], rub)
                before_q, before_v = q[j], v[j]
                q[j] = step[j, 0, 0] * before_q + step[j, 0, 1] * before_v + step[j, 0, 2] * force
                v[j] = step[j, 1, 0] * before_q + step[j, 1, 1] * before_v + step[j, 1, 2] * force
                # Mean acceleration of the step: what the sensor's pole is driven by.
                _add(read, shapes[j], (v[j] - before_v) / h)
            _lag(sensor, to_sensor, read, unused)
        held[:] = commands[k]
    return out
