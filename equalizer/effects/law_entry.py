"""Library entry of a discovered law: named effects that are searched for in other recordings like the catalogue's.

A law was found at one axis of one device. An entry yields one effect per axis of the new recording, with the axis
letters of its formula permuted cyclically, and starting values by linear regression.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.effects.discovered_law import (
    COMMAND,
    DERIVATIVES,
    LETTERS,
    Channels,
    axis_names,
    law_channels,
    law_effect,
    law_values,
)
from equalizer.effects.effect import Effect, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import axis_motion, regress_out_linear_terms
from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law, find_parameter_roles
from equalizer.laws.tree import Apply, Node, Variable, format_formula
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class LawEntry:
    """A discovered law in the library: name, formula, origin and features in the data."""

    name: str
    law: Law
    """The law with its starting parameters; `law.axis` is the axis at which it was found."""
    source: str
    """Origin of the law, as text."""
    signature: str
    """Features of the law in the data, as in `Effect.signature`."""


def library_effects(entries: Sequence[LawEntry], recording: Recording) -> tuple[Effect, ...]:
    """Effects of all entries at all axes, bound to the channels of a recording. Raises LawError for a signal that the
    recording lacks."""
    channels = law_channels(recording)
    return tuple(effect for entry in entries for effect in effects_per_axis(entry, channels))


def effects_per_axis(entry: LawEntry, channels: Channels) -> tuple[Effect, ...]:
    """One effect per axis, the formula moved to it by a cyclic permutation of the axis letters. Raises LawError where
    the recording lacks a signal."""
    letters = axis_names(channels.outputs if entry.law.acts_on == "response" else channels.inputs)
    effects = []
    for site in range(len(letters)):
        law = _move_to_axis(entry.law, letters, site)
        effect = law_effect(law, channels)
        effects.append(
            replace(
                effect, name=entry.name, source=entry.source, signature=entry.signature, starts=_make_starts(law, site)
            )
        )
    return tuple(effects)


def _move_to_axis(law: Law, letters: tuple[str, ...], site: int) -> Law:
    """The law at axis `site`: letters in its formula are shifted cyclically so that its own axis becomes that axis."""
    law_letter = law.axis[-1:]
    first = letters.index(law_letter) if law_letter in letters else 0
    permutation = {letter: letters[(index + site - first) % len(letters)] for index, letter in enumerate(letters)}
    permutation[law_letter] = letters[site]
    names = {
        prefix + letter: prefix + target for letter, target in permutation.items() for prefix in (*DERIVATIVES, COMMAND)
    }
    tree = _rename_signals(law.tree, names)
    return replace(law, expression=format_formula(tree, None, None), axis=letters[site])


def _rename_signals(node: Node, names: Mapping[str, str]) -> Node:
    """The syntax tree with variables renamed by `names`; others keep their names."""
    match node:
        case Variable(name):
            return Variable(names.get(name, name))
        case Apply(name, parts):
            return Apply(name, tuple(_rename_signals(part, names) for part in parts))
    return node


def _make_starts(law: Law, site: int) -> Callable[[Evidence, int], tuple[Values, ...]]:
    """Function for starting values at axis `site`; empty at other axes. For a force: the law's factors by linear
    regression of the missing force, the other parameters as in the library. Otherwise all as in the library."""
    factors = [index for index, role in find_parameter_roles(law.tree).items() if role == "factor"]

    def starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
        if axis != site:
            return ()
        if law.acts_on != "force" or not factors:
            return (law_values(law),)
        used, columns = evidence.used > 0, _signal_columns(evidence)
        shapes = [
            evaluate(_with_single_factor(law, factors, factor), columns, evidence.sample_rate_hz)[used]
            for factor in factors
        ]
        if not np.isfinite(shapes).all():
            return (law_values(law),)
        strengths = regress_out_linear_terms(axis_motion(evidence, axis)).fit(*shapes).strengths.tolist()
        fitted_factors = {f"p{index}": strength for index, strength in zip(factors, strengths, strict=True)}
        return ({**law_values(law), **fitted_factors},) if np.any(strengths) else ()

    return starts


def _with_single_factor(law: Law, factors: Sequence[int], selected: int) -> Law:
    """The law with the factor p<selected> set to 1 and the other factors to 0: the regressor of that factor."""
    return law.with_numbers(
        [float(index == selected) if index in factors else value for index, value in enumerate(law.numbers)]
    )


def _signal_columns(evidence: Evidence) -> dict[str, FloatArray]:
    """(n,) each, by name: position, velocity, acceleration (central differences) and command of every axis."""
    acceleration = np.gradient(evidence.axis_velocity, 1 / evidence.sample_rate_hz, axis=0)
    motion = evidence.axis_position, evidence.axis_velocity, acceleration, evidence.command
    return {
        prefix + letter: column[:, axis]
        for axis, letter in enumerate(LETTERS[: evidence.command.shape[1]])
        for prefix, column in zip((*DERIVATIVES, COMMAND), motion, strict=True)
    }
