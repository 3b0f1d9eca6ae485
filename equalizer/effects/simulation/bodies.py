"""The bodies of a model with its effects: the changed structure, its forces, and their motion under a driven
command."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.effects.effect import AxisForce, JointForce, PlacedEffect, Structure
from equalizer.effects.simulation.command_path import ActuatorForce
from equalizer.effects.simulation.mechanism_kernel import LAWS, law_address, no_force
from equalizer.effects.simulation.stepping import Forces, Stepping, step_with_forces, step_without_forces
from equalizer.plant.linear_simulation import LinearSteps, driven_axes, linear_steps
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """The linear structure with the effects' joints, and the forces that act on it."""

    structure: MechanicalModel
    axes: int
    """Number of driven axes."""
    ports: FloatArray
    """(n, r): the directions along which forces act; the driven axes first, then joints."""
    acts: tuple[AxisForce | JointForce, ...]
    """One per force: its law."""
    port: tuple[int, ...]
    """One per force: index of the port at which it acts."""
    parameters: tuple[FloatArray, ...]
    """Parameters of each force's law."""

    @property
    def sees(self) -> bool:
        """Whether a law reads all axes and commands."""
        return any(isinstance(act, AxisForce) and act.sees for act in self.acts)


def bodies_of(model: MechanicalModel, effects: Sequence[PlacedEffect]) -> Bodies:
    """Bodies of a model with its effects on structure and motion. Raises ValueError for an axis that is not there."""
    structure = model
    for placed in effects:
        for site in placed.sites if isinstance(placed.effect.acts, (Structure, AxisForce, JointForce)) else ():
            if not 0 <= site < model.inputs:
                raise ValueError(f"{placed.effect.name} is placed at axis {site + 1}; the model has {model.inputs}")
        if isinstance(placed.effect.acts, Structure):
            for site in placed.sites:
                structure = placed.effect.acts.change(structure, site, placed.values)
    ports = list(driven_axes(structure).T)
    acts: list[AxisForce | JointForce] = []
    where: list[int] = []
    parameters: list[FloatArray] = []
    # Joints come first, so that friction found after them acts on the structure with joints.
    for placed in sorted(effects, key=lambda effect: isinstance(effect.effect.acts, AxisForce)):
        act = placed.effect.acts
        for site in placed.sites if isinstance(act, (AxisForce, JointForce)) else ():
            assert isinstance(act, (AxisForce, JointForce))
            parameters.append(np.asarray(act.pack(structure, site, placed.values), dtype=np.float64))
            acts.append(act)
            if isinstance(act, JointForce):
                structure, along = act.change(structure, site, placed.values)
                ports.append(along)
            where.append(len(ports) - 1 if isinstance(act, JointForce) else site)
    aligned = np.zeros((structure.coordinates, len(ports)))
    for number, port in enumerate(ports):
        aligned[: len(port), number] = port
    return Bodies(structure, model.inputs, aligned, tuple(acts), tuple(where), tuple(parameters))


@dataclass(frozen=True, slots=True, eq=False)
class Restarts:
    """Restarts of a simulation from given states (multiple shooting)."""

    at: npt.NDArray[np.int64]
    """(k,): samples, rising; before the first of them, the simulation starts at rest."""
    states: FloatArray
    """(k, 2n), of the model without effects: positions, then velocities."""


