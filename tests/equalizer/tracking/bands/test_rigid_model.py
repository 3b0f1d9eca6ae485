import numpy as np
import pytest

from equalizer.tracking.bands.rigid_model import RigidModel, fit_rigid_model

LINES_HZ = np.arange(0.5, 4.05, 0.1)


def test_a_rigid_device_is_recovered():
    draw = np.random.default_rng(3).standard_normal
    true = RigidModel(0.3 * np.eye(3) + 0.02 * draw((3, 3)), 5 * np.eye(3) + draw((3, 3)), 100 * np.eye(3), 0.002)
    late = np.exp(-1j * np.pi * LINES_HZ / 1000)[:, None, None]
    found = fit_rigid_model(
        LINES_HZ, np.linalg.inv(true.compute_force_per_acceleration(LINES_HZ)) * late, 1000.0, 0.002
    )
    assert np.allclose(found.mass_kg, true.mass_kg, rtol=1e-6, atol=1e-9)
    assert np.allclose(found.damping_n_s_per_m, true.damping_n_s_per_m, rtol=1e-6, atol=1e-9)
    assert np.allclose(found.stiffness_n_per_m, true.stiffness_n_per_m, rtol=1e-6, atol=1e-9)


def test_the_synthetic_device_is_rigid_to_two_percent_from_1_to_4_hz(plants):
    device = plants.omega_like()
    rigid = fit_rigid_model(LINES_HZ, device.response(LINES_HZ), 1000.0)
    lines = np.arange(1.0, 4.05, 0.5)
    late = np.exp(1j * np.pi * lines / 1000)[:, None, None]
    played = device.response(lines) @ (rigid.compute_force_per_acceleration(lines) * late)
    assert np.linalg.norm(played - np.eye(3), 2, axis=(1, 2)).max() < 0.025


def test_what_no_rigid_model_can_be_fitted_to_is_refused():
    eye = np.broadcast_to(np.eye(3, dtype=complex), (2, 3, 3))
    with pytest.raises(ValueError, match="two or more frequencies above zero"):
        fit_rigid_model(np.array([0.0, 1.0]), eye, 1000.0)
    with pytest.raises(ValueError, match="does not move all axes"):
        fit_rigid_model(np.array([1.0, 2.0]), eye * np.diag([1, 1, 0]), 1000.0)
    with pytest.raises(ValueError, match="square matrices of one shape"):
        RigidModel(np.eye(3), np.eye(3), np.eye(2))
