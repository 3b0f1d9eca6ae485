import re
from typing import get_args

from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES, EFFECTS_BY_NAME, RESPONSE, Place
from equalizer.signals.unit_system import LINEAR, ROTATIONAL
from equalizer.signals.units import parse_unit


def test_every_effect_of_the_contract_is_there_with_its_place_and_parameters(shared):
    table = re.search(r"\*\*Effects\*\*[^\n]*\n(.*?)\nMeaning", (shared / "design.md").read_text(), re.DOTALL)[1]
    agreed = {}
    for line in table.splitlines():
        place, _, entries = line.partition(": ")
        for name, numbers in re.findall(r"`(\w+)`: ([^·;.]*)", entries):
            agreed[name] = (place, [number.split(" (")[0].strip() for number in numbers.split(",")])
    ours = {
        effect.name: (effect.place, [number.name for number in effect.parameters if not number.optional])
        for effect in EFFECT_ENTRIES
    }
    assert agreed.items() <= ours.items()


def test_names_are_unique_and_places_known():
    assert len(EFFECTS_BY_NAME) == len(EFFECT_ENTRIES) >= 33
    assert {effect.place for effect in EFFECT_ENTRIES} == set(get_args(Place))


def test_every_unit_is_one_that_files_may_use():
    for effect in EFFECT_ENTRIES:
        for number in effect.parameters:
            for unit in (number.unit, number.rotational_unit):
                assert unit == "ppm" or RESPONSE in unit or parse_unit(unit)


def test_units_follow_the_model_and_its_response():
    level, cubic = EFFECTS_BY_NAME["coulomb_friction"].main, EFFECTS_BY_NAME["sensor_nonlinearity"].main
    clipping = EFFECTS_BY_NAME["sensor_clipping"].main
    assert level.find_unit(system=LINEAR, response_unit="m/s^2") == "N"
    assert level.find_unit(system=ROTATIONAL, response_unit="rad") == "N m"
    assert clipping.find_unit(system=LINEAR, response_unit="m/s^2") == "m/s^2"
    assert cubic.find_unit(system=LINEAR, response_unit="m/s^2") == "1/(m/s^2)^2"
