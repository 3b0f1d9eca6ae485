"""The quick simulator against the same recipe written plainly: dense matrices, one step after the other."""

from dataclasses import replace

import numpy as np
import pytest

import equalizer.effects.simulation.simulator as simulator
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import AxisForce, PlacedEffect
from equalizer.effects.simulation.bodies import Restarts, build_bodies, simulate_bodies
from equalizer.effects.simulation.command_path import ActuatorForce
from equalizer.effects.simulation.instant import (
    A_FREE,
    A_PER_N,
    F_END,
    LENGTH,
    STEP_S,
    TIME_S,
    V_FREE,
    V_PER_N,
    X_FREE,
    X_PER_N,
    V,
    X,
)
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.simulation.modal_form import build_step_form
from equalizer.effects.simulation.simulator import (
    simulate_mechanism,
    simulate_response,
    simulate_states_before,
    simulate_windows,
)
from equalizer.effects.simulation.stepping import BLOCK
from equalizer.plant.linear_simulation import discretise_model
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold

RATE_HZ, SAMPLES = 1000.0, 400
WITHIN, RUBBING = 1e-9, 1e-6
"""Relative. Dry friction is iterated to a millionth of its longest bend, where rounding may ask for one turn more;
several forces until they stand still."""
CONVERGED = 60
"""Sweeps over several forces."""


def placed(*named) -> list[PlacedEffect]:
    return [PlacedEffect(EFFECTS[name], sites, values) for name, sites, values in named]


def plainly(bodies, driven, size, step_s):
    """What `moved` gives."""
    linear = discretise_model(bodies.structure, step_s, bodies.ports)
    n, steps = size
    r, stride = bodies.ports.shape[1], len(driven.mean) // n
    rows = np.vstack([linear.motion, linear.response, linear.position])
    nothing = np.zeros_like(linear.position)
    by_u = np.vstack([linear.motion_by_command, linear.response_by_command, nothing[:, : driven.mean.shape[1]]])
    by_f = np.vstack([linear.motion_by_port_force, linear.response_by_port_force, np.zeros((len(nothing), r))])
    state, force_end, shown = np.zeros(len(linear.transition)), np.zeros(r), np.zeros(driven.mean.shape[1])
    memories = [np.zeros(act.memory) for act in bodies.actions]
    looked, added = np.empty((n, len(rows))), np.empty((n, r))
    for k in range(n):
        looked[k], added[k] = rows @ state + by_u @ shown + by_f @ force_end, force_end
        for step in range(steps):
            u = driven.mean[k * stride + (step if stride > 1 else 0)]
            at = np.zeros(LENGTH)
            at[STEP_S], at[TIME_S] = step_s, (k * steps + step) * step_s
            state, force_end = _one_step(bodies, linear, state, u, memories, at)
        shown = driven.end[(k + 1) * stride - 1]
    return looked, added


def _one_step(bodies, linear, state, u, memories, at):
    r, items = bodies.ports.shape[1], len(bodies.actions)
    force, end, own = np.zeros(r), np.zeros(r), np.zeros((items, 2))
    before = [memory.copy() for memory in memories]
    motion = linear.motion
    for sweep in range(CONVERGED if items > 1 else 1):
        for item, (act, port, numbers) in enumerate(
            zip(bodies.actions, bodies.force_ports, bodies.parameters, strict=True)
        ):
            if sweep:
                force[port] -= own[item, 0]
                end[port] -= own[item, 1]
                memories[item][:] = before[item]
            free = linear.transition @ state + linear.state_by_command @ u + linear.state_by_port_force @ force
            unit = linear.state_by_port_force[:, port]
            at[X], at[V] = motion[port] @ state, motion[r + port] @ state
            at[X_FREE], at[V_FREE] = motion[port] @ free, motion[r + port] @ free
            at[X_PER_N], at[V_PER_N] = motion[port] @ unit, motion[r + port] @ unit
            row = 2 * r + port
            at[A_FREE] = motion[row] @ state + linear.motion_by_command[row] @ u
            at[A_FREE] += linear.motion_by_port_force[row] @ force
            at[A_PER_N], at[F_END] = linear.motion_by_port_force[row, port], np.nan
            mean = act.law(numbers, memories[item], at)
            own[item] = mean, mean if np.isnan(at[F_END]) else at[F_END]
            force[port] += own[item, 0]
            end[port] += own[item, 1]
    return linear.transition @ state + linear.state_by_command @ u + linear.state_by_port_force @ force, end


