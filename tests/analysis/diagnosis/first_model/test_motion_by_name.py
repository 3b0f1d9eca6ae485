"""A response in no unit is what its name says, where that is clear; else what its time series suggests."""

import numpy as np
import pytest

from analysis.diagnosis.first_model.infer_quantity import infer_quantities
from tests.analysis.diagnosis.first_model.short_recordings import make_recording, simulate_speed, smooth_noise

PUSH = smooth_noise(4000, 1)
PLACE = np.cumsum(simulate_speed(PUSH)) / 500
PLAIN = ("1", "1")


def named_quantities(*channels):
    """Quantities of the responses, and what is said. channels: name, quantity, unit, samples."""
    (found,), said = infer_quantities((make_recording([("u", "voltage", "V", PUSH)], list(channels)),))
    return found.response.quantities, said


@pytest.mark.parametrize(
    ("name", "quantity"),
    [("speed", "velocity"), ("motor_Speed", "velocity"), ("rpm", "velocity"), ("omega", "velocity"),
     ("yaw_rate", "velocity"), ("VELOCIDAD", "velocity"), ("Drehzahl", "velocity"), ("vitesse", "velocity"),
     ("angle", "angle"), ("Ángulo", "angle"), ("Winkel", "angle"), ("accX", "acceleration"), ("posición", "position")],
)  # fmt: skip
@pytest.mark.parametrize("course", [PLACE, simulate_speed(PUSH)], ids=["of a position", "of a speed"])
def test_a_clear_name_counts_more_than_the_course(name, quantity, course):
    quantities, said = named_quantities((name, *PLAIN, course))
    assert quantities == (quantity,)
    assert said.startswith(f"From the name alone, {name} was taken for a")
    assert quantity in said and "state that in the map (quantity)" in said


@pytest.mark.parametrize("name", ["y", "tacho", "CH1", "current", "temperature"])
def test_another_name_leaves_it_to_the_course(name):
    quantities, said = named_quantities((name, *PLAIN, PLACE))
    assert quantities == ("position",)
    assert f"The recording does not state what {name} measures" in said


def test_what_a_name_says_of_several_is_said_of_each_and_the_others_stay_open():
    quantities, said = named_quantities(
        ("speed", *PLAIN, simulate_speed(PUSH)), ("angle", *PLAIN, PLACE), ("CH3", *PLAIN, PLACE)
    )
    assert quantities == ("velocity", "angle", "1")
    assert "speed was taken for a velocity and angle was taken for an angle" in said


@pytest.mark.parametrize(("quantity", "unit"), [("velocity", "m/s"), ("position", "m")])
def test_a_stated_quantity_counts_more_than_the_name(quantity, unit):
    assert named_quantities(("angle", quantity, unit, PLACE)) == ((quantity,), "")


@pytest.mark.parametrize(("name", "quantity"), [("displacement", "position"), ("encoder", "position"), ("u", "1")])
def test_a_command_in_counts_is_the_imposed_motion_that_its_name_says_where_forces_were_measured(name, quantity):
    (found,), said = infer_quantities((make_recording([(name, *PLAIN, PLACE)], [("load", "force", "N", PUSH)]),))
    assert found.command.quantities == (quantity,)
    assert found.response.quantities == ("force",)
    assert said.startswith(f"From the name alone, {name} was taken for a position") == (quantity == "position")


def test_of_several_commands_only_the_quantity_that_was_not_stated_is_said_to_be_from_a_name():
    commands = [("x", "position", "m", PLACE), ("encoder", *PLAIN, PLACE), ("drive", "force", "N", PUSH)]
    (found,), said = infer_quantities((make_recording(commands, [("load", "force", "N", PUSH)]),))
    assert found.command.quantities == ("position", "position", "force")
    assert said.startswith("From the name alone, encoder was taken for a position;")
