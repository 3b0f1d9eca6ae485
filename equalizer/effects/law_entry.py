"""Library entry of a discovered law, from which effects are made that a diagnosis searches for in other recordings.

A law was found at one axis of one device. An entry yields one effect per axis (or response channel) of the new
recording, with the axis letters of its formula permuted cyclically; for the law of a force, starting values come from
linear regression.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.effects.discovered_law import (
    AXIS_LETTERS,
    COMMAND_PREFIX,
    DERIVATIVE_PREFIXES,
    Channels,
    collect_channels,
    derive_axis_letters,
    get_law_values,
    index_force_signals,
    make_law_effect,
    name_conditions,
)
from equalizer.effects.effect import Effect, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import regress_out_linear_terms, select_axis_motion
from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law, find_parameter_roles
from equalizer.laws.tree import Apply, Node, Variable, format_formula
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class LawEntry:
    """Library entry: name, formula, origin of a discovered law, and its features in the data."""

    name: str
    """Name of the effects that are made from the entry."""
    law: Law
    """The law with its starting parameters; `law.axis` is the axis at which it was found."""
    source: str
    """Origin of the law, as text."""
    signature: str
    """Features of the law in the data, as in `Effect.signature`."""


def make_library_effects(entries: Sequence[LawEntry], recording: Recording) -> tuple[Effect, ...]:
    """Make the effects of all entries at all axes, bound to the channels of a recording. Raises LawError for a signal
    that the recording lacks."""
    channels = collect_channels(recording)
    return tuple(effect for entry in entries for effect in make_effects_per_axis(entry, channels))


def make_effects_per_axis(entry: LawEntry, channels: Channels) -> tuple[Effect, ...]:
    """Make one effect per axis (response channel for a law of the response), the formula moved to it by a cyclic
    permutation of the axis letters. Raises LawError where the recording lacks a signal."""
    axis_channels = channels.outputs if entry.law.acts_on == "response" else channels.inputs
    effects = []
    for site in range(len(derive_axis_letters(axis_channels))):
        law = _permute_to_axis(entry.law, axis_channels, site)
        effect = make_law_effect(law, channels)
        effects.append(
            replace(
                effect,
                name=entry.name,
                source=entry.source,
                signature=entry.signature,
                starts=_make_starting_value_finder(law, site, channels),
            )
        )
    return tuple(effects)


def find_law_letter(law: Law, channels: tuple[str, ...]) -> str:
    """Find the letter by which formulas call the axis of a law. channels: names of the commands, or of the responses
    for a law of the response. An axis that is none of these channels has its own last letter or, where that is not x, y
    or z, the only letter in the formula."""
    letter_by_channel = dict(zip(channels, derive_axis_letters(channels), strict=False))
    if law.axis in letter_by_channel:
        return letter_by_channel[law.axis]
    used_letters, own_letter = _list_used_letters(law), law.axis[-1:]
    return own_letter if own_letter in AXIS_LETTERS or len(used_letters) != 1 else used_letters[0]


def _list_used_letters(law: Law) -> list[str]:
    """List the letters of the axes whose signals the formula contains."""
    prefixes = (*DERIVATIVE_PREFIXES, COMMAND_PREFIX)
    return [letter for letter in AXIS_LETTERS if any(prefix + letter in law.variables for prefix in prefixes)]


def _permute_to_axis(law: Law, channels: tuple[str, ...], site: int) -> Law:
    """Permute the letters in the formula cyclically, so that the axis of the law becomes that with index `site` among
    the channels. If the new recording lacks the letter of the law's axis, it counts as that of the first axis."""
    axis_letters = derive_axis_letters(channels)
    # A formula of its axis's letter alone: in the device of the law, that letter was no channel of another axis.
    law_letter = law.axis if _list_used_letters(law) == [law.axis] else find_law_letter(law, channels)
    letter_index = axis_letters.index(law_letter) if law_letter in axis_letters else 0
    new_letters = {
        letter: axis_letters[(index + site - letter_index) % len(axis_letters)]
        for index, letter in enumerate(axis_letters)
    }
    new_letters[law_letter] = axis_letters[site]
    new_names = {
        prefix + letter: prefix + target
        for letter, target in new_letters.items()
        for prefix in (*DERIVATIVE_PREFIXES, COMMAND_PREFIX)
    }
    tree = _rename_signals(law.tree, new_names)
    return replace(law, expression=format_formula(tree, None, None), axis=axis_letters[site])


def _rename_signals(node: Node, new_names: Mapping[str, str]) -> Node:
    """Rename the variables of a syntax tree by `new_names`; others keep their names."""
    match node:
        case Variable(name):
            return Variable(new_names.get(name, name))
        case Apply(name, parts):
            return Apply(name, tuple(_rename_signals(part, new_names) for part in parts))
    return node


def _make_starting_value_finder(
    law: Law, site: int, channels: Channels
) -> Callable[[Evidence, int], tuple[Values, ...]]:
    """Make the function that finds starting values at the axis with index `site`; it returns none for other axes.

    For a law of a force: factors by linear regression of the missing force, other parameters as in the library; none
    where all factors are 0. All parameters as in the library for a law of command or response, without factors, of a
    recorded condition (no part of the evidence), or whose terms are not finite along the motion."""
    factors = [index for index, role in find_parameter_roles(law.tree).items() if role == "factor"]
    reads_conditions = not set(name_conditions(channels)).isdisjoint(law.variables)

    def find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
        """Find starting values at an axis: the `Effect.starts` of this effect."""
        if axis != site:
            return ()
        if law.acts_on != "force" or not factors or reads_conditions:
            return (get_law_values(law),)
        used, signals = evidence.used > 0, _collect_signals(evidence, channels)
        regressors = [
            evaluate(_isolate_factor(law, factors, factor), signals, evidence.sample_rate_hz)[used]
            for factor in factors
        ]
        if not np.isfinite(regressors).all():
            return (get_law_values(law),)
        strengths = regress_out_linear_terms(select_axis_motion(evidence, axis)).fit(*regressors).strengths.tolist()
        fitted_factors = {f"p{index}": strength for index, strength in zip(factors, strengths, strict=True)}
        return ({**get_law_values(law), **fitted_factors},) if np.any(strengths) else ()

    return find_starting_values


def _isolate_factor(law: Law, factors: Sequence[int], selected: int) -> Law:
    """Isolate a factor: the law with p<selected> set to 1 and the other factors to 0 is the regressor of that
    factor."""
    return law.replace_numbers(
        [float(index == selected) if index in factors else value for index, value in enumerate(law.numbers)]
    )


def _collect_signals(evidence: Evidence, channels: Channels) -> dict[str, FloatArray]:
    """Collect position, velocity, acceleration (central differences) and command of every axis, (n,) each, by their
    names in formulas (`index_force_signals`)."""
    acceleration = np.gradient(evidence.axis_velocity, 1 / evidence.sample_rate_hz, axis=0)
    signals_by_axis = np.stack([evidence.axis_position, evidence.axis_velocity, acceleration, evidence.command], axis=2)
    columns = signals_by_axis.reshape(len(signals_by_axis), -1)
    return {
        name: columns[:, index - 1]
        for name, index in index_force_signals(channels).items()
        if 0 < index <= columns.shape[1]
    }
