"""A weight that a recording says is the model's there, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.input_checks import NothingToDiagnoseError, require_model_of
from analysis.diagnosis.data.recorded_conditions import add_mass, add_payload, has_payload
from analysis.diagnosis.errors.choose_measure import make_measure
from equalizer.effects.simulation.simulator import simulate_mechanism

ADDED_KG = 0.03


@pytest.fixture(scope="module")
def recordings(diagnosed):
    """Of the same device without friction, bare and with a weight; the second is told, not the file."""
    bare = diagnosed.recorded(1, (), 4)
    played = simulate_mechanism(add_mass(diagnosed.device(1), ADDED_KG), bare.command.samples, diagnosed.RATE_HZ)
    noise = np.random.default_rng(5).standard_normal(played.response.shape)
    response = replace(bare.response, samples=played.response + diagnosed.NOISE[0] * noise)
    position = replace(bare.position, samples=played.position + diagnosed.NOISE[1] * noise)
    return bare, replace(bare, response=response, position=position)


def largest_error(recording, model):
    """In units of the noise."""
    measure = make_measure([recording], model).measure
    (left,) = measure.residuals(model, ())
    return float(np.sqrt(np.mean(left**2, axis=0)).max())


def test_a_recording_with_a_weight_agrees_with_a_model_that_is_told_of_it(recordings, diagnosed):
    model, (bare, heavy) = diagnosed.device(1), recordings
    assert largest_error(bare, model) < 1.2
    assert largest_error(heavy, model) > 5.0
    assert largest_error(replace(heavy, meta={"added_mass_kg": ADDED_KG}), model) < 1.2


def test_the_weight_of_one_recording_is_not_that_of_another(recordings, diagnosed):
    bare, heavy = recordings
    model, told = diagnosed.device(1), replace(heavy, meta={"added_mass_kg": ADDED_KG})
    measure = make_measure([bare, told], model).measure
    assert all(np.sqrt(np.mean(left**2)) < 1.2 for left in measure.residuals(model, ()))
    assert (has_payload([bare]), has_payload([bare, told])) == (False, True)


def test_a_recording_that_says_nothing_leaves_the_model_as_it_is(recordings, diagnosed):
    model = diagnosed.device(1)
    assert add_payload(model, recordings[0]) is model


@pytest.mark.parametrize(
    ("meta", "words"),
    [
        ({"added_mass_kg": -0.1}, "added_mass_kg = -0.1, which must be a number from 0 on"),
        ({"added_mass_kg": "30 g"}, "added_mass_kg = '30 g', which must be a number from 0 on"),
        ({"added_mass_kg": True}, "which must be a number from 0 on"),
        ({"added_inertia_kg_m2": 0.1}, "the model's device translates: state added_mass_kg"),
    ],
)
def test_a_weight_that_is_none_is_refused(recordings, diagnosed, meta, words):
    with pytest.raises(NothingToDiagnoseError, match="added_mass_kg") as refusal:
        require_model_of(diagnosed.device(1), [replace(recordings[0], meta=meta)])
    assert words in str(refusal.value)
