import numpy as np
import pytest

from equalizer.identification.state_space.identify import identify
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.tracking.workspace.band_modes import BandMode, find_band_modes

BAND = (5.0, 35.0)


def model_of(A, B, C, D=None) -> IdentifiedModel:
    p, m = C.shape[0], B.shape[1]
    names = ("x", "y", "z")
    return IdentifiedModel(
        A, B, C, np.zeros((p, m)) if D is None else D, 1000.0, BAND, "N", "m/s^2", names[:m], names[:p]
    )


@pytest.mark.parametrize("index", [pytest.param(0, marks=pytest.mark.slow), pytest.param(1, marks=pytest.mark.slow), 2])
def test_the_device_s_own_resonances_are_found_in_an_identified_model(three, index):
    shift = 1 + 0.1 * index
    modes = find_band_modes(three.models[index], BAND)
    expected = [f * shift for f in (11.0, 13.2, 22.5, 31.0)]
    np.testing.assert_allclose([mode.natural_hz for mode in modes], expected, rtol=0.01)
    np.testing.assert_allclose([mode.damping_ratio for mode in modes], [0.06, 0.075, 0.05, 0.05], rtol=0.15)


def test_poles_that_share_a_resonance_are_one(plants, three):
    """The same response from a model that carries one of its resonances twice, half in each."""
    model = three.models[0]
    doubled = model_of(
        np.block([[model.A, np.zeros_like(model.A)], [np.zeros_like(model.A), model.A]]),
        np.vstack([model.B, model.B]),
        np.hstack([0.5 * model.C, 0.5 * model.C]),
        model.D,
    )
    once, twice = find_band_modes(model, BAND), find_band_modes(doubled, BAND)
    assert [mode.natural_hz for mode in twice] == pytest.approx([mode.natural_hz for mode in once], rel=1e-3)


@pytest.mark.slow
def test_more_poles_than_the_device_has_change_nothing(plants, workspaces, three):
    plant = plants.omega_like()
    response = workspaces.measuring.swept(plants, plant, 1)
    rich = identify(response, IdentificationSettings(order=26, draws=0, longer_horizons=(0,))).model
    found = [(mode.natural_hz, mode.damping_ratio) for mode in find_band_modes(rich, BAND)]
    few = [(mode.natural_hz, mode.damping_ratio) for mode in find_band_modes(three.models[0], BAND)]
    np.testing.assert_allclose(found, few, rtol=0.02)


def test_a_smooth_model_has_no_modes():
    A = np.diag([0.9, 0.95, 0.8])
    assert find_band_modes(model_of(A, np.eye(3), np.eye(3)), BAND) == ()


def test_a_mode_answers_as_its_pole_pair_does():
    mode = BandMode(20.0, 0.05, np.array([[1 + 2j]]), 1.0, 1000.0)
    z = np.exp(2j * np.pi * np.array([10.0, 20.0]) / 1000)
    expected = (1 + 2j) / (z - mode.pole) + (1 - 2j) / (z - np.conj(mode.pole))
    np.testing.assert_allclose(mode.compute_response(z)[:, 0, 0], expected)
    assert abs(np.log(mode.pole)) * 1000 / (2 * np.pi) == pytest.approx(20.0)
