"""Conversion of effects between the form of a model file (axis names, parameters) and that of a simulation (sites,
values).

A site is the index of a driven axis or, for sensor effects, of a response channel. To place an effect is to find its
sites. `place_effects` converts from a file, `convert_to_model_effects` back; `find_device_part` finds in which part of
the device (`Place` of the vocabulary) an effect acts. Called by the diagnosis and the checks of model files.
"""

from collections.abc import Iterator
from dataclasses import replace

from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.discovered_law import (
    Channels,
    collect_channels,
    get_law_values,
    make_law_effect,
    set_law_values,
)
from equalizer.effects.effect import Effect, PlacedEffect
from equalizer.laws.law import Law
from equalizer.laws.parse import LawError
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW, EFFECTS_BY_NAME, LAW_PLACES, Place
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect, suggest_word
from equalizer.signals.recording import Recording

SHORT_NAME_LENGTH = 2
"""Length (characters) of the longest channel name that consists of a quantity and an axis letter, such as `fx`."""


class PlacingError(ValueError):
    """An effect cannot be placed in a model. The message names the effect and the reason."""


def place_recorded_effects(model: MechanicalModel, recording: Recording) -> tuple[PlacedEffect, ...]:
    """Place `model.effects` as `place_effects` does, with the channels and conditions of a recording. Raises
    PlacingError."""
    return place_effects(model, collect_channels(recording))


def place_effects(model: MechanicalModel, channels: Channels) -> tuple[PlacedEffect, ...]:
    """Place `model.effects` at the axes and channels that they name; an effect that names none acts on all.

    An axis is named by its channel ('fx', 'ax') or by its letter ('x'). A parameter that a file leaves out takes its
    default. Raises PlacingError for an unknown effect or axis, a negative value of a positive parameter, or a law with
    a signal that the channels lack.
    """
    model_channels = replace(channels, quantity=model.quantity)
    return tuple(_place_effect(effect, model_channels) for effect in model.effects)


def convert_to_model_effects(
    placed_effects: tuple[PlacedEffect, ...], input_channels: tuple[str, ...], output_channels: tuple[str, ...]
) -> tuple[ModelEffect, ...]:
    """Convert placed effects to entries of a model file, the inverse of `place_effects`: an entry per site, or a single
    entry without an axis under the conditions of `_iterate_axis_names`. Raises PlacingError for a site beyond the
    channels."""
    return tuple(
        _convert_to_model_effect(placed_effect, axis_name)
        for placed_effect in placed_effects
        for axis_name in _iterate_axis_names(
            placed_effect, output_channels if find_device_part(placed_effect.effect) == "sensor" else input_channels
        )
    )


def find_device_part(effect: Effect) -> Place:
    """Find the part of the device in which an effect acts; for a discovered law, by the quantity it acts on."""
    return EFFECTS_BY_NAME[effect.name].place if effect.law is None else LAW_PLACES[effect.law.acts_on]


def _convert_to_model_effect(placed_effect: PlacedEffect, axis: str | None) -> ModelEffect:
    """Convert a placed effect to an entry of a model file: reported parameters, or the law with its fitted
    parameters."""
    law = placed_effect.effect.law
    if law is None or axis is None:
        return ModelEffect(placed_effect.effect.name, axis, dict(placed_effect.effect.report(placed_effect.values)))
    return ModelEffect(DISCOVERED_LAW, axis, {}, replace(set_law_values(law, placed_effect.values), axis=axis))


def shorten_axis_name(channel: str, channels: tuple[str, ...]) -> str:
    """Shorten a channel name to its last letter ('x' of 'fx'), provided that all channels end in different letters and
    each name is short or ends in x, y or z; otherwise return the whole name."""
    last_letters = [name[-1:] for name in channels]
    has_axis_suffixes = all(len(name) <= SHORT_NAME_LENGTH or name[-1:] in "xyz" for name in channels)
    return (
        channel[-1:]
        if has_axis_suffixes
        and len(set(last_letters)) == len(last_letters)
        and all(letter.isalpha() for letter in last_letters)
        else channel
    )


def _iterate_axis_names(placed_effect: PlacedEffect, channels: tuple[str, ...]) -> Iterator[str | None]:
    """Iterate over the axis names of the sites. For an effect other than a law at all channels, yield None instead,
    which stands for all; but with a single channel, an effect that can act on a single channel keeps its axis name.
    Raises PlacingError for a site beyond the channels."""
    is_at_all_sites = placed_effect.effect.law is None and set(placed_effect.sites) == set(range(len(channels)))
    if is_at_all_sites and (len(channels) > 1 or "one" not in placed_effect.effect.sites):
        yield None
        return
    for site in placed_effect.sites:
        if not 0 <= site < len(channels):
            raise PlacingError(
                f"{placed_effect.effect.name} acts on channel {site + 1}, but there are only {len(channels)} channels"
            )
        yield shorten_axis_name(channels[site], channels)


def _place_effect(effect: ModelEffect, channels: Channels) -> PlacedEffect:
    """Place an effect at its sites. Raises PlacingError as `place_effects` does."""
    if effect.law is not None:
        return _place_law(effect, effect.law, channels)
    catalogue_effect = EFFECTS.get(effect.kind)
    if catalogue_effect is None:
        raise PlacingError(
            f"no simulation of '{effect.kind}' exists{suggest_word(effect.kind, tuple(EFFECTS))}; simulated are "
            f"{', '.join(EFFECTS)}"
        )
    for parameter in catalogue_effect.parameters:
        value = effect.parameters.get(parameter.name, 0.0)
        if parameter.scale == "log" and value < 0:
            raise PlacingError(f"{effect.kind}.{parameter.name} is {value:g}; it must not be negative")
    return PlacedEffect(catalogue_effect, find_sites(effect, channels.inputs, channels.outputs), effect.parameters)


def _place_law(effect: ModelEffect, law: Law, channels: Channels) -> PlacedEffect:
    """Place the effect of a discovered law at its site. Raises PlacingError for a signal or axis that the channels
    lack."""
    try:
        placed_law = make_law_effect(law, channels)
    except LawError as error:
        raise PlacingError(f"{effect.kind} on {effect.axis}: {error}") from error
    return PlacedEffect(placed_law, find_sites(effect, channels.inputs, channels.outputs), get_law_values(law))


def find_sites(effect: ModelEffect, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> tuple[int, ...]:
    """Find the indices of the axes or channels that an effect of a model names; all where it names none. Raises
    PlacingError where the name matches no channel or several, KeyError for an unknown kind."""
    place = EFFECTS_BY_NAME[effect.kind].place if effect.law is None else LAW_PLACES[effect.law.acts_on]
    channels = outputs if place == "sensor" else inputs
    if effect.axis is None:
        return tuple(range(len(channels)))
    exact_matches = tuple(index for index, channel in enumerate(channels) if channel == effect.axis)
    matches = exact_matches or tuple(index for index, channel in enumerate(channels) if channel[-1:] == effect.axis)
    if len(matches) != 1:
        problem = "fits several of" if matches else "is none of"
        raise PlacingError(f"{effect.kind}: the axis '{effect.axis}' {problem} {', '.join(channels)}")
    return matches
