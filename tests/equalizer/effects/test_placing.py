from dataclasses import replace

import numpy as np
import pytest

from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.discovered_law import Channels, get_law_values, make_law_effect
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.placing import PlacingError, convert_to_model_effects, place_effects, shorten_axis_name
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.laws.law import parse_law
from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES, EFFECTS_BY_NAME
from equalizer.plant.mechanical_model import ModelEffect
from equalizer.plant.mechanical_model_toml import format_mechanical_model, parse_mechanical_model

INPUTS, OUTPUTS = ("fx", "fy", "fz"), ("ax", "ay", "az")


def written(kind: str, axis: str | None, optional: bool) -> ModelEffect:
    parts = [part for part in EFFECTS_BY_NAME[kind].parameters if optional or not part.optional]
    return ModelEffect(kind, axis, {part.name: 0.1 + 0.01 * number for number, part in enumerate(parts)})


def placed(model, *effects: ModelEffect):
    return place_effects(replace(model, effects=effects), Channels(INPUTS, OUTPUTS))


def test_the_catalogue_plays_every_name_of_the_vocabulary():
    assert [effect.name for effect in CATALOGUE] == [name.name for name in EFFECT_ENTRIES]


@pytest.mark.parametrize("optional", [False, True])
@pytest.mark.parametrize("kind", [name.name for name in EFFECT_ENTRIES])
def test_every_effect_of_a_file_can_be_played(bench, kind, optional):
    model = bench.three_axes()
    (one,) = placed(model, written(kind, None, optional))
    assert one.sites == (0, 1, 2)
    played = simulate_mechanism(model, 0.1 * bench.commands(3)[:500], 1000.0, [one])
    assert np.isfinite(played.response).all()


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_what_was_fitted_is_written_and_read_back_the_same(bench, effect):
    values = {p.name: 0.1 + 0.01 * number for number, p in enumerate(effect.parameters)}
    one = effect.sites[0] == "one"
    fitted = type(placed(bench.three_axes(), written("force_gain", "x", False))[0])(
        effect, (1,) if one else (0, 1, 2), values
    )
    model = replace(bench.three_axes(), effects=convert_to_model_effects((fitted,), INPUTS, OUTPUTS))
    assert [each.axis for each in model.effects] == (["y"] if one else [None])
    (again,) = place_effects(parse_mechanical_model(format_mechanical_model(model)), Channels(INPUTS, OUTPUTS))
    assert again.effect is effect
    assert again.sites == fitted.sites
    assert {name: again.values[name] for name in values} == pytest.approx(values)


@pytest.mark.parametrize("axis", ["y", "fy"])
def test_an_axis_is_named_by_its_letter_or_its_channel(bench, axis):
    assert placed(bench.three_axes(), written("coulomb_friction", axis, False))[0].sites == (1,)


def test_a_sensors_axis_is_a_channel_of_the_response(bench):
    assert placed(bench.three_axes(), written("sensor_gain", "az", False))[0].sites == (2,)
    with pytest.raises(PlacingError, match="sensor_gain: the axis 'fz' is none of ax, ay, az"):
        placed(bench.three_axes(), written("sensor_gain", "fz", False))


def test_a_letter_that_two_channels_end_with_is_refused(bench):
    model = replace(bench.three_axes(), effects=(written("coulomb_friction", "x", False),))
    with pytest.raises(PlacingError, match="the axis 'x' fits several of fx, tx"):
        place_effects(model, Channels(("fx", "tx"), OUTPUTS))


def test_an_effect_beyond_the_channels_cannot_be_written(bench):
    (one,) = placed(bench.three_axes(), written("coulomb_friction", "z", False))
    with pytest.raises(PlacingError, match="coulomb_friction acts on channel 3, but there are only 2 channels"):
        convert_to_model_effects((one,), INPUTS[:2], OUTPUTS)


@pytest.mark.parametrize(
    ("channels", "letter"),
    [(("fx", "fy"), "y"), (("f1", "f2"), "f2"), (("left x", "right x"), "right x"), (("rate", "force"), "force")],
)
def test_a_channel_is_named_by_its_letter_where_that_is_enough(channels, letter):
    assert shorten_axis_name(channels[1], channels) == letter


@pytest.mark.parametrize(
    ("text", "acts_on"),
    [
        ("-4.123456789*abs(vy)**1.5*sign(vy) + 2*x**2*vy", "force"),
        ("fy - 0.1*fx", "command"),
        ("delay(ay, 0.0021)", "response"),
    ],
)
def test_a_discovered_law_is_written_and_read_back_the_same(bench, text, acts_on):
    law = parse_law(text, acts_on, "y")
    fitted = PlacedEffect(make_law_effect(law), (1,), get_law_values(law))
    model = replace(bench.three_axes(), effects=convert_to_model_effects((fitted,), INPUTS, OUTPUTS))
    again = parse_mechanical_model(format_mechanical_model(model))
    assert again.effects == (ModelEffect("discovered_law", "y", {}, law),)
    (placed_again,) = place_effects(again, Channels(INPUTS, OUTPUTS))
    assert (placed_again.sites, placed_again.values) == ((1,), get_law_values(law))
    commands = 0.1 * bench.commands(3)[:500]
    one, other = (simulate_mechanism(again, commands, 1000.0, [each]).response for each in (fitted, placed_again))
    assert np.array_equal(one, other)


def test_a_law_of_a_signal_that_is_not_there_is_refused(bench):
    effect = ModelEffect("discovered_law", "y", {}, parse_law("-2.0*voltage", "force", "y"))
    with pytest.raises(PlacingError, match="discovered_law on y: the law needs the signal 'voltage'; there are"):
        placed(bench.three_axes(), effect)
