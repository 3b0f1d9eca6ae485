"""A law that was found once and is kept: looked for in other recordings as the catalogue's effects are."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.effects.discovered_law import COMMAND, DERIVATIVES, LETTERS, Channels, axis_names, law_effect, law_values
from equalizer.effects.effect import Effect, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import beside_linear, moving
from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law
from equalizer.laws.roles import roles
from equalizer.laws.tree import Apply, Node, Variable, format_formula
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class LawEntry:
    name: str
    law: Law
    """With the numbers that a fit starts from, and the axis whose signals its formula calls by their letter."""
    source: str
    signature: str
    """What a reader sees in the data where it is the cause."""


def kept_effects(entries: Sequence[LawEntry], recording: Recording) -> tuple[Effect, ...]:
    """As they read in this recording. Raises LawError."""
    response = recording.response
    channels = Channels(recording.command.channels, response.channels, response.quantities[0])
    return tuple(effect for entry in entries for effect in effects_of(entry, channels))


def effects_of(entry: LawEntry, channels: Channels) -> tuple[Effect, ...]:
    """One per axis, each with the formula as it reads there: the letters of all axes turn along with it. Raises
    LawError where the recording lacks a signal."""
    letters = axis_names(channels.outputs if entry.law.acts_on == "response" else channels.inputs)
    found = []
    for site in range(len(letters)):
        law = _turned(entry.law, letters, site)
        effect = law_effect(law, channels)
        found.append(
            replace(
                effect, name=entry.name, source=entry.source, signature=entry.signature, starts=_starts_at(law, site)
            )
        )
    return tuple(found)


def _turned(law: Law, letters: tuple[str, ...], site: int) -> Law:
    own = law.axis[-1:]
    first = letters.index(own) if own in letters else 0
    turn = {letter: letters[(number + site - first) % len(letters)] for number, letter in enumerate(letters)}
    turn[own] = letters[site]
    names = {prefix + letter: prefix + to for letter, to in turn.items() for prefix in (*DERIVATIVES, COMMAND)}
    tree = _renamed(law.tree, names)
    return replace(law, expression=format_formula(tree, None, None), axis=letters[site])


def _renamed(node: Node, names: Mapping[str, str]) -> Node:
    match node:
        case Variable(name):
            return Variable(names.get(name, name))
        case Apply(name, parts):
            return Apply(name, tuple(_renamed(part, names) for part in parts))
    return node


def _starts_at(law: Law, site: int) -> Callable[[Evidence, int], tuple[Values, ...]]:
    """Of a force, factors by linear regression of the missing force, with the other numbers as they were found."""
    factors = [place for place, role in roles(law.tree).items() if role == "factor"]

    def starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
        if axis != site:
            return ()
        if law.acts_on != "force" or not factors:
            return (law_values(law),)
        used, columns = evidence.used > 0, _columns(evidence)
        shapes = [evaluate(_only(law, factors, factor), columns, evidence.sample_rate_hz)[used] for factor in factors]
        if not np.isfinite(shapes).all():
            return (law_values(law),)
        strengths = beside_linear(moving(evidence, axis)).fit(*shapes).strengths.tolist()
        found = {f"p{place}": strength for place, strength in zip(factors, strengths, strict=True)}
        return ({**law_values(law), **found},) if np.any(strengths) else ()

    return starts


def _only(law: Law, factors: Sequence[int], each: int) -> Law:
    """With this factor 1, the others 0."""
    return law.with_numbers(
        [float(place == each) if place in factors else number for place, number in enumerate(law.numbers)]
    )


def _columns(evidence: Evidence) -> dict[str, FloatArray]:
    acceleration = np.gradient(evidence.axis_velocity, 1 / evidence.sample_rate_hz, axis=0)
    motion = evidence.axis_position, evidence.axis_velocity, acceleration, evidence.command
    return {
        prefix + letter: column[:, number]
        for number, letter in enumerate(LETTERS[: evidence.command.shape[1]])
        for prefix, column in zip((*DERIVATIVES, COMMAND), motion, strict=True)
    }
