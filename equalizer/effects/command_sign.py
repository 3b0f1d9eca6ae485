"""A mechanical model of the same device with the sign of chosen commands reversed.

An axis points where its command pushes. With the command, the sign of its coordinate and of every force along it
reverses: F(x, v) becomes -F(-x, -v). Most laws are odd and stay the same; the table lists the parameters of the others
that change.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from equalizer.effects.discovered_law import COMMAND, DERIVATIVES, axis_names
from equalizer.effects.placing import axis_letter, find_sites
from equalizer.laws.law import Law
from equalizer.laws.tree import Apply, Node, Variable, format_formula
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.signals.signal import FloatArray

SIGN_REVERSED: Mapping[str, tuple[str, ...]] = {
    "constant_force": ("force",), "position_dependent_friction": ("slope_per_m",), "asymmetric_stiffness": ("k2",),
    "gravity_torque": ("angle",), "cogging": ("phase",), "end_stop": ("position", "side"),
    "pose_dependent_inertia": ("per_m",),
}  # fmt: skip
"""Effects that differ with the direction, and their parameters that change their sign."""
SWAPPED = {"asymmetric_friction": ("level_positive", "level_negative")}
TILTED = {"extra_mode": ("tilt_next", "tilt_after_next")}
"""Parameters that couple an axis to those after it."""


def with_reversed_commands(
    model: MechanicalModel, signs: Sequence[float], inputs: tuple[str, ...], outputs: tuple[str, ...]
) -> MechanicalModel:
    """Return the model whose answer to the command times `signs`, 1 or -1 each, is that of `model` to the command.
    Raises PlacingError."""
    way = np.asarray(signs, dtype=np.float64)
    effects = [each for effect in model.effects for each in _reverse_effects(model, effect, way, (inputs, outputs))]
    return replace(model, input=model.input * way, effects=tuple(effects))


def _reverse_effects(
    model: MechanicalModel, effect: ModelEffect, way: FloatArray, channels: tuple[tuple[str, ...], tuple[str, ...]]
) -> tuple[ModelEffect, ...]:
    """One; one per axis where it differs with the direction and stood at all of them."""
    inputs, outputs = channels
    if effect.law is None and effect.kind not in (*SIGN_REVERSED, *SWAPPED, *TILTED):
        return (effect,)
    if effect.law is not None and effect.law.acts_on == "response":
        return (effect,)
    sites = find_sites(effect, inputs, outputs)
    if effect.law is not None:
        return (replace(effect, law=_reverse_law(effect.law, sites[0], way, channels)),)
    letters = [effect.axis] if effect.axis is not None else [axis_letter(inputs[site], inputs) for site in sites]
    return tuple(
        replace(effect, axis=letter, parameters=_reverse_parameters(effect, site, way))
        for site, letter in zip(sites, letters, strict=True)
    )


def _reverse_parameters(effect: ModelEffect, site: int, way: FloatArray) -> dict[str, float]:
    numbers = dict(effect.parameters)
    for place, name in enumerate(TILTED.get(effect.kind, ()), start=1):
        if name in numbers:
            numbers[name] *= float(way[site] * way[(site + place) % len(way)])
    if way[site] > 0:
        return numbers
    for turned in SIGN_REVERSED.get(effect.kind, ()):
        if turned in numbers:
            numbers[turned] = -numbers[turned]
    if effect.kind in SWAPPED:
        first, second = SWAPPED[effect.kind]
        numbers[first], numbers[second] = numbers[second], numbers[first]
    return numbers


def _reverse_law(law: Law, site: int, way: FloatArray, channels: tuple[tuple[str, ...], tuple[str, ...]]) -> Law:
    """The formula with the signals of reversed axes negated, and its value too where its own axis is reversed."""
    inputs, outputs = channels
    letters, against = axis_names(inputs), set[str]()
    for axis in np.flatnonzero(way < 0):
        against |= {inputs[axis], *(prefix + letters[axis] for prefix in (*DERIVATIVES, COMMAND))}
        against |= {outputs[axis]} if len(outputs) == len(inputs) else set()
    tree = _negate_variables(law.tree, against)
    return replace(law, expression=format_formula(Apply("neg", (tree,)) if way[site] < 0 else tree, None, None))


def _negate_variables(node: Node, against: set[str]) -> Node:
    match node:
        case Variable(name) if name in against:
            return Apply("neg", (node,))
        case Apply(name, parts):
            return Apply(name, tuple(_negate_variables(part, against) for part in parts))
    return node
