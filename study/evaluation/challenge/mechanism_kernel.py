"""Equations of motion of the mechanism, integrated by semi-implicit Euler with many steps per sample (compiled).

    M(q) d2q/dt2 = -C dq/dt - K q + (drive + friction + handle forces + coupling + creep + modulation + laws, 0)

q: positions of the handle (3) and of the attached oscillators. Optionally, the drive force acts through play
(backlash): on a motor that touches the handle at either end of a gap.

The velocity is updated first, then the position, so that a velocity belongs half a step before its position. Damping
and friction use the velocity extrapolated by half a step with the previous acceleration: otherwise the mass of each
mode would seem smaller by its damping times half a step.
"""

from math import pi, sin
from typing import NamedTuple

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.friction_kernel import step_bristle
from study.evaluation.challenge.handle_force_kernel import compute_handle_force
from study.evaluation.challenge.law_kernel import advance_law_memory, sum_law_forces

MODULATION_HZ, DAMPING_DEPTH, STIFFNESS_DEPTH, PHASE, IS_SQUARE_WAVE = range(5)
"""Columns of `modulation`: frequency (Hz, 0 = none), amplitude of the modulation of the ground's damping (N s/m) and
stiffness (N/m), phase (rad), 1 = square wave, 0 = sine."""
PLAY_AXIS, MOTOR_MASS, GAP, CONTACT_STIFFNESS, CONTACT_DAMPING = range(5)
"""Columns of `play`: axis (-1 = none), motor mass (kg), total gap (m), contact stiffness (N/m) and damping (N s/m)."""


class Mechanism(NamedTuple):
    """Parameters, in the coordinates of the handle (3), then of the attached oscillators: n in total."""

    inverse_mass: FloatArray
    """(n, n), 1/kg; without the mass of the motor on an axis with play"""
    damping: FloatArray
    """(n, n), N s/m"""
    stiffness: FloatArray
    """(n, n), N/m"""
    friction: FloatArray
    """(3, 7), columns in `friction_kernel`"""
    forces: FloatArray
    """(3, 11), columns in `handle_force_kernel`"""
    inertia_per_m: FloatArray
    """(3,), 1/m: relative change of the whole handle's inertia with the position along each axis"""
    axis_mass_per_m: FloatArray
    """(3,), kg/m: change of the mass for motion along an axis with the position along it"""
    modulation: FloatArray
    """(3, 5), time-varying damping and stiffness, columns above"""
    play: FloatArray
    """(5,), columns above"""
    creep_stiffness: FloatArray
    """(3, elements), N/m: springs to the ground, each in series with a damper (Maxwell elements)"""
    creep_share: FloatArray
    """(elements,), step over relaxation time: fraction of a spring's deflection that relaxes in a step"""
    coupling: float
    """N/m^2: the potential coupling * x^2 y / 2."""
    laws: FloatArray
    """(laws, 7), columns in `law_kernel`"""


class Motion(NamedTuple):
    """Motion of the handle at the samples, (samples, 3) each, SI units."""

    acceleration: FloatArray
    """m/s^2, under the drive force of the previous integration step."""
    position: FloatArray
    """m."""
    velocity: FloatArray
    """m/s, extrapolated by half a step to the time of the position."""
    law_force: FloatArray
    """N, force of the laws (`law_kernel`) alone, under the drive force of the integration step that begins there."""


