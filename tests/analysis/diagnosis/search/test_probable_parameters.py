"""Of effects that fit equally well, the one whose re-tuned parameters agree with the calibration is chosen."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.limits import EXPLAINED_ERROR
from analysis.diagnosis.search.parsimony import has_improbable_deviations, is_more_probable
from analysis.diagnosis.search.revise_selection import exchange_first_effects
from analysis.diagnosis.search.time_budget import grant_time
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect
from equalizer.plant.mechanical_model import Tolerance
from tests.analysis.diagnosis.search.test_exchange import claim, effect_names, explain_by, ignore_progress

HAND = {"mass": 0.012, "damping": 1.4, "stiffness": 40.0}
CATALOGUE = [EFFECTS[name] for name in ("force_gain", "hand_impedance", "sensor_lag", "added_mass")]


@pytest.fixture(scope="module")
def held_device(make_context, diagnosed):
    """A hand and a lag, with a calibration so uncertain that a gain of all forces leaves no error either."""
    model = replace(diagnosed.device(1), tolerance=Tolerance(0.004, 0.35, 9.8, 0.01))
    effects = (
        PlacedEffect(EFFECTS["hand_impedance"], (0,), HAND),
        PlacedEffect(EFFECTS["sensor_lag"], (0,), {"bandwidth": 60.0}),
    )
    return make_context(effects, model)


def deviating(candidate, *deviations):
    return replace(candidate, fitted=replace(candidate.fitted, deviations=np.array(deviations)))


def test_a_hand_replaces_a_gain_that_fits_as_well_with_an_improbable_model(held_device):
    gain = explain_by(held_device, claim("force_gain", gain=0.95), claim("sensor_lag", bandwidth=60.0))
    assert gain.after.score.worst_channel < EXPLAINED_ERROR and has_improbable_deviations(gain.after)
    found = exchange_first_effects(held_device, gain, CATALOGUE, ignore_progress, grant_time)
    assert effect_names(found) == ["hand_impedance", "sensor_lag"]
    # With a model that agrees with its calibration, nothing is exchanged.
    assert not has_improbable_deviations(found.after)
    assert exchange_first_effects(held_device, found, CATALOGUE, ignore_progress, grant_time) is found


def test_deviations_are_improbable_beyond_what_chance_gives_so_many_parameters(make_candidate):
    candidate = make_candidate(1.0, "force_gain")
    assert has_improbable_deviations(deviating(candidate, 3.5))
    assert not has_improbable_deviations(deviating(candidate, 2.0))
    # |d|² = 25 is improbable for three parameters (1.5e-5) and expected for twenty-five.
    assert has_improbable_deviations(deviating(candidate, 5.0, 0.0, 0.0))
    assert not has_improbable_deviations(deviating(candidate, *np.ones(25)))
    assert not has_improbable_deviations(candidate)


def test_a_larger_error_or_a_small_difference_replaces_nothing(make_candidate):
    far = deviating(make_candidate(1.0, "force_gain"), 4.0)
    near, worse = (deviating(make_candidate(error, "hand_impedance"), 0.0) for error in (1.0, 1.3))
    assert is_more_probable(far, near)
    assert not is_more_probable(far, worse)
    assert not is_more_probable(deviating(far, 3.0), near)
