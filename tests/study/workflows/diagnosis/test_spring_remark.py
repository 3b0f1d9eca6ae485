"""A virtual spring in the model that is compared, and taken off again."""

import numpy as np
import pytest

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