@njit(cache=True, nogil=True)
def integrate_motion(m: Mechanism, force: FloatArray, steps_per_sample: int, rate_hz: float) -> Motion:
    """Integrate the motion from rest at 0. m: parameters; force: drive force, (samples * steps_per_sample, 3), N;
    steps_per_sample: integration steps per sample; rate_hz: sample rate.

    A sample is read just before the force of its integration step acts, so that its acceleration belongs to the force
    of the previous step.
    """
    n, sample_count, h = m.inverse_mass.shape[0], force.shape[0] // steps_per_sample, 1.0 / (rate_hz * steps_per_sample)
    acceleration, position = np.zeros((sample_count, 3)), np.zeros((sample_count, 3))
    velocity, law_force = np.zeros((sample_count, 3)), np.zeros((sample_count, 3))
    memory, law_n = np.zeros(m.laws.shape[0]), np.zeros(3)
    q, v, f, a = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    deflection, motor, creep = np.zeros(3), np.zeros(2), np.zeros(m.creep_stiffness.shape)
    drive, previous_drive, v_now = np.zeros(3), np.zeros(3), np.zeros(n)
    for step in range(force.shape[0]):
        v_now[:] = v + 0.5 * h * a
        _set_linear_forces(m, q, v_now, f)
        _add_friction_and_coupling(m, q, v_now, deflection, h, f)
        _add_creep_and_modulation(m, q, v_now, creep, step * h, f)
        for j in range(3):
            drive[j] = force[step, j]
        if m.laws.shape[0] > 0:
            sum_law_forces(m.laws, (q, v_now, drive), memory, step * h, law_n)
            for index in range(m.laws.shape[0]):
                memory[index] = advance_law_memory(m.laws[index], q, drive, memory[index], h)
            for j in range(3):
                f[j] += law_n[j]
        if m.play[PLAY_AXIS] >= 0.0:
            _apply_play(m.play, q, v, motor, drive, h)
        if step % steps_per_sample == 0:
            _compute_previous_acceleration(m, (q, v_now, previous_drive), (memory, step * h, law_n), f, a)
            for j in range(3):
                acceleration[step // steps_per_sample, j], position[step // steps_per_sample, j] = a[j], q[j]
                velocity[step // steps_per_sample, j], law_force[step // steps_per_sample, j] = v_now[j], law_n[j]
        _compute_acceleration(m, q, f, drive, a)
        for i in range(n):
            v[i] += h * a[i]
            q[i] += h * v[i]
        previous_drive[:] = drive
    return Motion(acceleration, position, velocity, law_force)


@njit(cache=True, nogil=True)
def _compute_previous_acceleration(
    m: Mechanism,
    state: tuple[FloatArray, FloatArray, FloatArray],
    laws: tuple[FloatArray, float, FloatArray],
    f: FloatArray,
    a: FloatArray,
) -> None:
    """Compute the acceleration `a` (n,) under the drive force of the previous step, also in laws of the command. state:
    positions, velocities, that drive force. laws: memory states, time (s), and the forces of the laws under the drive
    force of this step, which `f` contains."""
    memory, t, law_n = laws
    if m.laws.shape[0] == 0:
        _compute_acceleration(m, state[0], f, state[2], a)
        return
    previous_law_n, previous_f = np.zeros(3), f.copy()
    sum_law_forces(m.laws, state, memory, t, previous_law_n)
    for j in range(3):
        previous_f[j] += previous_law_n[j] - law_n[j]
    _compute_acceleration(m, state[0], previous_f, state[2], a)


@njit(cache=True, nogil=True)
def _set_linear_forces(m: Mechanism, q: FloatArray, v: FloatArray, f: FloatArray) -> None:
    """Set `f` (n,) to the linear forces -K q - C v, N."""
    n = f.shape[0]
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += m.stiffness[i, j] * q[j] + m.damping[i, j] * v[j]
        f[i] = -total


@njit(cache=True, nogil=True)
def _add_friction_and_coupling(
    m: Mechanism, q: FloatArray, v: FloatArray, deflection: FloatArray, h: float, f: FloatArray
) -> None:
    """Add friction, `compute_handle_force` and the coupling of x and y to `f` (n,), N. deflection: deflections of the
    bristles (3,), m, updated."""
    for j in range(3):
        friction_n, deflection[j] = step_bristle(m.friction[j], q[j], v[j], deflection[j], h)
        f[j] += friction_n + compute_handle_force(m.forces[j], q[j], v[j])
    if m.coupling != 0.0:
        f[0] -= m.coupling * q[0] * q[1]
        f[1] -= 0.5 * m.coupling * q[0] * q[0]


@njit(cache=True, nogil=True)
def _add_creep_and_modulation(
    m: Mechanism, q: FloatArray, v: FloatArray, creep: FloatArray, t: float, f: FloatArray
) -> None:
    """Add creep and modulated damping and stiffness to `f` (n,), N. creep: relaxed part of the creep springs'
    deflection (3, elements), m, updated; t: time (s)."""
    for j in range(3):
        for element in range(creep.shape[1]):
            if m.creep_stiffness[j, element] != 0.0:
                creep[j, element] += m.creep_share[element] * (q[j] - creep[j, element])
                f[j] -= m.creep_stiffness[j, element] * (q[j] - creep[j, element])
        modulation_row = m.modulation[j]
        if modulation_row[MODULATION_HZ] > 0.0:
            oscillation = sin(2.0 * pi * modulation_row[MODULATION_HZ] * t + modulation_row[PHASE])
            if modulation_row[IS_SQUARE_WAVE] > 0.0:
                oscillation = 1.0 if oscillation > 0.0 else -1.0
            f[j] -= oscillation * (modulation_row[DAMPING_DEPTH] * v[j] + modulation_row[STIFFNESS_DEPTH] * q[j])


@njit(cache=True, nogil=True)
def _apply_play(play: FloatArray, q: FloatArray, v: FloatArray, motor: FloatArray, drive: FloatArray, h: float) -> None:
    """Move the motor by one step of h seconds and replace its drive force (N) by the contact force: a spring and a
    damper where the motor, relative to the handle, is beyond half of the gap. motor: its position (m) and velocity
    (m/s), updated."""
    j = int(play[PLAY_AXIS])
    separation, closing = motor[0] - q[j], motor[1] - v[j]
    penetration = max(separation - 0.5 * play[GAP], 0.0) + min(separation + 0.5 * play[GAP], 0.0)
    contact_n = play[CONTACT_STIFFNESS] * penetration
    if penetration != 0.0:
        contact_n += play[CONTACT_DAMPING] * closing
    motor[1] += h * (drive[j] - contact_n) / play[MOTOR_MASS]
    motor[0] += h * motor[1]
    drive[j] = contact_n


@njit(cache=True, nogil=True)
def _compute_acceleration(m: Mechanism, q: FloatArray, f: FloatArray, drive: FloatArray, a: FloatArray) -> None:
    """Compute the acceleration `a` (n,), m/s^2, from the forces `f` (n,) and the drive force (3,), N. A mass that is
    added to a single axis enters by the Sherman-Morrison formula."""
    n = f.shape[0]
    inertia_factor = 1.0 + m.inertia_per_m[0] * q[0] + m.inertia_per_m[1] * q[1] + m.inertia_per_m[2] * q[2]
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += m.inverse_mass[i, j] * (f[j] + drive[j] if j < 3 else f[j])
        a[i] = total / inertia_factor if i < 3 else total
    for j in range(3):
        added_kg = m.axis_mass_per_m[j] * q[j]
        if added_kg != 0.0:
            axis_acceleration = a[j] / (1.0 + added_kg * m.inverse_mass[j, j])
            for i in range(3):
                a[i] -= m.inverse_mass[i, j] * added_kg * axis_acceleration
