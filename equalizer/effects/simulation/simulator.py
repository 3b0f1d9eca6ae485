"""Plays commands through a mechanical model with its effects: actuator, mechanism and hand, sensor, in this order."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.effects.effect import STEPS, OnResponse, PlacedEffect
from equalizer.effects.simulation.bodies import Restarts, bodies_of, moved
from equalizer.effects.simulation.command_path import driven_by, finer, moves_between_samples
from equalizer.effects.simulation.sensor_path import low_passed, within_range
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What was measured of a response."""

    response: FloatArray
    """(n, p)"""
    noise: FloatArray
    """(p,): rms"""
    position: FloatArray | None = None
    """(n, p), of the same rows"""
    whole: int = 0
    """Samples of the recording that these are the first of; 0 = these are all."""


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
    seen: Seen | None = None,
) -> Played:
    """From rest. commands: (n, m), SI. `model.effects` are not played: see `equalizer.effects.placing`. seen: chance
    then decides as it must have.

    Raises ValueError where an effect befalls an axis that is not there.
    """
    return _sensed(model, _moved(model, commands, (sample_rate_hz, hold), effects), sample_rate_hz, effects, seen)


def simulate_response(
    model: MechanicalModel,
    commands: FloatArray,
    sample_rate_hz: float,
    effects: Sequence[PlacedEffect] = (),
    hold: Hold = Hold.ZERO_ORDER,
    seen: Seen | None = None,
) -> Played:
    """The same sooner, but the driven axes are not looked at: their arrays are (n, 0)."""
    played = _moved(model, commands, (sample_rate_hz, hold), effects, axes=False)
    return _sensed(model, played, sample_rate_hz, effects, seen)


def simulate_windows(
    model: MechanicalModel,
    commands: FloatArray,
    sampled: tuple[float, Hold],
    effects: Sequence[PlacedEffect],
    seen: Seen | None,
    restarts: Restarts,
) -> Played:
    """The same, but from given states again and again. sampled: rate in Hz, and how commands move between samples."""
    return _sensed(model, _moved(model, commands, sampled, effects, restarts=restarts), sampled[0], effects, seen)


def _moved(
    model: MechanicalModel,
    commands: FloatArray,
    sampled: tuple[float, Hold],
    effects: Sequence[PlacedEffect],
    axes: bool = True,
    restarts: Restarts | None = None,
) -> Played:
    """Before the sensor."""
    bodies, (rate_hz, hold) = bodies_of(model, effects), sampled
    moves = moves_between_samples(model, effects, hold)
    steps = max((acts.steps for acts in bodies.acts), default=STEPS if moves else 1)
    fine = steps if moves else 1
    driven = driven_by(model, finer(commands, fine, hold), 1 / (rate_hz * fine), effects)
    looked, added = moved(bodies, driven, (len(commands), steps), 1 / (rate_hz * steps), axes, restarts)
    m, p, ports = bodies.axes if axes else 0, bodies.structure.outputs, bodies.ports.shape[1]
    rows = looked[:, 3 * ports if axes else 0 :]
    return Played(rows[:, :p], rows[:, p:], looked[:, :m], looked[:, ports : ports + m], added[:, :m])


def _sensed(
    model: MechanicalModel, played: Played, sample_rate_hz: float, effects: Sequence[PlacedEffect], seen: Seen | None
) -> Played:
    on_response = [(placed.effect.acts, placed) for placed in effects if isinstance(placed.effect.acts, OnResponse)]
    on_response.sort(key=lambda item: item[0].stage)
    response, position = played.response, played.position
    for after_filter in (False, True):
        if after_filter:
            response = _filtered(response, sample_rate_hz, _bandwidths(model, response.shape[1], on_response))
        for acts, placed in on_response:
            if acts.after_filter is not after_filter:
                continue
            before = response
            if seen is not None and acts.given is not None:
                response = acts.given(response, seen.response, seen.noise, placed.sites, placed.values)
            else:
                response = _changed(acts, placed, response, sample_rate_hz, seen)
            if acts.on_position is not None:
                position = acts.on_position(position, sample_rate_hz, placed.values)
            if seen is not None and seen.position is not None and acts.given_position is not None:
                position = acts.given_position(before, response, position, seen.position)
    response = within_range(response, model.sensor.range)
    return Played(response, position, played.axis_position, played.axis_velocity, played.axis_force)


def _changed(
    acts: OnResponse, placed: PlacedEffect, response: FloatArray, sample_rate_hz: float, seen: Seen | None
) -> FloatArray:
    left_out = seen.whole - len(response) if acts.of_whole and seen is not None else 0
    if left_out <= 0:
        return acts.change(response, sample_rate_hz, placed.sites, placed.values)
    whole = np.pad(response, ((0, left_out), (0, 0)), mode="edge")
    return acts.change(whole, sample_rate_hz, placed.sites, placed.values)[: len(response)]


def _filtered(response: FloatArray, sample_rate_hz: float, bandwidths_hz: Sequence[float]) -> FloatArray:
    if len(set(bandwidths_hz)) == 1:
        return low_passed(response, sample_rate_hz, bandwidths_hz[0])
    each = [low_passed(row, sample_rate_hz, hz) for row, hz in zip(response.T, bandwidths_hz, strict=True)]
    return np.stack(each, axis=1)


def _bandwidths(
    model: MechanicalModel, channels: int, on_response: Sequence[tuple[OnResponse, PlacedEffect]]
) -> list[float]:
    found = [model.sensor.bandwidth_hz] * channels
    for acts, placed in on_response:
        for channel in placed.sites if acts.bandwidth_hz is not None else ():
            assert acts.bandwidth_hz is not None
            found[channel] = acts.bandwidth_hz(found[channel], placed.values)
    return found
