"""Bodies of a model with its effects: the changed linear structure, the forces on it, and its simulated motion.

A port is a direction in the structure's coordinates along which a force acts and motion is output: each driven axis,
and each joint that an effect adds. Sizes: n samples (n coordinates in `ports` and states), m commands, r ports, p
responses. Begin with `build_bodies` and `simulate_bodies`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.effects.effect import AxisForce, JointForce, PlacedEffect, Structure
from equalizer.effects.simulation.command_path import ActuatorForce
from equalizer.effects.simulation.mechanism_kernel import MAX_LAWS, compute_zero_force, wrap_law
from equalizer.effects.simulation.stepping import Forces, Stepping, build_forced_stepping, build_unforced_stepping
from equalizer.plant.linear_simulation import DiscreteModel, compute_driven_axes, discretise_model
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """The linear structure with the effects' joints, and the forces that act on it."""

    structure: MechanicalModel
    """The model with the coordinates that effects add."""
    axes: int
    """Number of driven axes."""
    ports: FloatArray
    """(n, r): the directions along which forces act; the driven axes first, then joints."""
    actions: tuple[AxisForce | JointForce, ...]
    """Action (law and its settings) of each force."""
    force_ports: tuple[int, ...]
    """Index of the port at which each force acts."""
    parameters: tuple[FloatArray, ...]
    """Parameters of each force's law."""

    @property
    def reads_all_axes(self) -> bool:
        """Whether any law reads the motion of all axes and the commands."""
        return any(isinstance(action, AxisForce) and action.reads_all_axes for action in self.actions)


def build_bodies(model: MechanicalModel, effects: Sequence[PlacedEffect]) -> Bodies:
    """Build the bodies of a model with those of the effects that change the structure or add a motion-dependent force;
    other effects are ignored. Raises ValueError for an axis that is not there, and as the `pack` of an action does."""
    structure = model
    for placed_effect in effects:
        for site in (
            placed_effect.sites if isinstance(placed_effect.effect.action, (Structure, AxisForce, JointForce)) else ()
        ):
            if not 0 <= site < model.inputs:
                raise ValueError(
                    f"{placed_effect.effect.name} is placed at axis {site + 1}; the model has {model.inputs}"
                )
        if isinstance(placed_effect.effect.action, Structure):
            for site in placed_effect.sites:
                structure = placed_effect.effect.action.change(structure, site, placed_effect.values)
    ports = list(compute_driven_axes(structure).T)
    actions: list[AxisForce | JointForce] = []
    port_indices: list[int] = []
    parameters: list[FloatArray] = []
    # Joints first: the parameters of forces at an axis are then packed for the structure with joints.
    for placed_effect in sorted(effects, key=lambda effect: isinstance(effect.effect.action, AxisForce)):
        action = placed_effect.effect.action
        for site in placed_effect.sites if isinstance(action, (AxisForce, JointForce)) else ():
            assert isinstance(action, (AxisForce, JointForce))
            parameters.append(np.asarray(action.pack(structure, site, placed_effect.values), dtype=np.float64))
            actions.append(action)
            if isinstance(action, JointForce):
                structure, direction = action.change(structure, site, placed_effect.values)
                ports.append(direction)
            port_indices.append(len(ports) - 1 if isinstance(action, JointForce) else site)
    # Ports that were found before a joint added coordinates are padded with zeros.
    padded_ports = np.zeros((structure.coordinates, len(ports)))
    for index, port in enumerate(ports):
        padded_ports[: len(port), index] = port
    return Bodies(structure, model.inputs, padded_ports, tuple(actions), tuple(port_indices), tuple(parameters))


@dataclass(frozen=True, slots=True, eq=False)
class Restarts:
    """Restarts of a simulation from given states (multiple shooting)."""

    sample_indices: npt.NDArray[np.int64]
    """(k,): indices of samples, ascending; the simulation is from rest up to the first of them."""
    states: FloatArray
    """(k, 2n): positions, then velocities, of the coordinates of the model without effects."""


