"""Which two models are two bands of one device."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.tracking.bands.narrow_and_wide_models import TwoModels

NARROW = IdentifiedModel(
    np.zeros((3, 3)), np.eye(3), np.eye(3), np.zeros((3, 3)), 1000.0, (5.0, 35.0), "N", "m/s^2",
    ("fx", "fy", "fz"), ("ax", "ay", "az"), provenance={"hand": ["none"], "input": "command"},
)  # fmt: skip


def test_a_wide_model_an_octave_beyond_the_narrow_one_makes_bands():
    assert TwoModels(NARROW, replace(NARROW, band_hz=(5.0, 400.0))).wide.band_hz == (5.0, 400.0)


def test_a_little_wider_is_no_second_band():
    with pytest.raises(ValueError, match="must begin at 35 Hz or below and reach 70 Hz or more"):
        TwoModels(NARROW, replace(NARROW, band_hz=(5.0, 50.0)))


@pytest.mark.parametrize("other", [{"hand": ["held"], "input": "command"}, {"hand": ["none"], "input": "excitation"}])
def test_models_held_or_driven_otherwise_are_of_two_devices(other):
    with pytest.raises(
        ValueError,
        match="the narrower one was made without a hand and without the spring in it, .* held and driven alike",
    ):
        TwoModels(NARROW, replace(NARROW, band_hz=(5.0, 400.0), provenance=other))


def test_models_of_others_that_say_nothing_of_it_are_taken():
    assert TwoModels(NARROW, replace(NARROW, band_hz=(5.0, 400.0), provenance={}))
