"""The mechanism against what must hold of any: energy, symmetry, causality; and against a linear model of itself."""

from dataclasses import replace

import numpy as np
import pytest

from study.devices.rig import POSITION, TRUE_ACCELERATION
from study.devices.simulated import layout
from study.devices.simulated.compiled import solve_pose
from study.devices.simulated.layout import HANDLE_MODES, MOUNT_MODES
from study.devices.simulated.omega3 import build_omega3
from study.devices.simulated.parameters import Hand, HandleModes, Mount, Omega3Parameters

SHIPPED = Omega3Parameters()


def lossless():
    return replace(
        SHIPPED,
        drives=replace(SHIPPED.drives, friction_n_m=0.0, damping_n_m_s=0.0, cable_damping_ratio=0.0),
        mount=replace(SHIPPED.mount, damping_ratios=(0.0,) * MOUNT_MODES),
        handle_modes=replace(SHIPPED.handle_modes, damping_ratios=(0.0,) * HANDLE_MODES),
    )


def mirrored():
    """The same linkage and friction, without what is lopsided: cables, base and handle."""
    return replace(
        SHIPPED,
        drives=replace(SHIPPED.drives, cable_n_m_per_rad=(158.0,) * 3),
        mount=replace(Mount(), masses_kg=(1e9, 1e9)),
        handle_modes=replace(HandleModes(), masses_kg=(1e-12,) * HANDLE_MODES, gains=(0.0,) * HANDLE_MODES),
        hand=Hand((0.1,) * 3, (4.0,) * 3, (120.0,) * 3),
    )


def energy(rig):
    """Joule, from the state alone, by the formulas of docs/simulated_omega3.md."""
    state, p = rig.state, rig.parameters
    angles, jacobian = np.empty(3), np.empty((3, 3))
    solve_pose(p, state[:3].copy(), angles, jacobian)
    velocity, rocking, rocking_speed = state[3:6], state[12:14], state[14:16]
    bending, bending_speed = state[16 : 16 + HANDLE_MODES], state[16 + HANDLE_MODES : 16 + 2 * HANDLE_MODES]
    bristle = state[layout.BRISTLE_DEFLECTION : layout.BRISTLE_DEFLECTION + 3]
    normals = p[layout.MOUNT_DIRECTION :][: 3 * MOUNT_MODES].reshape(MOUNT_MODES, 3)
    shapes = p[layout.MODE_DIRECTION :][: 3 * HANDLE_MODES].reshape(HANDLE_MODES, 3)
    absolute = velocity + rocking_speed @ normals
    moving = absolute @ p[layout.PLATFORM_MASS :][:9].reshape(3, 3) @ absolute
    moving += p[layout.MODE_MASS :][:HANDLE_MODES] @ (shapes @ absolute + bending_speed) ** 2
    moving += p[layout.ARM_INERTIA] * np.sum((jacobian @ velocity) ** 2)
    moving += (
        p[layout.DRIVE_INERTIA] * np.sum(state[9:12] ** 2) + p[layout.MOUNT_MASS :][:MOUNT_MODES] @ rocking_speed**2
    )
    bent = (
        p[layout.CABLE_STIFFNESS :][:3] @ (state[6:9] - angles) ** 2
        + p[layout.MOUNT_STIFFNESS :][:MOUNT_MODES] @ rocking**2
    )
    bent += p[layout.MODE_STIFFNESS :][:HANDLE_MODES] @ bending**2
    bent += p[layout.COULOMB_FRICTION] / p[layout.PRESLIDING_RANGE] * np.sum(bristle**2)
    bent += p[layout.HAND_STIFFNESS :][:3] @ (state[:3] + rocking @ normals - p[layout.HAND_REST :][:3]) ** 2
    return 0.5 * (moving + bent)


def pushed(bench, parameters, hand):
    """A device that was given a blow of 3 N for 60 ms and is then left alone."""
    rig = bench.rig_of(parameters, hand)
    bench.play(rig, np.tile([1.2, 2.2, -1.7], (60, 1)))
    bench.play(rig, np.zeros((5, 3)))
    return rig