def simulate_bodies(
    bodies: Bodies, actuator_force: ActuatorForce, counts: tuple[int, int], step_s: float, with_motion: bool = True,
    restarts: Restarts | None = None,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Simulate the bodies, from rest or from the states of `restarts`.

    Returns two arrays: (n, 3 r + 2 p), the positions, velocities and accelerations of the ports, the response, and the
    positions of the response's rows; and (n, r), the forces at the ports (0 where none acts). Without `with_motion` (n,
    2 p) and (n, 0). actuator_force: one row per sample, or per step. counts: number of samples n, and of steps per
    sample. step_s: length of a step. Raises ValueError as `pack_kernel_forces` does.
    """
    discrete_model, stepping, port_ids = _prepare_steps(bodies, actuator_force, counts, step_s)
    stride = len(actuator_force.mean) // counts[0]
    output_matrix = _assemble_output_matrix(discrete_model, stepping.state_from_modal, port_ids, with_motion)
    motion_rows, port_forces = (
        np.empty((counts[0], output_matrix.shape[1])),
        np.zeros((counts[0], bodies.ports.shape[1] if with_motion else 0)),
    )
    force_columns, rows_per_sample = len(output_matrix) - actuator_force.end.shape[1], stepping.rows_per_sample
    mean_force, end_force = (
        actuator_force.mean.reshape(counts[0] * rows_per_sample, -1),
        actuator_force.end[stride - 1 :: stride],
    )
    buffer = np.zeros((min(stepping.samples_per_block, counts[0]) * rows_per_sample, len(output_matrix)))
    # Overflow is no error: a fit may try an unstable model.
    with np.errstate(over="ignore", invalid="ignore"):
        for first, stop in _iterate_blocks(counts[0], stepping.samples_per_block, restarts):
            if restarts is not None and first in restarts.sample_indices:
                state = restarts.states[np.searchsorted(restarts.sample_indices, first)]
                stepping.set_state(extend_state(bodies.structure, state, bodies.ports[:, bodies.axes :]))
            rows_of_block = buffer[: (stop - first) * rows_per_sample]
            np.matmul(
                mean_force[first * rows_per_sample : stop * rows_per_sample],
                stepping.input_matrix,
                out=rows_of_block[:, :force_columns],
            )
            stepping.run(rows_of_block, first)
            input_rows = rows_of_block[::rows_per_sample]
            # An acceleration depends on the actuator force at the instant itself, not on the mean over the last step.
            input_rows[0, force_columns:], input_rows[1:, force_columns:] = (
                end_force[first - 1] if first else 0.0,
                end_force[first : stop - 1],
            )
            np.matmul(input_rows, output_matrix, out=motion_rows[first:stop])
            if with_motion:
                port_forces[first:stop, list(port_ids)] = input_rows[:, len(stepping.state_from_modal) : force_columns]
    return motion_rows, port_forces


def simulate_states(
    bodies: Bodies,
    actuator_force: ActuatorForce,
    counts: tuple[int, int],
    step_s: float,
    sample_indices: npt.NDArray[np.int64],
) -> FloatArray:
    """Simulate, from rest, the positions and velocities (k, 2n) of the structure's coordinates just before the samples
    `sample_indices` (k,). Other arguments as for `simulate_bodies`."""
    _, stepping, _ = _prepare_steps(bodies, actuator_force, counts, step_s)
    states, rows_per_sample = np.zeros((len(sample_indices), len(stepping.state_from_modal))), stepping.rows_per_sample
    mean_force = actuator_force.mean.reshape(counts[0] * rows_per_sample, -1)
    with np.errstate(over="ignore", invalid="ignore"):
        for first, stop in _iterate_blocks(counts[0], stepping.samples_per_block, None):
            rows_of_block = np.ascontiguousarray(
                mean_force[first * rows_per_sample : stop * rows_per_sample] @ stepping.input_matrix
            )
            stepping.run(rows_of_block, first)
            is_in_block = (sample_indices >= first) & (sample_indices < stop)
            states[is_in_block] = (
                rows_of_block[(sample_indices[is_in_block] - first) * rows_per_sample, : len(stepping.state_from_modal)]
                @ stepping.state_from_modal.T
            )
    return states


def _prepare_steps(
    bodies: Bodies, actuator_force: ActuatorForce, counts: tuple[int, int], step_s: float
) -> tuple[DiscreteModel, Stepping, tuple[int, ...]]:
    """Prepare a simulation: matrices of a linear step, stepping function, and indices of the ports at which forces act
    or motion is read."""
    discrete_model = discretise_model(bodies.structure, step_s, bodies.ports)
    port_ids = tuple(sorted({*bodies.force_ports, *range(bodies.axes if bodies.reads_all_axes else 0)}))
    steps, stride = (counts[1], len(actuator_force.mean) // counts[0])
    if not port_ids:
        return discrete_model, build_unforced_stepping(discrete_model, steps, stride), port_ids
    commands = actuator_force.mean if actuator_force.commanded is None else actuator_force.commanded
    return (
        discrete_model,
        build_forced_stepping(discrete_model, pack_kernel_forces(bodies, port_ids), steps, stride, commands),
        port_ids,
    )


def _iterate_blocks(sample_count: int, max_length: int, restarts: Restarts | None) -> Iterator[tuple[int, int]]:
    """Iterate over ranges (first, end) of at most `max_length` samples, in order; a block begins at each restart."""
    block_starts = (
        sorted({0, *restarts.sample_indices[restarts.sample_indices < sample_count].tolist()})
        if restarts is not None
        else [0]
    )
    for start, stop in zip(block_starts, (*block_starts[1:], sample_count), strict=True):
        for first in range(start, stop, max_length):
            yield first, min(first + max_length, stop)


def extend_state(structure: MechanicalModel, state: FloatArray, joints: FloatArray) -> FloatArray:
    """Extend a state of the model without effects to that (2n,) of the structure, whose last coordinates effects have
    added. joints: (n, j), directions of the joints.

    The added coordinates take the static equilibrium with zero travel of the joints, in the sense of least squares
    (minimum norm where it is not unique), and move with it.
    """
    model_coordinates, structure_coordinates = len(state) // 2, structure.coordinates
    if structure_coordinates == model_coordinates:
        return state
    equilibrium_rows = np.vstack([structure.stiffness[model_coordinates:], joints.T])
    added_stiffness, coupling = equilibrium_rows[:, model_coordinates:], equilibrium_rows[:, :model_coordinates]
    added_per_model = -np.linalg.lstsq(added_stiffness, coupling, rcond=None)[0]
    positions, velocities = state[:model_coordinates], state[model_coordinates:]
    return np.concatenate([positions, added_per_model @ positions, velocities, added_per_model @ velocities])


def _assemble_output_matrix(
    discrete_model: DiscreteModel, state_from_modal: FloatArray, port_ids: tuple[int, ...], with_motion: bool
) -> FloatArray:
    """Assemble the matrix (s + f + m, rows) from state, forces at the f ports and commands at an instant to the rows
    that `simulate_bodies` returns."""
    response_count, (command_count, port_count) = (
        len(discrete_model.position),
        (discrete_model.state_by_command.shape[1], discrete_model.state_by_port_force.shape[1]),
    )
    first_row = 0 if with_motion else 3 * port_count
    from_state = np.vstack((discrete_model.motion, discrete_model.response, discrete_model.position))[first_row:]
    from_force = np.vstack(
        (
            discrete_model.motion_by_port_force,
            discrete_model.response_by_port_force,
            np.zeros((response_count, port_count)),
        )
    )[first_row:]
    from_command = np.vstack(
        (
            discrete_model.motion_by_command,
            discrete_model.response_by_command,
            np.zeros((response_count, command_count)),
        )
    )[first_row:]
    return np.vstack([(from_state @ state_from_modal).T, from_force.T[list(port_ids)], from_command.T])


def pack_kernel_forces(bodies: Bodies, port_ids: tuple[int, ...]) -> Forces:
    """Pack the forces in the form of the compiled kernel: each distinct law once, and for every force the indices of
    its law and port and the ranges of its parameters and memory. port_ids: indices in `Bodies.ports`, among which the
    kernel counts the ports. Raises ValueError for more than `MAX_LAWS` distinct laws."""
    laws: list[object] = []
    force_indices: list[tuple[int, ...]] = []
    parameter_count = memory_count = 0
    for action, port, parameters in zip(bodies.actions, bodies.force_ports, bodies.parameters, strict=True):
        if action.law not in laws:
            laws.append(action.law)
        force_indices.append(
            (
                laws.index(action.law),
                port_ids.index(port),
                parameter_count,
                parameter_count + len(parameters),
                memory_count,
                memory_count + action.memory,
            )
        )
        parameter_count, memory_count = parameter_count + len(parameters), memory_count + action.memory
    if len(laws) > MAX_LAWS:
        raise ValueError(f"{len(laws)} different force laws act at once; simulate at most {MAX_LAWS}")
    return Forces(
        port_ids,
        tuple(wrap_law(law) for law in (*laws, *(compute_zero_force,) * (MAX_LAWS - len(laws)))),
        np.array(force_indices, dtype=np.int64).reshape(-1, 6),
        np.concatenate([*bodies.parameters, [0.0]]),
        np.zeros(memory_count + 1),
        any(action.acceleration for action in bodies.actions),
        bodies.reads_all_axes,
    )
