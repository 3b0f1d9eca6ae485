from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel, IdentifiedModelError


@pytest.fixture
def model():
    return IdentifiedModel(
        A=np.array([[0.9, 0.1], [-0.1, 0.9]]),
        B=np.array([[1.0], [0.0]]),
        C=np.array([[0.5, 0.5]]),
        D=np.zeros((1, 1)),
        sample_rate_hz=1000.0,
        band_hz=(5.0, 35.0),
        input_unit="N",
        output_unit="m/s^2",
        input_channels=("fx",),
        output_channels=("ax",),
    )


def test_order_and_spectral_radius(model):
    assert model.order == 2
    assert model.spectral_radius == pytest.approx(np.hypot(0.9, 0.1))


def test_an_unstable_model_can_be_built_and_reports_it(model):
    assert replace(model, A=np.eye(2) * 1.01).spectral_radius == pytest.approx(1.01)


def test_parameters_go_out_and_in_row_by_row(model):
    assert model.parameters.tolist() == [0.9, 0.1, -0.1, 0.9, 1.0, 0.0, 0.5, 0.5, 0.0]
    other = model.replace_parameters(np.arange(9.0))
    assert other.A.tolist() == [[0.0, 1.0], [2.0, 3.0]]
    assert other.D.tolist() == [[8.0]]


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"A": np.eye(3)}, "B has shape (2, 1), but order 3, 1 inputs and 1 outputs require (3, 1)"),
        ({"C": np.ones((1, 3))}, "C has shape (1, 3), but order 2, 1 inputs and 1 outputs require (1, 2)"),
        ({"D": np.array([[np.nan]])}, "D holds values that are not finite numbers"),
        ({"input_channels": ("fx", "fy")}, "input_channels names 2 channels, but the matrices have 1"),
        ({"output_unit": ""}, "output_unit: the unit is missing; allowed are"),
        ({"output_unit": "g"}, "output_unit is 'g'; a model is in SI units, here m/s^2"),
        ({"output_unit": ("m", "m")}, "output_unit holds 2 units for 1 channels; one for all, or one per channel"),
        ({"sample_rate_hz": 0.0}, "sample_rate_hz is 0.0; it must be a positive number"),
        ({"band_hz": (5.0, 501.0)}, "band_hz is 5 to 501; it must rise within 0 and half the sample rate, 500 Hz"),
        ({"band_hz": (35.0, 5.0)}, "band_hz is 35 to 5; it must rise"),
        ({"delay_samples": -1.0}, "delay_samples is -1.0; it must be a number that is not negative"),
        ({"place_m": (0.0, np.nan, 0.0)}, "place_m is (0.0, nan, 0.0); it must be three numbers"),
        ({"covariance": np.eye(3)}, "covariance has shape (3, 3), but the 9 entries of A, B, C, D need (9, 9)"),
        ({"covariance": np.full((9, 9), np.nan)}, "covariance holds values that are not finite numbers"),
        ({"covariance": np.triu(np.ones((9, 9)))}, "covariance is not symmetric"),
        ({"covariance": -np.eye(9)}, "covariance has a negative variance on its diagonal"),
        ({"samples": np.ones((4, 3))}, "samples has shape (4, 3), but must be (draws, 9)"),
        ({"samples": np.full((4, 9), np.inf)}, "samples holds values that are not finite numbers"),
    ],
)
def test_what_cannot_be_is_refused_in_words(model, changes, problem):
    with pytest.raises(IdentifiedModelError) as refused:
        replace(model, **changes)
    assert any(found.startswith(problem) for found in refused.value.problems), refused.value.problems


def test_a_channel_named_twice_is_refused(model):
    with pytest.raises(IdentifiedModelError, match="input_channels names a channel twice: fx, fx"):
        replace(model, B=np.ones((2, 2)), D=np.zeros((1, 2)), input_channels=("fx", "fx"))


def test_channels_may_be_a_list_and_units_are_listed_by_channel(model):
    listed = replace(model, input_channels=["fx"], output_channels="ax")
    assert (listed.input_channels, listed.output_channels) == (("fx",), ("ax",))
    assert (listed.input_units, replace(model, output_unit=("m",)).output_units) == (("N",), ("m",))
