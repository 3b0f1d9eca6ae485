"""Converts a mechanical model with its effects to reversed signs of chosen commands.

The positive direction of a driven axis is that in which a positive command pushes. Where the sign of the command is
reversed, the coordinate x of the axis and all forces along it reverse too: F(x, v) becomes -F(-x, -v). Odd laws, such
as friction or springs, stay the same; `SIGN_REVERSED`, `SWAPPED` and `TILTED` list the parameters of other laws that
change.
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
"""Effects that depend on the sign of the axis, and their parameters that change sign with it."""
SWAPPED = {"asymmetric_friction": ("level_positive", "level_negative")}
"""Effects with one parameter per direction of motion; the two values are exchanged."""
TILTED = {"extra_mode": ("tilt_next", "tilt_after_next")}
"""Parameters that couple an axis to the next axis and the one after it; they change sign where one of the two axes is
reversed and the other is not."""


def with_reversed_commands(
    model: MechanicalModel, signs: Sequence[float], inputs: tuple[str, ...], outputs: tuple[str, ...]
) -> MechanicalModel:
    """The model whose response to the command times `signs` (1 or -1 per input) equals that of `model` to the command.
    inputs, outputs: channel names. Raises PlacingError for an effect on an unknown axis."""
    way = np.asarray(signs, dtype=np.float64)
    effects = [each for effect in model.effects for each in _reverse_effects(model, effect, way, (inputs, outputs))]
    return replace(model, input=model.input * way, effects=tuple(effects))


def _reverse_effects(
    model: MechanicalModel, effect: ModelEffect, way: FloatArray, channels: tuple[tuple[str, ...], tuple[str, ...]]
) -> tuple[ModelEffect, ...]:
    """The effect for the reversed axes; one entry per axis where an effect that depends on the sign acts on several."""
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
    """The effect's parameters at axis `site`. way: (m,), 1 or -1 per axis."""
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
    """The law with the signals of reversed axes negated in its formula, and its result negated where its own axis
    (site) is reversed."""
    inputs, outputs = channels
    letters, against = axis_names(inputs), set[str]()
    for axis in np.flatnonzero(way < 0):
        against |= {inputs[axis], *(prefix + letters[axis] for prefix in (*DERIVATIVES, COMMAND))}
        against |= {outputs[axis]} if len(outputs) == len(inputs) else set()
    tree = _negate_variables(law.tree, against)
    return replace(law, expression=format_formula(Apply("neg", (tree,)) if way[site] < 0 else tree, None, None))


def _negate_variables(node: Node, against: set[str]) -> Node:
    """The syntax tree with each variable named in `against` replaced by its negative."""
    match node:
        case Variable(name) if name in against:
            return Apply("neg", (node,))
        case Apply(name, parts):
            return Apply(name, tuple(_negate_variables(part, against) for part in parts))
    return node
