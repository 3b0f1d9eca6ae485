"""Units of a model's numbers follow from those of its commands and its motion."""

import numpy as np
import pytest

from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES, EFFECTS_BY_NAME, find_matrix_unit
from equalizer.plant.mechanical_model import MechanicalModel, adopt_recording_units
from equalizer.plant.mechanical_model_toml import format_mechanical_model, parse_mechanical_model
from equalizer.signals.unit_system import LINEAR, ROTATIONAL, UnitSystem, determine_unit_system

MOTOR = UnitSystem("A", "rad")


def body(gain: float = 1.0) -> MechanicalModel:
    identity = np.eye(1)
    return MechanicalModel("m", "angle", identity, identity, identity, gain * identity, identity, rotational=True)


@pytest.mark.parametrize(
    ("system", "units"),
    [(LINEAR, ("kg", "N s/m", "N/m")), (ROTATIONAL, ("kg m^2", "N m s/rad", "N m/rad")),
     (MOTOR, ("A s^2/rad", "A s/rad", "A/rad")), (UnitSystem("1", "1"), ("s^2", "s", "1")),
     (UnitSystem("V", "m"), ("V s^2/m", "V s/m", "V/m"))],
)  # fmt: skip
def test_mass_damping_and_stiffness(system, units):
    assert tuple(find_matrix_unit(part, system) for part in ("mass", "damping", "stiffness")) == units


def test_no_number_of_an_effect_is_a_force_where_the_command_is_none():
    units = [part.find_unit(MOTOR, "rad") for effect in EFFECT_ENTRIES for part in effect.parameters]
    assert not any("N" in unit.split() or "kg" in unit for unit in units)
    assert EFFECTS_BY_NAME["gravity_torque"].main.find_unit(MOTOR, "rad") == "A"


def test_the_motion_is_what_a_speed_or_acceleration_is_the_rate_of():
    assert [determine_unit_system(("N",), (unit,)).length for unit in ("m", "m/s", "m/s^2", "rad/s", "1")] == [
        "m", "m", "m", "rad", "1",
    ]  # fmt: skip


def test_a_model_takes_its_recordings_units_and_keeps_them_in_a_file():
    found = adopt_recording_units(body(), ("A",), ("rad",))
    assert found.system == MOTOR
    assert parse_mechanical_model(format_mechanical_model(found)).system == MOTOR


def test_a_model_in_si_stays_so():
    assert adopt_recording_units(body(), ("N m",), ("rad",)).units is None
    assert (
        adopt_recording_units(body(0.05), ("A",), ("rad",)).system == ROTATIONAL
    )  # its input turns amperes into torques
