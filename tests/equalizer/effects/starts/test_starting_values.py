"""Laws that are fitted beside nuisances."""

import numpy as np
import pytest

from equalizer.effects.starts.starting_values import PartialRegression


def test_a_law_is_found_beside_what_comes_with_it():
    random = np.random.default_rng(1)
    nuisances, law = random.normal(size=(400, 3)), random.normal(size=400)
    force = nuisances @ np.array([3.0, -2.0, 5.0]) + 0.7 * law
    found = PartialRegression(force, nuisances).fit(law)
    assert found.strengths == pytest.approx([0.7])
    assert found.explained_share == pytest.approx(1.0)


def test_where_nothing_is_known_nothing_is_found():
    """Recordings whose samples all fall out of what counts as moving."""
    found = PartialRegression(np.zeros(0), np.zeros((0, 3))).fit(np.ones(0))
    assert found.strengths == pytest.approx([0.0])
