"""What the Williams design promises, counted."""

from collections import Counter
from itertools import pairwise

import pytest

from protocols.procedure.schedule import make_williams_rows


@pytest.mark.parametrize("conditions", range(1, 12))
def test_every_condition_stands_in_every_position_equally_often(conditions):
    rows = make_williams_rows(conditions)
    counted = Counter((position, condition) for row in rows for position, condition in enumerate(row))
    assert len(counted) == conditions**2
    assert set(counted.values()) == {len(rows) // conditions}


@pytest.mark.parametrize("conditions", range(2, 12))
def test_every_condition_follows_every_other_equally_often(conditions):
    counted = Counter(pair for row in make_williams_rows(conditions) for pair in pairwise(row))
    assert len(counted) == conditions * (conditions - 1)
    assert set(counted.values()) == {1 if conditions % 2 == 0 else 2}


@pytest.mark.parametrize(("conditions", "rows"), [(4, 4), (5, 10), (6, 6)])
def test_an_odd_number_needs_twice_the_rows(conditions, rows):
    assert len(make_williams_rows(conditions)) == rows


def test_a_plain_rotation_would_not_balance_the_neighbours():
    rotation = [tuple((place + shift) % 5 for place in range(5)) for shift in range(5)]
    assert len(Counter(pair for row in rotation for pair in pairwise(row))) < 20


def test_a_design_of_nothing_is_refused():
    with pytest.raises(ValueError, match="a Williams design needs one condition at the least, not 0"):
        make_williams_rows(0)
