"""Converts effects between a model file's form (axis names, parameters) and the simulation's (sites, values)."""

from collections.abc import Iterator
from dataclasses import replace

from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.discovered_law import Channels, law_channels, law_effect, law_values, law_with_values
from equalizer.effects.effect import Effect, PlacedEffect
from equalizer.laws.law import Law
from equalizer.laws.parse import LawError
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW, EFFECTS_BY_NAME, LAW_PLACES, Place
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect, suggest_word
from equalizer.signals.recording import Recording

SHORT = 2
"""Longest channel name that consists of quantity and axis alone, such as `fx`."""


class PlacingError(ValueError):
    """An effect that cannot be placed in this model. Says which and why."""


def place_recorded_effects(model: MechanicalModel, recording: Recording) -> tuple[PlacedEffect, ...]:
    """`place_effects` at a recording's channels and conditions. Raises PlacingError."""
    return place_effects(model, law_channels(recording))


def place_effects(model: MechanicalModel, channels: Channels) -> tuple[PlacedEffect, ...]:
    """`model.effects` at the axes and channels that they name; an effect that names none acts on all.

    An axis is named by its channel ('fx', 'ax') or by its letter ('x'). A parameter that a file leaves out takes its
    default. Raises PlacingError for an unknown effect or axis, or a value that must not be negative.
    """
    named = replace(channels, quantity=model.quantity)
    return tuple(_place_effect(effect, named) for effect in model.effects)


def model_effects(
    placed: tuple[PlacedEffect, ...], input_channels: tuple[str, ...], output_channels: tuple[str, ...]
) -> tuple[ModelEffect, ...]:
    """The inverse of `place_effects`: an entry per site, or one without an axis where all share the effect."""
    return tuple(
        _model_effect(each, axis)
        for each in placed
        for axis in _axis_names(each, output_channels if place_of_effect(each.effect) == "sensor" else input_channels)
    )


def place_of_effect(effect: Effect) -> Place:
    """Place where an effect sits (mechanism, hand, actuator, sensor); for a discovered law, by the quantity it acts
    on."""
    return EFFECTS_BY_NAME[effect.name].place if effect.law is None else LAW_PLACES[effect.law.acts_on]


def _model_effect(placed: PlacedEffect, axis: str | None) -> ModelEffect:
    law = placed.effect.law
    if law is None or axis is None:
        return ModelEffect(placed.effect.name, axis, dict(placed.effect.report(placed.values)))
    return ModelEffect(DISCOVERED_LAW, axis, {}, replace(law_with_values(law, placed.values), axis=axis))


def axis_letter(channel: str, channels: tuple[str, ...]) -> str:
    """The letter of a channel name ('x' of 'fx') where no two channels end alike and no name is a word, else the whole
    name."""
    ends = [name[-1:] for name in channels]
    short = all(len(name) <= SHORT or name[-1:] in "xyz" for name in channels)
    return channel[-1:] if short and len(set(ends)) == len(ends) and all(end.isalpha() for end in ends) else channel


def _axis_names(placed: PlacedEffect, channels: tuple[str, ...]) -> Iterator[str | None]:
    shared = placed.effect.law is None and set(placed.sites) == set(range(len(channels)))
    if shared and (len(channels) > 1 or "one" not in placed.effect.sites):
        yield None
        return
    for site in placed.sites:
        if not 0 <= site < len(channels):
            raise PlacingError(f"{placed.effect.name} is placed at number {site + 1}, but there are {len(channels)}")
        yield axis_letter(channels[site], channels)


def _place_effect(effect: ModelEffect, channels: Channels) -> PlacedEffect:
    if effect.law is not None:
        return _place_law(effect, effect.law, channels)
    entry = EFFECTS.get(effect.kind)
    if entry is None:
        raise PlacingError(
            f"no simulation plays '{effect.kind}'{suggest_word(effect.kind, tuple(EFFECTS))}; "
            f"it plays {', '.join(EFFECTS)}"
        )
    for parameter in entry.parameters:
        value = effect.parameters.get(parameter.name, 0.0)
        if parameter.scale == "log" and value < 0:
            raise PlacingError(f"{effect.kind}.{parameter.name} is {value:g}; it must not be negative")
    return PlacedEffect(entry, find_sites(effect, channels.inputs, channels.outputs), effect.parameters)


def _place_law(effect: ModelEffect, law: Law, channels: Channels) -> PlacedEffect:
    try:
        entry = law_effect(law, channels)
    except LawError as error:
        raise PlacingError(f"{effect.kind} on {effect.axis}: {error}") from error
    return PlacedEffect(entry, find_sites(effect, channels.inputs, channels.outputs), law_values(law))


def find_sites(effect: ModelEffect, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> tuple[int, ...]:
    """Numbers of the axes or channels that an effect of a model names; all of them where it names none. Raises
    PlacingError."""
    place = EFFECTS_BY_NAME[effect.kind].place if effect.law is None else LAW_PLACES[effect.law.acts_on]
    channels = outputs if place == "sensor" else inputs
    if effect.axis is None:
        return tuple(range(len(channels)))
    exact = tuple(number for number, channel in enumerate(channels) if channel == effect.axis)
    named = exact or tuple(number for number, channel in enumerate(channels) if channel[-1:] == effect.axis)
    if len(named) != 1:
        found = "is on several of" if named else "is none of"
        raise PlacingError(f"{effect.kind}: the axis '{effect.axis}' {found} {', '.join(channels)}")
    return named
