"""The bodies of a model with its effects: another structure, forces in it, and their motion under a driven command."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba.core.errors import NumbaExperimentalFeatureWarning

from equalizer.effects.command_path import Driven
from equalizer.effects.effect import AxisForce, JointForce, PlacedEffect, Structure
from equalizer.effects.mechanism_kernel import LAWS, Integers, Three, no_force, play
from equalizer.plant.linear_simulation import LinearSteps, driven_axes, linear_steps
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Bodies:
    """What moves, and what pushes it."""

    structure: MechanicalModel
    axes: int
    """How many are driven."""
    ports: FloatArray
    """(n, r): the directions along which forces act; the driven axes first, then joints."""
    acts: tuple[AxisForce | JointForce, ...]
    """One per force."""
    port: tuple[int, ...]
    numbers: tuple[FloatArray, ...]
    """What each force's law finds in `of`."""


def bodies_of(model: MechanicalModel, effects: Sequence[PlacedEffect]) -> Bodies:
    """Raises ValueError where an effect befalls an axis that is not there."""
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
    numbers: list[FloatArray] = []
    # Joints come first: friction that is found after them knows what they do.
    for placed in sorted(effects, key=lambda one: isinstance(one.effect.acts, AxisForce)):
        act = placed.effect.acts
        for site in placed.sites if isinstance(act, (AxisForce, JointForce)) else ():
            assert isinstance(act, (AxisForce, JointForce))
            numbers.append(np.asarray(act.pack(structure, site, placed.values), dtype=np.float64))
            acts.append(act)
            if isinstance(act, JointForce):
                structure, along = act.change(structure, site, placed.values)
                ports.append(along)
            where.append(len(ports) - 1 if isinstance(act, JointForce) else site)
    aligned = np.zeros((structure.coordinates, len(ports)))
    for number, port in enumerate(ports):
        aligned[: len(port), number] = port
    return Bodies(structure, model.inputs, aligned, tuple(acts), tuple(where), tuple(numbers))


def moved(bodies: Bodies, driven: Driven, size: tuple[int, int], step_s: float) -> tuple[FloatArray, FloatArray]:
    """(n, 3 r + 2 p): the ports' positions, velocities and accelerations, the response and its rows' positions; and
    (n, r), the forces. driven: n or n steps; size: n and steps."""
    linear = linear_steps(bodies.structure, step_s, bodies.ports)
    look = _transposed(_looked_at(linear))
    looked, added = np.empty((size[0], look[0].shape[1])), np.empty((size[0], bodies.ports.shape[1]))
    laws, places, of, memory = _items(bodies)
    mean = np.require(driven.mean, requirements=["C", "W"])
    with warnings.catch_warnings():
        # numba calls functions that are passed as values an experimental feature.
        warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
        play(
            laws, places, of, memory, _transposed((linear.advance, linear.by_command, linear.by_axis_force)), look,
            _whole((linear.motion, linear.motion_by_command, linear.motion_by_axis_force)),
            mean, np.zeros(linear.advance.shape[0]), (looked, added), size[1], step_s,
        )  # fmt: skip
    if driven.end is not driven.mean:
        # An acceleration shows the force of its very instant, not the last step's mean.
        last = slice(len(driven.mean) // size[0] - 1, None, len(driven.mean) // size[0])
        looked[1:] += (driven.end - driven.mean)[last][:-1] @ look[1]
    return looked, added


def _looked_at(linear: LinearSteps) -> Three:
    p, (m, r) = len(linear.position), (linear.by_command.shape[1], linear.by_axis_force.shape[1])
    return (
        np.vstack((linear.motion, linear.response, linear.position)),
        np.vstack((linear.motion_by_command, linear.response_by_command, np.zeros((p, m)))),
        np.vstack((linear.motion_by_axis_force, linear.response_by_axis_force, np.zeros((p, r)))),
    )


def _transposed(parts: Three) -> Three:
    return _whole((parts[0].T, parts[1].T, parts[2].T))


def _whole(parts: Three) -> Three:
    first, second, third = (np.ascontiguousarray(part) for part in parts)
    return first, second, third


def _items(bodies: Bodies) -> tuple[tuple[object, ...], Integers, FloatArray, FloatArray]:
    laws: list[object] = []
    places: list[tuple[int, ...]] = []
    used = kept = 0
    for act, port, numbers in zip(bodies.acts, bodies.port, bodies.numbers, strict=True):
        if act.law not in laws:
            laws.append(act.law)
        places.append((laws.index(act.law), port, used, used + len(numbers), kept, kept + act.memory))
        used, kept = used + len(numbers), kept + act.memory
    if len(laws) > LAWS:
        raise ValueError(f"{len(laws)} different forces act at once; at most {LAWS} can be played")
    where: Integers = np.array(places, dtype=np.int64).reshape(-1, 6)
    return (
        (*laws, *(no_force,) * (LAWS - len(laws))),
        where,
        np.concatenate([*bodies.numbers, [0.0]]),
        np.zeros(kept + 1),
    )