def assert_same(model, effects, commands, steps, fine=1):
    bodies = build_bodies(model, effects)
    held = np.repeat(commands, fine, axis=0)
    ramp = held + 0.1 * np.sin(np.arange(len(held)))[:, None] if fine > 1 else held
    driven = ActuatorForce(ramp, ramp if fine == 1 else ramp + 0.01)
    size, step_s = (len(commands), steps), 1 / (RATE_HZ * steps)
    found, pushed = simulate_bodies(bodies, driven, size, step_s)
    wanted, forced = plainly(bodies, driven, size, step_s)
    within = RUBBING if any(act.memory for act in bodies.actions) else WITHIN
    scale = np.abs(wanted).max(axis=0) + 1e-12
    np.testing.assert_array_less(np.abs(found - wanted).max(axis=0) / scale, within)
    np.testing.assert_allclose(pushed, forced, atol=within * (np.abs(forced).max() + 1e-12), rtol=0)
    short, none = simulate_bodies(bodies, driven, size, step_s, with_motion=False)
    np.testing.assert_array_equal(none, np.zeros((size[0], 0)))
    np.testing.assert_allclose(
        short, found[:, 3 * bodies.ports.shape[1] :], atol=1e-12 * np.abs(found).max(), rtol=1e-12
    )


def free_masses(axes: int, damping: float = 0.0) -> MechanicalModel:
    eye = np.eye(axes)
    return MechanicalModel("free", "acceleration", 0.3 * eye, damping * eye, 0 * eye, eye, eye)


def springs(damping: float) -> MechanicalModel:
    identity = np.eye(1)
    return MechanicalModel(
        "spring", "acceleration", 0.3 * identity, damping * identity, 120.0 * identity, identity, identity
    )


CRITICAL = 2 * np.sqrt(0.3 * 120.0)
STIFF = ("coulomb_friction", (0,), {"level": 0.4})
SMOOTH = ("quadratic_damping", (1,), {"coefficient": 5.0})
LOOSE = ("loose_joint", (0,), {"gap": 1e-4, "stiffness": 2e3, "slip": 0.05})
SEVERAL = [STIFF, SMOOTH, LOOSE]
TONE = {"frequency": 50.0, "phase": 0.0}
ALIKE = [("coulomb_friction", (0, 1, 2), {"level": 0.2}), ("hardening_stiffness", (2,), {"k3": 1e7})]


