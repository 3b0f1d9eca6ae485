"""Adapt the model and the effects to what differed during a recording: payload, conditions, signs of commands.

Three properties may differ between recordings of one device: a mass or inertia that it carried (keys of `meta`),
recorded conditions such as a temperature, on which effects depend, and the sign of commands.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite

import numpy as np

from analysis.diagnosis.data.measured_motion import fill_gaps, is_free_motion
from analysis.diagnosis.limits import MOST_GROWTH
from equalizer.effects.command_sign import reverse_commands
from equalizer.effects.effect import PlacedEffect
from equalizer.plant.linear_simulation import compute_driven_axes, compute_growth_rate
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording

ADDED_MASS_KEY, ADDED_INERTIA_KEY = "added_mass_kg", "added_inertia_kg_m2"
"""Keys of a recording's `meta`: mass (kg) or inertia (kg m^2) that the device carried along every driven axis, in
addition to the model's."""
REVERSED_CHANNELS_KEY = "turned commands"
"""Key of a recording's `meta`: names of the command channels whose sign was reversed."""


def add_payload(model: MechanicalModel, recording: Recording) -> MechanicalModel:
    """Add the payload, the mass or inertia that the device carried along every driven axis, as the recording's `meta`
    states; the model unchanged where it states none."""
    added_mass = recording.meta.get(_choose_payload_key(model), 0.0)
    return add_mass(model, float(added_mass)) if added_mass else model


def add_mass(model: MechanicalModel, added_mass: float) -> MechanicalModel:
    """Add `added_mass` kg (kg m^2) of mass (inertia) along every driven axis."""
    driven_axes = compute_driven_axes(model)
    return replace(model, mass=model.mass + added_mass * driven_axes @ driven_axes.T)


def is_unstable_within(model: MechanicalModel, longest_s: float) -> bool:
    """Whether undisturbed motion grows by more than `MOST_GROWTH` (growth rate x time) within `longest_s` seconds."""
    return compute_growth_rate(model) * longest_s > MOST_GROWTH


def apply_conditions(effects: Sequence[PlacedEffect], recording: Recording) -> tuple[PlacedEffect, ...]:
    """Apply the recording's conditions to the effects that depend on conditions; missing samples of these are
    interpolated. Without recorded conditions the effects are not changed."""
    condition = recording.condition
    if condition is None or all(placed_effect.effect.with_conditions is None for placed_effect in effects):
        return tuple(effects)
    samples, adapted_effects = fill_gaps(condition.samples), []
    for placed_effect in effects:
        with_conditions = placed_effect.effect.with_conditions
        if with_conditions is not None:
            placed_effect = replace(
                placed_effect,
                effect=replace(placed_effect.effect, action=with_conditions(samples, recording.sample_rate_hz)),
            )
        adapted_effects.append(placed_effect)
    return tuple(adapted_effects)


def adapt_to_recorded_commands(model: MechanicalModel, recording: Recording) -> MechanicalModel:
    """Adapt the model to the commands as they were recorded. model: for the recording as it is compared, in which
    commands may have been reversed. For a free motion, whose command is a force per unit mass, the model with unit
    masses."""
    if is_free_motion(recording):
        return replace(model, mass=np.eye(len(model.mass)))
    channels, reversed_channels = recording.command.channels, recording.meta.get(REVERSED_CHANNELS_KEY)
    if not isinstance(reversed_channels, Sequence) or not set(reversed_channels) & set(channels):
        return model
    signs = [-1.0 if channel in reversed_channels else 1.0 for channel in channels]
    return reverse_commands(model, signs, channels, recording.response.channels)


def find_payload_problems(
    model: MechanicalModel, recordings: Sequence[Recording], names: Sequence[str]
) -> tuple[str, ...]:
    """Find errors in the stated payloads (masses and inertias), as sentences without a full stop; empty where there are
    none."""
    key = _choose_payload_key(model)
    bad_key = ADDED_MASS_KEY if key == ADDED_INERTIA_KEY else ADDED_INERTIA_KEY
    problems = [
        f"{name} states {bad_key}, but the model's device {'rotates' if model.rotational else 'translates'}: "
        f"state {key}"
        for recording, name in zip(recordings, names, strict=True)
        if bad_key in recording.meta
    ]
    problems += [
        f"{name} states {key} = {recording.meta[key]!r}, which must be a number from 0 on"
        for recording, name in zip(recordings, names, strict=True)
        if key in recording.meta and not _is_valid_payload(recording.meta[key])
    ]
    return tuple(problems)


def has_payload(recordings: Sequence[Recording]) -> bool:
    """Whether any recording states a carried mass or inertia."""
    return any(key in recording.meta for recording in recordings for key in (ADDED_MASS_KEY, ADDED_INERTIA_KEY))


def _choose_payload_key(model: MechanicalModel) -> str:
    """Choose the key of `meta` that states the payload: a mass for a linear device, an inertia for a rotational one."""
    return ADDED_INERTIA_KEY if model.rotational else ADDED_MASS_KEY


def _is_valid_payload(value: object) -> bool:
    """Whether a value of `meta` is a finite number from 0 on."""
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value) and value >= 0
