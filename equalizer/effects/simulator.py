"""Plays commands through a mechanical model with its effects: actuator, mechanism and hand, sensor, in this order."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba.core.errors import NumbaExperimentalFeatureWarning

from equalizer.effects.command_path import delayed, finer, lagged
from equalizer.effects.effect import AxisForce, OnCommand, OnResponse, PlacedEffect, Structure
from equalizer.effects.mechanism_kernel import LAWS, no_force, play
from equalizer.effects.sensor_path import low_passed, within_range
from equalizer.plant.linear_simulation import LinearSteps, linear_steps
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray

STEPS = 4
"""Per sample, where a force depends on the motion or a command moves between samples."""


@dataclass(frozen=True, slots=True, eq=False)
class Played:
    """Taken just before each command is written."""

    response: FloatArray
    """(n, p): as the sensor reads it, without noise."""
    position: FloatArray
    """(n, p): the same rows' positions."""
    axis_position: FloatArray
    """(n, m), along the driven axes"""
    axis_velocity: FloatArray
    """(n, m)"""
    axis_force: FloatArray
    """(n, m): what effects of the motion add there, N."""


def simulate_mechanism(
    model: MechanicalModel,
    commands: FloatArray,
    sample_rate_hz: float,
    effects: Sequence[PlacedEffect] = (),
    hold: Hold = Hold.ZERO_ORDER,
) -> Played:
    """From rest. commands: (n, m), SI. `model.effects` are not played: see `equalizer.effects.placing`.

    Raises ValueError where an effect befalls an axis that is not there.
    """
    structure = model
    for placed in effects:
        if isinstance(placed.effect.acts, Structure):
            for site in placed.sites:
                structure = placed.effect.acts.change(structure, site, placed.values)
    forces = [placed for placed in effects if isinstance(placed.effect.acts, AxisForce)]
    moves = moves_between_samples(model, effects, hold)
    steps = STEPS if forces or moves else 1
    step_s = 1 / (sample_rate_hz * steps)
    driven = driven_by(
        model, finer(commands, steps if moves else 1, hold), step_s if moves else steps * step_s, effects
    )
    played = _moved(structure, linear_steps(structure, step_s), driven, forces, (len(commands), steps))
    return _sensed(model, played, sample_rate_hz, effects)


def moves_between_samples(model: MechanicalModel, effects: Sequence[PlacedEffect], hold: Hold) -> bool:
    """Whether the force changes between two commands."""
    fine = any(isinstance(placed.effect.acts, OnCommand) and placed.effect.acts.fine for placed in effects)
    return fine or hold is not Hold.ZERO_ORDER or model.actuator.delay_s > 0 or model.actuator.bandwidth_hz > 0


def driven_by(
    model: MechanicalModel, commands: FloatArray, step_s: float, effects: Sequence[PlacedEffect]
) -> FloatArray:
    """What the actuators make of commands (n, m): first the left-out effects, then what the model knows of them."""
    driven = np.array(commands, dtype=np.float64)
    for placed in effects:
        if isinstance(placed.effect.acts, OnCommand):
            for site in placed.sites:
                driven[:, site] = placed.effect.acts.change(driven[:, site], step_s, placed.values)
    known = model.actuator
    if known.bandwidth_hz > 0:
        driven = lagged(driven, step_s, 1 / (2 * np.pi * known.bandwidth_hz))
    driven = delayed(driven, step_s, known.delay_s) if known.delay_s > 0 else driven
    return np.clip(driven, -known.limit, known.limit) if known.limit > 0 else driven


def _moved(
    model: MechanicalModel,
    linear: LinearSteps,
    driven: FloatArray,
    forces: Sequence[PlacedEffect],
    size: tuple[int, int],
) -> Played:
    m = driven.shape[1]
    laws, places, of, memory = _items(model, forces)
    look = tuple(
        np.ascontiguousarray(np.vstack(rows).T)
        for rows in (
            (linear.motion, linear.response, linear.position),
            (linear.motion_by_command, linear.response_by_command, np.zeros((len(linear.position), m))),
            (linear.motion_by_axis_force, linear.response_by_axis_force, np.zeros((len(linear.position), m))),
        )
    )
    advance = tuple(np.ascontiguousarray(part.T) for part in (linear.advance, linear.by_command, linear.by_axis_force))
    per_newton = np.einsum("rks,sk->kr", linear.motion.reshape(3, m, -1), linear.by_axis_force)
    per_newton[:, 2] = np.diagonal(linear.motion_by_axis_force[2 * m :])
    looked, added = np.empty((size[0], look[0].shape[1])), np.empty((size[0], m))
    with warnings.catch_warnings():
        # numba calls functions that are passed as values an experimental feature.
        warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
        play(
            laws, places, of, memory, advance, look, np.ascontiguousarray(per_newton), np.ascontiguousarray(driven),
            np.zeros(linear.advance.shape[0]), (looked, added), size[1], linear.step_s,
        )  # fmt: skip
    p = len(linear.response)
    return Played(looked[:, 3 * m : 3 * m + p], looked[:, 3 * m + p :], looked[:, :m], looked[:, m : 2 * m], added)


def _items(
    model: MechanicalModel, forces: Sequence[PlacedEffect]
) -> tuple[tuple[object, ...], FloatArray, FloatArray, FloatArray]:
    laws: list[object] = []
    places: list[tuple[int, ...]] = []
    numbers: list[FloatArray] = []
    used = kept = 0
    for placed in forces:
        acts = placed.effect.acts
        assert isinstance(acts, AxisForce)
        if acts.law not in laws:
            laws.append(acts.law)
        for site in placed.sites:
            if not 0 <= site < model.inputs:
                raise ValueError(f"{placed.effect.name} is placed at axis {site + 1}; the model has {model.inputs}")
            packed = np.asarray(acts.pack(model, site, placed.values), dtype=np.float64)
            places.append((laws.index(acts.law), site, used, used + len(packed), kept, kept + acts.memory))
            numbers.append(packed)
            used, kept = used + len(packed), kept + acts.memory
    if len(laws) > LAWS:
        raise ValueError(f"{len(laws)} different forces act at once; at most {LAWS} can be played")
    padded = (*laws, *(no_force,) * (LAWS - len(laws)))
    where = np.array(places, dtype=np.int64).reshape(-1, 6)
    return padded, where, np.concatenate([*numbers, np.zeros(1)]), np.zeros(kept + 1)


def _sensed(model: MechanicalModel, played: Played, sample_rate_hz: float, effects: Sequence[PlacedEffect]) -> Played:
    on_response = [placed for placed in effects if isinstance(placed.effect.acts, OnResponse)]
    response = np.array(played.response)
    for after_filter in (False, True):
        if after_filter:
            response = low_passed(response, sample_rate_hz, model.sensor.bandwidth_hz)
        for placed in on_response:
            acts = placed.effect.acts
            if isinstance(acts, OnResponse) and acts.after_filter is after_filter:
                response = acts.change(response, sample_rate_hz, placed.sites, placed.values)
    response = within_range(response, model.sensor.range)
    return Played(response, played.position, played.axis_position, played.axis_velocity, played.axis_force)
