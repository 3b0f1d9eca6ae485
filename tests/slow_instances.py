"""Instances of a parametrized test that `make test` leaves out: they repeat what the others show, and take longer."""

import itertools
from collections.abc import Iterable, Sequence

import pytest


def slow(*values) -> list:
    """The values of a single parameter, with the marker `slow`."""
    return [pytest.param(value, marks=pytest.mark.slow) for value in values]


def slow_rows(*rows) -> list:
    """The rows of several parameters, with the marker `slow`."""
    return [pytest.param(*row, marks=pytest.mark.slow) for row in rows]


def slow_after(quick: int, values: Iterable) -> list:
    """The values of a single parameter; those after the first `quick` have the marker `slow`."""
    listed = list(values)
    return [*listed[:quick], *slow(*listed[quick:])]


def each_pair_once(first: Sequence, second: Sequence, third: Sequence) -> list:
    """Rows of all combinations: each pair of the first two with one of the third in turn; the others are `slow`."""
    rows = []
    for (i, a), (k, b) in itertools.product(enumerate(first), enumerate(second)):
        turn = (i + k) % len(third)
        rows += [(a, b, third[turn]), *slow_rows(*((a, b, c) for c in (*third[:turn], *third[turn + 1 :])))]
    return rows