def test_without_losses_energy_is_kept_while_the_handle_crosses_the_workspace(bench):
    rig = pushed(bench, lossless(), hand=False)
    start, place = energy(rig), rig.state[:3].copy()
    levels = []
    for _ in range(60):
        bench.play(rig, np.zeros((1, 3)))
        levels.append(energy(rig))
    assert np.linalg.norm(rig.state[:3] - place) > 0.03
    assert np.array(levels) == pytest.approx(np.full(60, start), rel=0.02)


@pytest.mark.parametrize("hand", [False, True])
def test_left_alone_energy_only_falls_and_the_handle_stops(bench, hand):
    rig = pushed(bench, SHIPPED, hand)
    levels = [energy(rig)]
    for _ in range(300):
        bench.play(rig, np.zeros((10, 3)))
        levels.append(energy(rig))
    assert np.all(np.diff(levels) <= 1e-3 * levels[0])
    assert levels[-1] < 0.05 * levels[0]
    assert np.abs(rig.state[3:6]).max() < 1e-3


def test_friction_holds_a_small_force_and_lets_a_larger_one_go(bench):
    for force_n, moves in ((0.1, False), (0.4, True)):
        rig = build_omega3(1, hand=False)
        bench.play(rig, np.tile([0, 0, force_n], (1500, 1)))
        before = rig.state[2]
        bench.play(rig, np.tile([0, 0, force_n], (500, 1)))
        assert (rig.state[2] - before > 1e-3) == moves
        assert moves or 1e-6 < before < 1e-4


def test_a_force_acts_after_its_reading_and_not_before(bench):
    calm, struck = (build_omega3(1, hand=True) for _ in range(2))
    forces = np.zeros((30, 3))
    without = bench.play(calm, forces)
    forces[20] = [0.5, 1.0, -0.7]
    difference = np.abs(bench.play(struck, forces) - without)
    assert np.all(difference[:21] == 0)
    assert difference[21, TRUE_ACCELERATION].max() > 1e-4


def test_directions_mirrored_about_the_upright_plane_answer_mirrored(bench):
    time_s = np.arange(2000) / 1000
    wave = 1.5 * np.sin(2 * np.pi * 4 * time_s)[:, None]
    left, right = (bench.rig_of(mirrored()) for _ in range(2))
    place_left = bench.play(left, wave * [0.2, -0.7, 0.7], spring_hz=3.5)[:, TRUE_ACCELERATION]
    place_right = bench.play(right, wave * [0.2, 0.7, 0.7], spring_hz=3.5)[:, TRUE_ACCELERATION]
    assert place_left * [1, -1, 1] == pytest.approx(place_right, abs=1e-6)


def test_the_answer_depends_on_the_place(bench):
    free, along = replace(bench, spring_hz=0.0), np.array([0, 0.5**0.5, 0.5**0.5])
    smooth = replace(mirrored(), drives=replace(mirrored().drives, friction_n_m=0.0))
    off = {}
    for place in [(0, 0, 0), (0, 0.045, 0)]:
        answer = free.phasor(bench.rig_of(smooth, hand=True, place_m=place), 30.0, along)
        off[place] = np.linalg.norm(answer - along * (along @ answer)) / np.linalg.norm(answer)
    assert off[(0, 0, 0)] < 0.02
    assert off[(0, 0.045, 0)] > 0.03


@pytest.mark.parametrize("direction", [*np.eye(3), *-np.eye(3), np.full(3, 3**-0.5), np.full(3, -(3**-0.5))])
def test_the_stops_catch_twice_the_strongest_push_and_let_go_again(bench, direction):
    rig = build_omega3(1, hand=False)
    rows = bench.play(rig, np.tile(12.0 * direction, (2000, 1)))
    assert np.linalg.norm(rows[:, POSITION], axis=1).max() < 0.09
    assert np.abs(rig.state[3:6]).max() < 1e-3
    back = bench.play(rig, np.tile(-1.0 * direction, (300, 1)))
    assert np.isfinite(back).all()
    assert np.linalg.norm(back[-1, POSITION]) < 0.075