def simulate_bodies(
    bodies: Bodies, driven: ActuatorForce, size: tuple[int, int], step_s: float, motion: bool = True,
    restarts: Restarts | None = None,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Simulate the bodies, from rest where there are no restarts. Returns (n, 3 r + 2 p): the ports' positions,
    velocities and accelerations, the response and its rows' positions; and (n, r), the forces. Without the motion
    (n, 2 p) and (n, 0). driven: n or n steps; size: n and steps."""
    linear, stepping, ports = _prepare_steps(bodies, driven, size, step_s)
    stride = len(driven.mean) // size[0]
    output = _output_matrix(linear, stepping.outward, ports, motion)
    motion_rows, added = (
        np.empty((size[0], output.shape[1])),
        np.zeros((size[0], bodies.ports.shape[1] if motion else 0)),
    )
    inner, rows = len(output) - driven.end.shape[1], stepping.rows
    drive, last = driven.mean.reshape(size[0] * rows, -1), driven.end[stride - 1 :: stride]
    spare = np.zeros((min(stepping.block, size[0]) * rows, len(output)))
    # A fit may try an unstable model.
    with np.errstate(over="ignore", invalid="ignore"):
        for first, end in _blocks(size[0], stepping.block, restarts):
            if restarts is not None and first in restarts.at:
                state = restarts.states[np.searchsorted(restarts.at, first)]
                stepping.begin(extend_state(bodies.structure, state, bodies.ports[:, bodies.axes :]))
            rows_of_block = spare[: (end - first) * rows]
            np.matmul(drive[first * rows : end * rows], stepping.into, out=rows_of_block[:, :inner])
            stepping.run(rows_of_block, first)
            inputs = rows_of_block[::rows]
            # An acceleration shows the force of its very instant, not the last step's mean.
            inputs[0, inner:], inputs[1:, inner:] = last[first - 1] if first else 0.0, last[first : end - 1]
            np.matmul(inputs, output, out=motion_rows[first:end])
            if motion:
                added[first:end, list(ports)] = inputs[:, len(stepping.outward) : inner]
    return motion_rows, added


def simulate_states(
    bodies: Bodies, driven: ActuatorForce, size: tuple[int, int], step_s: float, at: npt.NDArray[np.int64]
) -> FloatArray:
    """States just before given samples: positions and velocities of the structure's coordinates (k, 2n), simulated from
    rest. The other arguments: as for `simulate_bodies`."""
    _, stepping, _ = _prepare_steps(bodies, driven, size, step_s)
    states, rows = np.zeros((len(at), len(stepping.outward))), stepping.rows
    drive = driven.mean.reshape(size[0] * rows, -1)
    with np.errstate(over="ignore", invalid="ignore"):
        for first, end in _blocks(size[0], stepping.block, None):
            rows_of_block = np.ascontiguousarray(drive[first * rows : end * rows] @ stepping.into)
            stepping.run(rows_of_block, first)
            here = (at >= first) & (at < end)
            states[here] = rows_of_block[(at[here] - first) * rows, : len(stepping.outward)] @ stepping.outward.T
    return states


def _prepare_steps(
    bodies: Bodies, driven: ActuatorForce, size: tuple[int, int], step_s: float
) -> tuple[LinearSteps, Stepping, tuple[int, ...]]:
    """The linear steps, their stepping, and the ports at which forces act."""
    linear = linear_steps(bodies.structure, step_s, bodies.ports)
    ports = tuple(sorted({*bodies.port, *range(bodies.axes if bodies.sees else 0)}))
    steps, stride = size[1], len(driven.mean) // size[0]
    if not ports:
        return linear, step_without_forces(linear, steps, stride), ports
    commanded = driven.mean if driven.commanded is None else driven.commanded
    return linear, step_with_forces(linear, kernel_forces(bodies, ports), steps, stride, commanded), ports


def _blocks(n: int, longest: int, restarts: Restarts | None) -> Iterator[tuple[int, int]]:
    edges = sorted({0, *restarts.at[restarts.at < n].tolist()}) if restarts is not None else [0]
    for begin, stop in zip(edges, (*edges[1:], n), strict=True):
        for first in range(begin, stop, longest):
            yield first, min(first + longest, stop)


def extend_state(structure: MechanicalModel, state: FloatArray, joints: FloatArray) -> FloatArray:
    """State (2n,) of a structure to which effects have added bodies, its last coordinates: those take their static
    equilibrium, and where no spring holds them, the place at which their joint is at rest. state: without them. joints:
    (n, j), directions of the joints."""
    known, n = len(state) // 2, structure.coordinates
    if n == known:
        return state
    rows = np.vstack([structure.stiffness[known:], joints.T])
    held, tied = rows[:, known:], rows[:, :known]
    follows = -np.linalg.lstsq(held, tied, rcond=None)[0]
    positions, velocities = state[:known], state[known:]
    return np.concatenate([positions, follows @ positions, velocities, follows @ velocities])


def _output_matrix(linear: LinearSteps, outward: FloatArray, ports: tuple[int, ...], motion: bool) -> FloatArray:
    """(s + r + m, rows): output matrix for each instant's state, forces at the ports, and commands."""
    p, (m, r) = len(linear.position), (linear.by_command.shape[1], linear.by_axis_force.shape[1])
    first = 0 if motion else 3 * r
    of_state = np.vstack((linear.motion, linear.response, linear.position))[first:]
    of_force = np.vstack((linear.motion_by_axis_force, linear.response_by_axis_force, np.zeros((p, r))))[first:]
    of_command = np.vstack((linear.motion_by_command, linear.response_by_command, np.zeros((p, m))))[first:]
    return np.vstack([(of_state @ outward).T, of_force.T[list(ports)], of_command.T])


def kernel_forces(bodies: Bodies, ports: tuple[int, ...]) -> Forces:
    """The forces in the form of the compiled kernel: distinct laws once each; for every force the index of its law and
    port, and the ranges of its parameters and of its memory. Raises ValueError for too many laws."""
    laws: list[object] = []
    places: list[tuple[int, ...]] = []
    used = kept = 0
    for act, port, parameters in zip(bodies.acts, bodies.port, bodies.parameters, strict=True):
        if act.law not in laws:
            laws.append(act.law)
        places.append((laws.index(act.law), ports.index(port), used, used + len(parameters), kept, kept + act.memory))
        used, kept = used + len(parameters), kept + act.memory
    if len(laws) > LAWS:
        raise ValueError(f"{len(laws)} different force laws act at once; simulate at most {LAWS}")
    return Forces(
        ports,
        tuple(law_address(law) for law in (*laws, *(no_force,) * (LAWS - len(laws)))),
        np.array(places, dtype=np.int64).reshape(-1, 6),
        np.concatenate([*bodies.parameters, [0.0]]),
        np.zeros(kept + 1),
        any(act.acceleration for act in bodies.acts),
        bodies.sees,
    )
