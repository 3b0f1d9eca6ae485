"""Instances of a parametrized test that `make test` leaves out: they repeat what the others show, and take longer."""

from collections.abc import Iterable

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