def linear_response(parameters, frequency_hz):
    """Handle acceleration (3, 3) per newton from M, C, K over (handle, motors, base, handle modes), all absolute."""
    p = parameters
    size = 6 + MOUNT_MODES + HANDLE_MODES
    mass, damping, stiffness = (np.zeros((size, size)) for _ in range(3))

    def add(matrix, rows, weights) -> None:
        matrix += rows.T @ np.diag(weights) @ rows

    jacobian, everything = np.empty((3, 3)), np.eye(size)
    solve_pose(p, np.zeros(3), np.empty(3), jacobian)
    normals = p[layout.MOUNT_DIRECTION :][: 3 * MOUNT_MODES].reshape(MOUNT_MODES, 3)
    shapes = p[layout.MODE_DIRECTION :][: 3 * HANDLE_MODES].reshape(HANDLE_MODES, 3)
    handle, motors, base, modes = (
        everything[:3],
        everything[3:6],
        everything[6 : 6 + MOUNT_MODES],
        everything[6 + MOUNT_MODES :],
    )
    arms = jacobian @ (handle - normals.T @ base)
    mass += handle.T @ p[layout.PLATFORM_MASS :][:9].reshape(3, 3) @ handle
    add(mass, modes + shapes @ handle, p[layout.MODE_MASS :][:HANDLE_MODES])
    add(mass, arms, np.full(3, p[layout.ARM_INERTIA]))
    add(mass, motors, np.full(3, p[layout.DRIVE_INERTIA]))
    add(mass, base, p[layout.MOUNT_MASS :][:MOUNT_MODES])
    add(stiffness, motors - arms, p[layout.CABLE_STIFFNESS :][:3])
    add(damping, motors - arms, p[layout.CABLE_DAMPING :][:3])
    add(damping, motors, np.full(3, p[layout.DRIVE_DAMPING]))
    add(stiffness, base, p[layout.MOUNT_STIFFNESS :][:MOUNT_MODES])
    add(damping, base, p[layout.MOUNT_DAMPING :][:MOUNT_MODES])
    add(stiffness, modes, p[layout.MODE_STIFFNESS :][:HANDLE_MODES])
    add(damping, modes, p[layout.MODE_DAMPING :][:HANDLE_MODES])
    add(stiffness, handle, p[layout.HAND_STIFFNESS :][:3])
    add(damping, handle, p[layout.HAND_DAMPING :][:3])
    s = 2j * np.pi * frequency_hz
    moved = np.linalg.solve(s**2 * mass + s * damping + stiffness, motors.T @ np.linalg.inv(jacobian).T)
    seen = handle + shapes.T @ np.diag(p[layout.MODE_GAIN :][:HANDLE_MODES]) @ modes
    amplifier = 1 / (1 + s / (2 * np.pi * SHIPPED.drives.amplifier_hz))
    # Each step takes the torque of its end: half a step early.
    held = np.sinc(frequency_hz / 1000) * np.exp(-s * (layout.TICK_S - layout.STEP_S) / 2)
    return s**2 * seen @ moved * amplifier * held


@pytest.mark.parametrize("frequency_hz", [4.0, 10.5, 11.3, 26.0, 45.0, 88.0, 134.0, 190.0, 250.0])
def test_small_motion_without_friction_is_that_of_the_linear_equations(bench, frequency_hz):
    smooth = replace(SHIPPED, drives=replace(SHIPPED.drives, friction_n_m=0.0))
    free = replace(bench, spring_hz=0.0)
    expected = linear_response(bench.rig_of(smooth, hand=True).parameters, frequency_hz)
    measured = [free.phasor(bench.rig_of(smooth, hand=True), frequency_hz, axis, 0.02) / 0.02 for axis in np.eye(3)]
    error = np.abs(np.array(measured).T - expected).max() / np.abs(expected).max()
    assert error < 0.03
