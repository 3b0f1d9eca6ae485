"""Conversion of a mechanical model with its effects to reversed signs of chosen commands.

The positive direction of a driven axis is that in which a positive command pushes. Where the sign of the command is
reversed, the coordinate x of the axis and all forces along it reverse too: F(x, v) becomes -F(-x, -v). Odd laws, such
as friction or springs, stay the same; `SIGN_REVERSED`, `DIRECTION_PAIRS` and `CROSS_AXIS_TILTS` list the parameters of
other effects that change.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from equalizer.effects.discovered_law import COMMAND_PREFIX, DERIVATIVE_PREFIXES, derive_axis_letters
from equalizer.effects.placing import find_sites, shorten_axis_name
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
DIRECTION_PAIRS = {"asymmetric_friction": ("level_positive", "level_negative")}
"""Effects with one parameter per direction of motion; the two values are exchanged."""
CROSS_AXIS_TILTS = {"extra_mode": ("tilt_next", "tilt_after_next")}
"""Parameters that couple an axis to the next axis and the one after it; they change sign where one of the two axes is
reversed and the other is not."""


def reverse_commands(
    model: MechanicalModel, signs: Sequence[float], inputs: tuple[str, ...], outputs: tuple[str, ...]
) -> MechanicalModel:
    """Convert a model such that its response to the command times `signs` (1 or -1 per input) equals that of `model` to
    the command. inputs, outputs: channel names. Raises PlacingError for a sign-dependent effect on an unknown axis."""
    axis_signs = np.asarray(signs, dtype=np.float64)
    effects = [
        reversed_effect
        for effect in model.effects
        for reversed_effect in _reverse_effects(model, effect, axis_signs, (inputs, outputs))
    ]
    return replace(model, input=model.input * axis_signs, effects=tuple(effects))


def _reverse_effects(
    model: MechanicalModel,
    effect: ModelEffect,
    axis_signs: FloatArray,
    channels: tuple[tuple[str, ...], tuple[str, ...]],
) -> tuple[ModelEffect, ...]:
    """Convert one effect for the reversed axes; one entry per axis where a sign-dependent effect acts on several."""
    inputs, outputs = channels
    if effect.law is None and effect.kind not in (*SIGN_REVERSED, *DIRECTION_PAIRS, *CROSS_AXIS_TILTS):
        return (effect,)
    if effect.law is not None and effect.law.acts_on == "response":
        return (effect,)
    sites = find_sites(effect, inputs, outputs)
    if effect.law is not None:
        return (replace(effect, law=_reverse_law(effect.law, sites[0], axis_signs, channels)),)
    letters = [effect.axis] if effect.axis is not None else [shorten_axis_name(inputs[site], inputs) for site in sites]
    return tuple(
        replace(effect, axis=letter, parameters=_reverse_parameters(effect, site, axis_signs))
        for site, letter in zip(sites, letters, strict=True)
    )


def _reverse_parameters(effect: ModelEffect, site: int, axis_signs: FloatArray) -> dict[str, float]:
    """Convert the parameters of an effect at axis `site` (index). axis_signs: (m,), 1 or -1 per axis."""
    values = dict(effect.parameters)
    for offset, name in enumerate(CROSS_AXIS_TILTS.get(effect.kind, ()), start=1):
        if name in values:
            values[name] *= float(axis_signs[site] * axis_signs[(site + offset) % len(axis_signs)])
    if axis_signs[site] > 0:
        return values
    for parameter in SIGN_REVERSED.get(effect.kind, ()):
        if parameter in values:
            values[parameter] = -values[parameter]
    if effect.kind in DIRECTION_PAIRS:
        positive_name, negative_name = DIRECTION_PAIRS[effect.kind]
        values[positive_name], values[negative_name] = values[negative_name], values[positive_name]
    return values


def _reverse_law(law: Law, site: int, axis_signs: FloatArray, channels: tuple[tuple[str, ...], tuple[str, ...]]) -> Law:
    """Negate the signals of reversed axes in the formula of a law, and its result where its axis (`site`) is reversed.
    Responses are negated only where there is one per command."""
    inputs, outputs = channels
    letters, reversed_names = derive_axis_letters(inputs), set[str]()
    for axis in np.flatnonzero(axis_signs < 0):
        reversed_names |= {inputs[axis], *(prefix + letters[axis] for prefix in (*DERIVATIVE_PREFIXES, COMMAND_PREFIX))}
        reversed_names |= {outputs[axis]} if len(outputs) == len(inputs) else set()
    tree = _negate_variables(law.tree, reversed_names)
    return replace(law, expression=format_formula(Apply("neg", (tree,)) if axis_signs[site] < 0 else tree, None, None))


def _negate_variables(node: Node, reversed_names: set[str]) -> Node:
    """Replace each variable named in `reversed_names` by its negative in a syntax tree."""
    match node:
        case Variable(name) if name in reversed_names:
            return Apply("neg", (node,))
        case Apply(name, parts):
            return Apply(name, tuple(_negate_variables(part, reversed_names) for part in parts))
    return node
