"""The gain of the force that a device reports, against trials of all kinds whose report is late, rounded, noisy and
off by a constant: true gains near 1 are never suspected, others soon are."""

import contextlib

import numpy as np
import pytest
from numba import njit

from study.devices.force_dimension import loop_cells
from study.devices.force_dimension.loop_cells import (
    CELLS_SIZE,
    FORCE_MEMORY,
    FORCE_MISMATCH,
    REPORTED_FORCE,
    check_status,
)
from study.devices.force_dimension.tick_io import STATUS_CHECK_TICKS, STATUS_CYCLE_TICKS
from tests.slow_instances import slow

AMPLITUDES_N = (0.2, 0.25, 0.3, 0.5, 1.0, 1.9, 3.0)
FREQUENCIES_HZ = (5, 7, 12.5, 20, 25, 30, 35, 40, 45, 50, 80, 1000 / 14, 1000 / 21, 1000 / 22, 1000 / 42)
"""Some with whole periods between the status checks."""

note_sent, add_to_sums, gain_is_off = loop_cells.record_sent_force, loop_cells._add_to_sums, loop_cells._is_gain_wrong


@njit
def suspected_after(force, told):
    """Ticks until the gain is suspected; -1: never. force, told (n, 3): what is sent after a tick, and reported in
    it."""
    cells = np.zeros(CELLS_SIZE)
    for tick in range(force.shape[0]):
        if tick % STATUS_CYCLE_TICKS in STATUS_CHECK_TICKS:
            cells[REPORTED_FORCE : REPORTED_FORCE + 3] = told[tick]
            add_to_sums(cells)
            if gain_is_off(cells):
                return tick
        note_sent(cells, force[tick, 0], force[tick, 1], force[tick, 2])
    return -1


def draw_trials(random, gain: float, age: int, step_n: float, noise_n: float, amplitude_n: float, seconds: float):
    """Trials of 2.5 s with pauses, and a spring's small forces: the forces sent, and those reported."""
    t = np.arange(round(1000 * seconds)) / 1000
    within = t % 4
    fades = np.clip(within / 0.1, 0, 1) * np.clip((2.5 - within) / 0.05, 0, 1)
    direction = random.normal(size=3)
    phase = 2 * np.pi * (random.choice(FREQUENCIES_HZ) * t + random.random())
    force = np.outer(amplitude_n * fades * np.sin(phase), direction / np.linalg.norm(direction))
    force += random.normal(0, 0.003, force.shape)
    told = gain * np.roll(force, 1 + age, axis=0) + [0.03, -0.02, 0.5] + random.normal(0, noise_n, force.shape)
    return force, step_n * np.round(told / step_n) if step_n else told


@pytest.mark.parametrize("age", [1, *slow(0, *range(2, FORCE_MEMORY))])
def test_a_report_that_is_late_rounded_noisy_and_off_by_a_weight_is_not_suspected(age):
    random = np.random.default_rng(age)
    for _ in range(200):
        gain, step_n, noise_n = random.uniform(0.9, 1.1), random.choice([0, 0.02, 0.1]), random.choice([0, 0.02, 0.1])
        drawn = draw_trials(random, gain, age, step_n, noise_n, random.choice(AMPLITUDES_N), seconds=20)
        assert suspected_after(*drawn) == -1


@pytest.mark.parametrize("age", [1, *slow(0, *range(2, FORCE_MEMORY))])
@pytest.mark.parametrize("gain", [0.7, 1.3])
def test_a_gain_that_is_off_by_30_percent_is_suspected_in_the_first_trial(age, gain):
    random = np.random.default_rng(age)
    for _ in range(100):
        drawn = draw_trials(random, gain, age, 0.02, 0.02, random.choice(AMPLITUDES_N[2:]), seconds=4)
        assert 0 < suspected_after(*drawn) < 2500


def status_checks(stepped_stub, axis: int, amplitude_n: float) -> int:
    """The first error code of the status checks while a trial of 2.5 s is played along this axis alone; else 0."""
    with contextlib.closing(stepped_stub.rig()) as rig:
        calls, cells = rig.compiled_io.calls, rig.compiled_io.cells
        for tick in range(2500):
            if tick % STATUS_CYCLE_TICKS in STATUS_CHECK_TICKS:
                code: int = check_status(calls, cells)
                if code:
                    return code
            force_n = np.zeros(3)
            force_n[axis] = amplitude_n * np.sin(2 * np.pi * 25 * tick / 1000)
            rig.write(force_n)
    return 0


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("gain", "code"), [(0.7, FORCE_MISMATCH), (1.0, 0), (1.3, FORCE_MISMATCH)])
def test_a_device_that_is_driven_along_an_axis_alone_is_judged_by_its_report(stepped_stub, axis, gain, code):
    stepped_stub.set("told_lift", 0.5)
    stepped_stub.set("silent_gain", gain)
    assert status_checks(stepped_stub, axis, 0.3) == code


def test_a_device_that_reports_its_weight_alone_is_not_judged_by_it(stepped_stub):
    stepped_stub.set("told_lift", 0.5)
    stepped_stub.set("gain_told", 0.0)
    assert status_checks(stepped_stub, 2, 1.0) == 0
