"""A virtual spring in the model that is compared, and taken off again."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.first_model.first_model import REPLACED_REMARK, FirstModel
from equalizer.plant.mechanical_model import MechanicalModel
from study.workflows.diagnosis.diagnose_recordings import add_spring, describe_spring


@pytest.fixture
def two_bodies() -> MechanicalModel:
    """One is driven along x with 2 N per N of command; the other hangs on it."""
    one = np.eye(2)
    return MechanicalModel("two", "acceleration", one, one, 50 * one, np.array([[2.0], [0.0]]), np.array([[0.0, 1.0]]))


def test_the_spring_holds_the_driven_body_for_any_unit_of_the_command(two_bodies):
    held = add_spring(two_bodies, 137.0)
    np.testing.assert_array_equal(held.stiffness, [[187.0, 0.0], [0.0, 50.0]])
    np.testing.assert_array_equal(add_spring(held, -137.0).stiffness, two_bodies.stiffness)


def test_without_a_spring_nothing_is_changed_or_said(two_bodies):
    assert add_spring(two_bodies, 0.0) is two_bodies
    assert describe_spring(0.0) == ()


def test_what_was_done_is_reported():
    assert describe_spring(136.6) == (
        "A virtual spring of 137 N/m held the handle at its place. It was added to the model for the comparison, and "
        "is not in improved.toml.",
    )


def test_remarks_on_a_first_model_that_was_replaced_are_left_out(two_bodies):
    first_model = FirstModel(two_bodies, ("The response is positive in the direction opposite to the command.",))
    other = replace(two_bodies, mass=2 * two_bodies.mass)
    assert first_model.list_remarks(add_spring(two_bodies, 137.0), "predicted force") == first_model.remarks
    assert first_model.list_remarks(other, "predicted force") == (REPLACED_REMARK,)
    assert first_model.list_remarks(other, "free simulation") == first_model.remarks
    assert FirstModel(two_bodies, ()).list_remarks(other, "predicted force") == ()
