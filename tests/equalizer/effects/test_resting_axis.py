"""An axis that does not move at all, as one that no command reaches in a simulation."""

import numpy as np
import pytest

from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.starts.evidence import Evidence
from tests.contracts import effect_bench

RESTS, SAMPLES = 1, 2000


@pytest.fixture(scope="module")
def resting() -> Evidence:
    noise = np.random.default_rng(1).standard_normal((SAMPLES, 3))
    noise[:, RESTS] = 0.0
    place = 1e-4 * np.cumsum(noise, axis=0)
    return Evidence(
        model=effect_bench.three_axes(),
        sample_rate_hz=effect_bench.RATE_HZ,
        command=noise,
        axis_position=place,
        axis_velocity=1e-4 * effect_bench.RATE_HZ * noise,
        axis_force=0.1 * noise,
        response=noise,
        predicted=0.9 * noise,
        noise=np.full(3, 0.01),
        used=np.ones(SAMPLES),
    )


@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.filterwarnings("ignore:Mean of empty slice", "ignore:invalid value")
def test_starting_values_at_an_axis_that_rests_are_numbers_or_none(resting, name):
    for values in EFFECTS[name].starts(resting, RESTS):
        assert np.isfinite(list(values.values())).all()
