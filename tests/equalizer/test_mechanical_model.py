from typing import Any

import numpy as np
import pytest

from equalizer.plant.mechanical_model import (
    ActuatorLimits,
    MechanicalModel,
    MechanicalModelError,
    ModelEffect,
    SensorLimits,
    Tolerance,
)


def model(**changes: Any) -> MechanicalModel:
    parts = {
        "name": "one axis with a mode",
        "quantity": "acceleration",
        "mass": np.diag([0.2, 0.05]),
        "damping": np.eye(2),
        "stiffness": np.array([[100.0, -10.0], [-10.0, 50.0]]),
        "input": np.array([[1.0], [0.0]]),
        "output": np.array([[1.0, 0.0]]),
    }
    return MechanicalModel(**{**parts, **changes})


def the_problem(**changes: Any) -> str:
    with pytest.raises(MechanicalModelError) as refused:
        model(**changes)
    (problem,) = refused.value.problems
    return problem


def test_a_sound_model_says_its_size():
    assert (model().coordinates, model().inputs, model().outputs) == (2, 1, 1)


def test_a_model_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        model().mass[0, 0] = 1.0


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"quantity": "force"}, "model.quantity is 'force'; allowed are position, displacement, angle, velocity"),
        ({"damping": np.eye(3)}, "model.damping has shape (3, 3), but must have (2, 2): mass is 2 rows high"),
        ({"input": np.eye(3)}, "model.input has shape (3, 3), but must have (2, inputs)"),
        ({"output": np.ones((1, 3))}, "model.output has shape (1, 3), but must have (outputs, 2)"),
        ({"output": np.ones(2)}, "model.output has shape (2,), but must have (outputs, 2)"),
        ({"stiffness": np.diag([np.nan, 1.0])}, "model.stiffness holds values that are not finite numbers"),
        ({"mass": np.array([[0.2, 0.1], [0.0, 0.2]])}, "model.mass is not symmetric"),
        ({"mass": np.diag([0.2, 0.0])}, "model.mass is not positive definite (its lowest eigenvalue is 0)"),
        ({"sensor": SensorLimits(bandwidth_hz=-1.0)}, "sensor.bandwidth_hz is -1.0; it must be a number that is not"),
        ({"actuator": ActuatorLimits(delay_s=np.inf)}, "actuator.delay_s is inf; it must be a number that is not"),
        ({"tolerance": Tolerance(modes=-0.1)}, "tolerance.modes is -0.1; it must be a number that is not negative"),
        (
            {"effects": (ModelEffect("coulomb_frction", "x", {}),)},
            "effect 1: unknown kind 'coulomb_frction' (did you mean 'coulomb_friction'?); allowed are coulomb_friction",
        ),
        (
            {"effects": (ModelEffect("backlash", "x", {"gap": 1e-4, "gapp": 1.0}),)},
            "effect 1: backlash has no parameter 'gapp' (did you mean 'gap'?); allowed are gap",
        ),
        (
            {"effects": (ModelEffect("extra_mode", "x", {"frequency": 40.0}),)},
            "effect 1: extra_mode lacks mass (kg), damping_ratio (1)",
        ),
        (
            {"effects": (ModelEffect("backlash", "x", {"gap": np.nan}),)},
            "effect 1: backlash.gap is nan; it must be a finite number",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_words(changes, problem):
    assert the_problem(**changes).startswith(problem)


def test_all_problems_are_named_at_once():
    with pytest.raises(MechanicalModelError) as refused:
        model(quantity="force", damping=np.eye(3), sensor=SensorLimits(range=-1.0))
    assert len(refused.value.problems) == 3
    assert "; " in str(refused.value)
