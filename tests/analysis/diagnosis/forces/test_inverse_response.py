"""The inverse response fitted to a few lines, against the system solved at each line."""

import numpy as np
import pytest

from analysis.diagnosis.forces import inverse_response as module
from analysis.diagnosis.forces.inverse_response import compute_inverse_response, make_fast_inverse_response
from equalizer.plant.mechanical_model import MechanicalModel

RATE_HZ = 1000.0
LINES = np.linspace(0.0, RATE_HZ / 2, 5001)


def make_device(coupling_n_s_per_m: float) -> MechanicalModel:
    """A motor, a handle behind a cable, and a body that hangs on the handle, along each of two axes."""
    k, c = np.array([[9000.0, -9000.0, 0.0], [-9000.0, 9800.0, -500.0], [0.0, -500.0, 500.0]]), coupling_n_s_per_m
    damping = np.array([[4.0 + c, -c, 0.0], [-c, 3.0 + c, -0.4], [0.0, -0.4, 0.4]])
    both = np.diag([1.0, 1.3])
    identity = np.eye(2)
    return MechanicalModel(
        name="two axes", quantity="position", mass=np.kron(np.diag([0.1, 0.15, 0.02]), both),
        damping=np.kron(damping, identity), stiffness=np.kron(k, both), input=np.kron([[1.0], [0.0], [0.0]], identity),
        output=np.kron([[0.0, 1.0, 0.0]], identity),
    )  # fmt: skip


@pytest.mark.parametrize("coupling", [0.0, 8.0])
def test_all_lines_follow_from_a_few(coupling):
    model = make_device(coupling)
    wanted, found = (
        compute_inverse_response(model, LINES),
        make_fast_inverse_response(model, len(LINES), RATE_HZ / 2)(LINES),
    )
    for part in (slice(0, 2), slice(2, 4)):
        scale = np.abs(wanted[:, part]).max(axis=(1, 2), keepdims=True)
        assert (np.abs(found - wanted)[:, part] / scale).max() < 1e-7
    assert not np.array_equal(found, wanted)


def test_where_few_lines_do_not_determine_the_others_all_are_solved_for(monkeypatch):
    monkeypatch.setattr(module, "compute_transmission_zeros", lambda model, largest: np.array([-3.0 + 40.0j]))
    found = make_fast_inverse_response(make_device(8.0), len(LINES), RATE_HZ / 2)(LINES)
    assert np.array_equal(found, compute_inverse_response(make_device(8.0), LINES))
