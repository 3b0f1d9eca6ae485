"""Candidate terms of one view: for a force along an axis those of the grammar, for a reading those of a sensor's error.

Terms of a reading are its sign, powers, soft limits, dead zones, hysteresis (play), drift, and products with other
channels. What is linear in the readings, such as a gain, a lag or a cross-axis share, is left to the effects of the
catalogue.
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


def list_view_terms(view: View) -> tuple[Term, ...]:
    """All terms of a view. Spatial periods and frequencies of periodic terms are estimated from its first recording."""
    record = view.records[0]
    if view.acts_on == "response":
        return list_reading_terms(record.columns, view.axis, len(record.reading_units))
    axes = measure_axes(record.columns, record.missing_force.shape[1])
    terms = list_terms(axes, view.axis, len(record.missing_force) / record.rate_hz, record.rate_hz)
    periodic_terms = find_periodic_terms(
        record.columns, axes[view.axis], record.missing_force[:, view.axis], record.rate_hz
    )
    return (*terms, *periodic_terms)


def list_reading_terms(columns: Columns, channel: int, channel_count: int) -> tuple[Term, ...]:
    """All terms for one channel of a response. columns: signals by name; channel: its index; channel_count: of all.
    Thresholds start at shares of the channel's largest reading."""
    names = [f"a{axis}" for axis in AXES[:channel_count]]
    reading, other_readings = names[channel], [name for name in names if name != names[channel]]
    largest_reading = max(float(np.abs(columns[reading]).max()), 1e-12)
    return (*_generate_own_terms(reading, largest_reading), *_generate_cross_terms(reading, other_readings))


def _generate_own_terms(reading: str, largest_reading: float) -> Iterator[Term]:
    """Terms of one channel's own reading. largest_reading: its largest magnitude."""
    yield Term(f"sign({reading})")
    for start in (0.5, 1.5, 2.0, 3.0, 5.0):
        yield Term(format_odd_power(reading, 0), (start,), (POWER_BOUNDS,), (0,))
    for start in (1.0, 2.0, 4.0):
        yield Term(format_even_power(reading, 0), (start,), (POWER_BOUNDS,), (0,))
    yield from generate_soft_limit_terms(reading, largest_reading)
    for share in (0.2, 0.5, 0.8):
        threshold = (share * largest_reading,), ((0.0, largest_reading),)
        yield Term(f"maximum(abs({reading}) - p0, 0)*sign({reading})", *threshold)
        yield from (Term(f"maximum({side} - p0, 0)", *threshold) for side in (reading, f"(-{reading})"))
        yield Term(
            f"play({reading}, p0)", (0.1 * share * largest_reading,), ((1e-4 * largest_reading, largest_reading),)
        )
    yield from (Term(shape) for shape in (f"{reading}*t", "t"))


def _generate_cross_terms(a: str, other_readings: list[str]) -> Iterator[Term]:
    """Products and powers up to the third order that involve other channels of the response. a: name of the channel's
    own reading."""
    for b in other_readings:
        shapes = (
            f"{a}*{b}", f"{b}**2", f"{b}*abs({b})", f"abs({b})", f"{a}*abs({b})",
            f"abs({a})*{b}", f"{a}*{b}**2", f"{a}**2*{b}", f"{b}**3",
        )  # fmt: skip
        yield from (Term(shape) for shape in shapes)
    yield from (
        Term(f"{first_reading}*{second_reading}")
        for first_reading, second_reading in product(other_readings, other_readings)
        if first_reading < second_reading
    )