@pytest.mark.parametrize(
    ("named", "steps", "fine"),
    [
        ([], 1, 1), ([], 4, 1), ([], 4, 4),
        ([STIFF], 4, 1), ([STIFF], 4, 4), ([SMOOTH], 4, 4), ([LOOSE], 8, 1),
        pytest.param(SEVERAL, 8, 1, marks=pytest.mark.slow), pytest.param(ALIKE, 4, 1, marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_three_axes_move_as_the_plain_recipe_says(bench, named, steps, fine):
    samples = SAMPLES if len(named) < 2 else SAMPLES // 8  # the recipe solves several forces by iteration, in Python
    commands = 2 * bench.commands(3)[300 : 300 + samples] + 0.2
    assert_same(bench.three_axes(), placed(*named), commands, steps, fine)


@pytest.mark.slow
@pytest.mark.parametrize(("named", "steps"), [(SEVERAL, 8), (ALIKE, 4)])
def test_several_forces_move_them_so_for_longer(bench, named, steps):
    commands = 2 * bench.commands(3)[300 : 300 + SAMPLES] + 0.2
    assert_same(bench.three_axes(), placed(*named), commands, steps, 1)


@pytest.mark.parametrize(
    "model",
    [*map(free_masses, (1, 3)), free_masses(2, 4.0), *(springs(CRITICAL * over) for over in (1, 1 + 1e-9, 1.01, 3))],
    ids=["free", "three free", "damped", "critical", "nearly", "over", "far over"],
)  # fmt: skip
@pytest.mark.parametrize("rubs", [False, True])
def test_models_without_modes_of_their_own_move_so_too(model, rubs):
    commands = np.random.default_rng(2).standard_normal((SAMPLES, model.inputs))
    assert_same(model, placed(STIFF) if rubs else [], commands, 4)


def test_blocks_join_without_a_seam(bench):
    commands = np.tile(bench.commands(3)[:1000], (6, 1))
    assert len(commands) > BLOCK
    whole = simulate_mechanism(bench.three_axes(), commands, RATE_HZ)
    part = simulate_mechanism(bench.three_axes(), commands[: BLOCK + 1], RATE_HZ)
    np.testing.assert_allclose(whole.response[: BLOCK + 1], part.response, rtol=0, atol=1e-12)
    quiet = placed(("quadratic_damping", (0,), {"coefficient": 0.0}))
    np.testing.assert_allclose(
        simulate_mechanism(bench.three_axes(), commands, RATE_HZ, quiet).response, whole.response, rtol=0, atol=1e-9
    )


def test_the_response_alone_is_the_same_response(bench):
    commands, effects = bench.commands(3)[:SAMPLES], placed(STIFF)
    whole = simulate_mechanism(bench.three_axes(), commands, RATE_HZ, effects)
    alone = simulate_response(bench.three_axes(), commands, RATE_HZ, effects)
    np.testing.assert_allclose(alone.response, whole.response, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(alone.position, whole.position, rtol=1e-12, atol=1e-18)
    assert alone.axis_position.shape == alone.axis_velocity.shape == alone.axis_force.shape == (SAMPLES, 0)


def test_commands_are_left_as_they_are(bench):
    commands = bench.commands(3)[:SAMPLES]
    kept = commands.copy()
    simulate_mechanism(bench.three_axes(), commands, RATE_HZ, placed(STIFF, ("force_gain", (0,), {"gain": 1.1})))
    np.testing.assert_array_equal(commands, kept)


@compile_law
def _heavier(of: np.ndarray, memory: np.ndarray, at: np.ndarray) -> float:
    return -of[0] * at[A_FREE] / (1 + of[0] * at[A_PER_N])


@pytest.mark.parametrize("asked", [pytest.param(True, marks=pytest.mark.slow), False])
def test_a_law_knows_the_acceleration_if_its_effect_asks_for_it(bench, asked):
    acts = AxisForce(_heavier, lambda model, axis, values: np.array([0.05]), acceleration=asked)
    effects = [PlacedEffect(replace(EFFECTS["coulomb_friction"], action=acts), (axis,), {}) for axis in (0, 1)]
    commands = bench.commands(3)[:SAMPLES] + 0.1
    if asked:
        assert_same(bench.three_axes(), effects, commands, 4)
    else:
        assert np.isnan(simulate_mechanism(bench.three_axes(), commands, RATE_HZ, effects).response[1:]).any()


@pytest.mark.parametrize(
    ("model", "pairs"),
    [(springs(CRITICAL), True), (springs(0.1), True), (free_masses(1), True), (free_masses(3), False)],
)
def test_pairs_are_used_where_they_are_well_apart_and_say_the_same(model, pairs):
    advance = discretise_model(model, 1 / RATE_HZ).transition
    form = build_step_form(advance)
    half = len(advance) // 2
    assert (form.step_matrix.shape == (4, half)) is pairs
    matrix = np.block([[np.diag(form.step_matrix[0]), np.diag(form.step_matrix[1])],
                       [np.diag(form.step_matrix[2]), np.diag(form.step_matrix[3])]]
                      ) if pairs else form.step_matrix.T  # fmt: skip
    np.testing.assert_allclose(form.state_from_modal @ matrix @ form.modal_from_state, advance, rtol=0, atol=1e-12)


def test_an_advance_that_is_not_finite_is_stepped_as_it_is():
    assert build_step_form(np.full((2, 2), np.inf)).step_matrix.shape == (2, 2)


@pytest.mark.parametrize("named", [(), (SMOOTH,), (("hardening_stiffness", (2,), {"k3": 1e7}), SMOOTH)])
def test_pieces_begun_in_the_states_of_the_whole_go_on_as_the_whole_does(bench, named):
    commands, effects, model = bench.commands(3)[:SAMPLES], placed(*named), bench.three_axes()
    sampled, starts = (RATE_HZ, Hold.ZERO_ORDER), np.array([90, 250])
    whole = simulate_response(model, commands, RATE_HZ, effects)
    states = simulate_states_before(model, commands, sampled, effects, starts)
    kept = np.r_[90:150, 250:400]
    joined = Restarts(np.array([0, 60]), states)
    pieces = simulate_windows(model, commands[kept], sampled, effects, None, joined)
    # The sensor's low-pass forgets within some samples what it saw before a piece.
    inside = np.r_[40:60, 100:210]
    np.testing.assert_allclose(pieces.response[inside], whole.response[kept][inside], rtol=0, atol=1e-8)
    np.testing.assert_allclose(pieces.position, whole.position[kept], rtol=0, atol=1e-12)
    from_rest = simulate_response(model, commands[kept], RATE_HZ, effects)
    assert np.abs(from_rest.position[:60] - whole.position[90:150]).max() > 1e-5


def test_a_motion_under_forces_is_simulated_once_for_all_effects_of_the_sensor(monkeypatch):
    simulated, simulate = [], simulator.simulate_bodies

    def simulate_and_count(*arguments):
        simulated.append(arguments)
        return simulate(*arguments)

    def read_response(level, hum, driven):
        effects = placed(("coulomb_friction", (0,), {"level": level}), ("mains_hum", (0,), {"amplitude": hum, **TONE}))
        return simulate_response(springs(1.0), driven, RATE_HZ, effects).response

    monkeypatch.setattr(simulator, "simulate_bodies", simulate_and_count)
    monkeypatch.setattr(simulator, "_kept_rows", {})
    command = np.sin(np.arange(SAMPLES) / 9.0)[:, None]
    without_hum = read_response(0.4, 0.0, command)
    tone = 0.3 * np.sin(2 * np.pi * TONE["frequency"] * np.arange(SAMPLES) / RATE_HZ)[:, None]
    np.testing.assert_allclose(read_response(0.4, 0.3, command), without_hum + tone, atol=1e-12)
    without_hum[:] = 0  # the caller's own array
    assert np.abs(read_response(0.4, 0.0, command)).max() > 0
    assert len(simulated) == 1
    # What moves the device in another way is simulated, also where the same array has other samples.
    assert not np.array_equal(read_response(0.3, 0.0, command), read_response(0.4, 0.0, command))
    before = read_response(0.4, 0.0, command)
    command *= 2
    assert not np.array_equal(read_response(0.4, 0.0, command), before)
    assert len(simulated) == 3


@pytest.mark.parametrize(("most_bytes", "most", "kept"), [(5, 9, 2), (9, 2, 2), (9, 9, 3), (0, 9, 0)])
def test_kept_motions_are_limited_in_size_and_number(monkeypatch, most_bytes, most, kept):
    monkeypatch.setattr(simulator, "_kept_rows", {})
    monkeypatch.setattr(simulator, "KEPT_BYTES", most_bytes * SAMPLES * 8)  # a motion has two rows of `SAMPLES`
    monkeypatch.setattr(simulator, "KEPT_MOTIONS", most)
    effects = [placed((STIFF[0], [0], {"level": level})) for level in (0.1, 0.2, 0.3)]
    for effect in effects:
        simulate_response(springs(1.0), np.ones((SAMPLES, 1)), RATE_HZ, effect)
    last_values = [causes[-1][0][-1] for causes in simulator._kept_rows]
    assert last_values == [(("level", 0.1),), (("level", 0.2),), (("level", 0.3),)][3 - kept :]
    # The actions of effects with recorded conditions are others in each simulation.
    of_conditions = replace(effects[0][0].effect, with_conditions=lambda samples, rate_hz: None)
    simulate_response(springs(1.0), np.ones((SAMPLES, 1)), RATE_HZ, [replace(effects[0][0], effect=of_conditions)])
    assert [causes[-1][0][-1] for causes in simulator._kept_rows] == last_values
