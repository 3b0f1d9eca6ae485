from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from study.devices.simulated.drives import bend_bristle

LONGEST = 2e-4


@given(st.floats(-LONGEST, LONGEST), st.floats(-1, 1))
def test_a_bristle_never_bends_past_its_length(bristle, travel):
    assert abs(bend_bristle(bristle, travel, LONGEST)) <= LONGEST * (1 + 1e-12)


def test_it_bends_like_a_spring_first_and_slips_later():
    assert bend_bristle(0.0, LONGEST / 1000, LONGEST) == pytest.approx(LONGEST / 1000, rel=2e-3)
    assert bend_bristle(0.0, 1000 * LONGEST, LONGEST) == pytest.approx(LONGEST, rel=2e-3)


def test_it_keeps_its_bend_at_rest():
    assert bend_bristle(0.7 * LONGEST, 0.0, LONGEST) == 0.7 * LONGEST


@pytest.mark.parametrize("reach", [0.1, 1.0, 10.0, 100.0])
def test_going_round_costs_work_and_never_gives_any(reach):
    way = reach * LONGEST * np.sin(np.linspace(0, 6 * pi, 6001))
    bristle, works = 0.0, []
    for travel in np.diff(way):
        bristle = bend_bristle(bristle, travel, LONGEST)
        works.append(bristle * travel)
    last_rounds = np.sum(works[2000:])
    assert last_rounds > 0
    assert last_rounds <= 2 * 4 * reach * LONGEST**2
