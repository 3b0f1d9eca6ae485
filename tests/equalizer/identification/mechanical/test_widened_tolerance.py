"""A model that was fitted to what it is then compared with may be re-tuned far, and never less than it says itself."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from equalizer.identification.mechanical.physical_model import _compute_covariance
from equalizer.identification.mechanical.widened_tolerance import widen_tolerance
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance

ONE = np.eye(2)


def fitted() -> MechanicalModel:
    tolerance = Tolerance(0.001, 0.01, 0.1, 0.2)
    return MechanicalModel(
        "fitted", "acceleration", 0.3 * ONE, 8 * ONE, 100 * ONE, 2 * ONE, ONE, tolerance=tolerance
    )  # fmt: skip


def test_damping_is_opened_by_half_so_that_friction_can_be_told_from_it():
    tolerance = widen_tolerance(fitted()).tolerance
    assert tolerance is not None
    assert tolerance.mass_kg == pytest.approx(0.03)
    assert tolerance.damping_n_s_per_m == pytest.approx(4.0)
    assert tolerance.stiffness_n_per_m == pytest.approx(20.0)
    assert tolerance.modes == 0.2


def test_a_tolerance_that_is_wider_already_stays():
    wide = replace(fitted(), tolerance=Tolerance(damping_n_s_per_m=9.0))
    tolerance = widen_tolerance(wide).tolerance
    assert tolerance is not None and tolerance.damping_n_s_per_m == 9.0 and tolerance.modes == 0.03


def test_an_unknown_on_which_no_line_depends_leaves_the_tolerances_of_the_others_finite():
    jacobian = np.random.default_rng(1).standard_normal((50, 3)) * [1e8, 0.0, 10.0]
    covariance = _compute_covariance(SimpleNamespace(jacobian=jacobian, squares=47.0))
    determined = np.linalg.inv(jacobian[:, [0, 2]].T @ jacobian[:, [0, 2]])
    np.testing.assert_allclose(covariance[np.ix_([0, 2], [0, 2])], determined, rtol=1e-6)
    assert not covariance[1].any()
