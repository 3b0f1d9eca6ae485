"""What the tolerances of a model leave open, and the model that other values give."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from analysis.diagnosis.errors.tuning import DAMPING_UNCERTAINTY_RATIO, make_tuning
from analysis.diagnosis.limits import UNSTATED_SHARE
from equalizer.plant.linear_simulation import discretise_model
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError, Tolerance

MASS_KG, HANGING_KG, HANGING_HZ = 0.25, 0.02, 90.0
KNOWN = Tolerance(0.004, 0.3, 6.0, 0.01)


def make_hanging_model(axes=2, tolerance=KNOWN):
    """Each axis a mass on a spring, and on the first one another mass on a spring."""
    spring = HANGING_KG * (2 * np.pi * HANGING_HZ) ** 2
    damper = 2 * 0.03 * np.sqrt(spring * HANGING_KG)
    n = axes + 1
    joint = np.zeros(n)
    joint[0], joint[-1] = 1.0, -1.0
    mass = np.diag([MASS_KG] * axes + [HANGING_KG])
    damping = np.diag([4.0] * axes + [0.0]) + damper * np.outer(joint, joint)
    stiffness = np.diag([130.0] * axes + [0.0]) + spring * np.outer(joint, joint)
    seen = np.eye(axes, n)
    return MechanicalModel(
        "make_hanging_model", "acceleration", mass, damping, stiffness, seen.T, seen, tolerance=tolerance
    )


def open_tuning(model):
    return make_tuning(model, ("fx", "fy", "fz")[: model.inputs])


def tune_model(model, **deviations):
    """The model with deviations by name, spaces as underscores."""
    tuning = open_tuning(model)
    at = np.zeros(len(tuning.names))
    for name, value in deviations.items():
        at[tuning.names.index(name.replace("_", " "))] = value
    return tuning.tune(at)


def held_frequencies_hz(model):
    """Of what moves while the driven axes are held."""
    free = slice(model.inputs, None)
    squares = eigh(model.stiffness[free, free], model.mass[free, free], eigvals_only=True)
    return np.sqrt(squares) / (2 * np.pi)


def test_no_deviation_gives_the_same_model():
    model = make_hanging_model()
    same = tune_model(model)
    for name in ("mass", "damping", "stiffness"):
        assert getattr(same, name) == pytest.approx(getattr(model, name), rel=1e-9, abs=1e-9)


def test_no_deviation_gives_the_same_model_in_other_coordinates():
    model, random = make_hanging_model(), np.random.default_rng(3)
    turn = random.normal(size=(3, 3))
    other = replace(
        model,
        mass=turn.T @ model.mass @ turn,
        damping=turn.T @ model.damping @ turn,
        stiffness=turn.T @ model.stiffness @ turn,
        input=turn.T @ model.input,
        output=model.output @ turn,
    )
    same = tune_model(other)
    for name in ("mass", "damping", "stiffness"):
        assert getattr(same, name) == pytest.approx(getattr(other, name), rel=1e-7, abs=1e-7)


@pytest.mark.parametrize(
    ("what", "matrix", "size"), [("mass", "mass", 0.004), ("damping", "damping", 0.3), ("stiffness", "stiffness", 6.0)]
)
def test_a_changed_number_moves_its_own_matrix_alone(what, matrix, size):
    model = make_hanging_model()
    other = tune_model(model, **{f"{what}_fy": 2.0})
    wanted = np.zeros((3, 3))
    wanted[1, 1] = 2 * size
    for name in ("mass", "damping", "stiffness"):
        change = getattr(other, name) - getattr(model, name)
        assert change == pytest.approx(wanted if name == matrix else 0 * wanted, abs=1e-7)


def test_two_axes_are_coupled_alike_both_ways():
    model = make_hanging_model()
    change = tune_model(model, mass_fx_fy=1.0).mass - model.mass
    assert change[:2, :2] == pytest.approx(np.array([[0.0, 0.004], [0.004, 0.0]]), abs=1e-10)


def test_a_mode_s_frequency_changes_by_the_share_that_it_says():
    model = make_hanging_model()
    (name,) = (name for name in open_tuning(model).names if name.startswith("frequency"))
    assert name == f"frequency of the mode at {HANGING_HZ:.3g} Hz"
    assert held_frequencies_hz(tune_model(model, **{name: 2.0})) == pytest.approx([1.02 * HANGING_HZ])
    lost = tune_model(model, **{name: 2.0})
    ratio = lost.damping[2, 2] / np.sqrt(lost.stiffness[2, 2] * lost.mass[2, 2])
    assert ratio == pytest.approx(model.damping[2, 2] / np.sqrt(model.stiffness[2, 2] * model.mass[2, 2]))


def test_a_mode_s_mass_is_added_to_the_axis_it_is_attached_to():
    model = make_hanging_model()
    other = tune_model(model, **{f"mass of the mode at {HANGING_HZ:.3g} Hz": 3.0})
    assert held_frequencies_hz(other) == pytest.approx([HANGING_HZ])
    static = np.array([1.0, 0.0, 1.0])
    assert static @ (other.mass - model.mass) @ static == pytest.approx(0.03 * HANGING_KG)
    # The rigid motion is not held any differently.
    assert static @ (other.stiffness - model.stiffness) @ static == pytest.approx(0.0, abs=1e-6)


def test_a_mode_s_damping_is_known_less_well_than_its_frequency():
    model = make_hanging_model()
    other = tune_model(model, **{f"damping of the mode at {HANGING_HZ:.3g} Hz": 1.0})
    assert other.damping[2, 2] == pytest.approx(model.damping[2, 2] * (1 + 0.01 * DAMPING_UNCERTAINTY_RATIO))


def test_every_number_is_named_sized_and_of_a_unit():
    tuning = open_tuning(make_hanging_model())
    assert len(tuning.names) == len(set(tuning.names)) == len(tuning.deviation) == len(tuning.units) == 3 * 3 + 3
    assert dict(zip(tuning.names, tuning.units, strict=True))["damping fx fy"] == "N s/m"
    ones = dict(zip(tuning.names, tuning.to_changes(np.ones(len(tuning.names))), strict=True))
    assert (ones["mass fx"], ones["damping fy"], ones["stiffness fx fy"]) == (0.004, 0.3, 6.0)


def test_a_lever_s_numbers_are_of_a_lever():
    assert set(open_tuning(replace(make_hanging_model(), rotational=True)).units) == {
        "kg m^2",
        "N m s/rad",
        "N m/rad",
        "1",
    }


def test_where_no_tolerance_is_stated_a_tenth_is_taken():
    tuning = open_tuning(make_hanging_model(tolerance=None))
    sizes = dict(zip(tuning.names, tuning.deviation, strict=True))
    assert sizes["stiffness fx"] == pytest.approx(UNSTATED_SHARE * 130.0)
    assert sizes["mass fx fy"] == pytest.approx(UNSTATED_SHARE * (MASS_KG + HANGING_KG))


def test_a_mass_that_is_none_is_refused():
    with pytest.raises(MechanicalModelError, match="positive definite"):
        tune_model(make_hanging_model(), mass_fx=-80.0)


def test_a_rigid_model_has_no_modes_to_tune():
    model = make_hanging_model()
    rigid = replace(model, mass=np.eye(2), damping=np.eye(2), stiffness=np.eye(2), input=np.eye(2), output=np.eye(2))
    assert len(open_tuning(rigid).names) == 9


def test_small_deviations_move_the_response_in_a_straight_line():
    model, tuning = make_hanging_model(), open_tuning(make_hanging_model())
    bare = discretise_model(model, 1e-3).transition
    for number in range(len(tuning.names)):
        at = np.zeros(len(tuning.names))
        at[number] = 1e-3
        up, down = (discretise_model(tuning.tune(sign * at), 1e-3).transition - bare for sign in (1.0, -1.0))
        assert np.abs(up).max() > 0
        assert up == pytest.approx(-down, abs=1e-2 * np.abs(up).max())


@pytest.mark.parametrize(("name", "lowest"), [("mass fx", 62.5), ("damping fx", 13.4), ("stiffness fx", 21.7)])
def test_a_model_is_possible_until_a_matrix_becomes_indefinite(name, lowest):
    tuning = make_tuning(make_hanging_model(1), ("fx",))
    deviations = np.zeros(len(tuning.names))
    deviations[tuning.names.index(name)] = -0.9 * lowest
    assert tuning.is_physical(deviations)
    deviations[tuning.names.index(name)] = -1.1 * lowest
    if name == "mass fx":  # no such model can be made
        with pytest.raises(MechanicalModelError):
            tuning.is_physical(deviations)
    else:
        assert not tuning.is_physical(deviations)
