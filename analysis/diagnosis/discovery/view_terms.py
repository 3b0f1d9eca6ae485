"""Candidate terms of one view: for a force along an axis those of the grammar, for a reading those of a sensor's error.

Terms of a reading are powers, soft limits, dead zones, hysteresis (play), drift, and products with other channels. What
is linear in the readings, such as a gain, a lag or a cross-axis share, is left to the effects of the catalogue.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np

from analysis.diagnosis.discovery.grammar import (
    AXES,
    POWER_BOUNDS,
    Columns,
    Term,
    find_periodic_terms,
    format_even_power,
    format_odd_power,
    generate_soft_limit_terms,
    list_terms,
    measure_axes,
)
from analysis.diagnosis.discovery.matched_filter import View


def view_terms(view: View) -> tuple[Term, ...]:
    """All terms of a view. Spatial periods and frequencies of periodic terms are estimated from its first recording."""
    record = view.records[0]
    if view.acts_on == "response":
        return terms_of_readings(record.columns, view.axis, len(record.reading_units))
    axes = measure_axes(record.columns, record.missing_force.shape[1])
    terms = list_terms(axes, view.axis, len(record.missing_force) / record.rate_hz, record.rate_hz)
    lines = find_periodic_terms(record.columns, axes[view.axis], record.missing_force[:, view.axis], record.rate_hz)
    return (*terms, *lines)


def terms_of_readings(columns: Columns, channel: int, channels: int) -> tuple[Term, ...]:
    """All terms for one channel of a response. columns: signals by name; channel: its index; channels: their number.
    Thresholds start at shares of the channel's largest reading."""
    names = [f"a{axis}" for axis in AXES[:channels]]
    reading, other_readings = names[channel], [name for name in names if name != names[channel]]
    size = max(float(np.abs(columns[reading]).max()), 1e-12)
    return (*_own_terms(reading, size), *_cross_terms(reading, other_readings))


def _own_terms(reading: str, size: float) -> Iterator[Term]:
    """Terms of one channel's own reading. size: its largest magnitude."""
    yield Term(f"sign({reading})")
    for start in (0.5, 1.5, 2.0, 3.0, 5.0):
        yield Term(format_odd_power(reading, 0), (start,), (POWER_BOUNDS,), (0,))
    for start in (1.0, 2.0, 4.0):
        yield Term(format_even_power(reading, 0), (start,), (POWER_BOUNDS,), (0,))
    yield from generate_soft_limit_terms(reading, size)
    for share in (0.2, 0.5, 0.8):
        edge = (share * size,), ((0.0, size),)
        yield Term(f"maximum(abs({reading}) - p0, 0)*sign({reading})", *edge)
        yield from (Term(f"maximum({side} - p0, 0)", *edge) for side in (reading, f"(-{reading})"))
        yield Term(f"play({reading}, p0)", (0.1 * share * size,), ((1e-4 * size, size),))
    yield from (Term(shape) for shape in (f"{reading}*t", "t"))


def _cross_terms(a: str, other_readings: list[str]) -> Iterator[Term]:
    """Products and powers up to the third order that involve other channels of the response."""
    for b in other_readings:
        shapes = (
            f"{a}*{b}", f"{b}**2", f"{b}*abs({b})", f"abs({b})", f"{a}*abs({b})",
            f"abs({a})*{b}", f"{a}*{b}**2", f"{a}**2*{b}", f"{b}**3",
        )  # fmt: skip
        yield from (Term(shape) for shape in shapes)
    yield from (
        Term(f"{first}*{second}") for first, second in product(other_readings, other_readings) if first < second
    )
