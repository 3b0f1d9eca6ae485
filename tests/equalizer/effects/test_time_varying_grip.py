import numpy as np
import pytest

from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.time_varying_grip import EFFECT


@pytest.mark.parametrize(("samples", "starts"), [(50, 0), (100, 1), (2000, 2)])
def test_a_modulation_starts_within_its_range_however_short_the_recording_is(bench, samples, starts):
    """Where no frequency was left, a modulation of 0 Hz was suggested, below the lower bound."""
    noise = np.random.default_rng(3).standard_normal((5, samples, 1))
    evidence = Evidence(bench.one_axis(), 1000.0, *noise, noise[4], np.ones(1), np.ones(samples))
    found = EFFECT.starts(evidence, 0)
    assert len(found) == starts
    assert all(values["rate_hz"] >= EFFECT.parameters[0].lower for values in found)
