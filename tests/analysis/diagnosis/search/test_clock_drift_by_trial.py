"""A clock that runs wrong is found in less than a second, too."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.diagnosis.search.starting_hypotheses import search_clock_drift
from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.simulation.interpolated_response import resample_response
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel, SensorLimits

RATE_HZ, SAMPLES = 4000.0, 3000
ONE = np.array([[1.0]])


@pytest.fixture
def evidence() -> Evidence:
    """Of a response that is as predicted but for a hundredth; its first half is not used."""
    random = np.random.default_rng(2)
    predicted = lfilter([1.0], [1.0, -1.85, 0.95], random.normal(size=(SAMPLES, 1)), axis=0)
    noise = 0.01 * predicted.std()
    none = np.zeros((SAMPLES, 1))
    return Evidence(
        model=MechanicalModel("one", "acceleration", ONE, ONE, ONE, ONE, ONE, SensorLimits(0.0, 0.0)),
        sample_rate_hz=RATE_HZ,
        command=random.normal(size=(SAMPLES, 1)),
        axis_position=none,
        axis_velocity=none,
        axis_force=none,
        response=predicted + noise * random.normal(size=predicted.shape),
        predicted=predicted,
        noise=np.array([noise]),
        used=(np.arange(SAMPLES) >= SAMPLES // 2).astype(np.float64),
    )


@pytest.mark.parametrize("ppm", [-3000.0, 900.0])
def test_its_rate_is_nearly_found(evidence, ppm):
    drifted = replace(evidence, response=resample_response(evidence.response, 1 + 1e-6 * ppm, 0.0, 0.0))
    starts = search_clock_drift(CATALOGUE, drifted)
    assert {start.claims[0].effect.name for start in starts} == {"clock_drift"}
    # To a fraction of the period by which it is off at the end.
    assert starts[0].list_placed_effects()[0].values["ppm"] == pytest.approx(ppm, abs=600)


def test_a_clock_that_runs_right_is_not_suggested(evidence):
    assert search_clock_drift(CATALOGUE, evidence) == ()


def test_nor_is_what_may_not_be_named(evidence):
    drifted = replace(evidence, response=resample_response(evidence.response, 1.003, 0.0, 0.0))
    assert search_clock_drift([each for each in CATALOGUE if each.name != "clock_drift"], drifted) == ()
