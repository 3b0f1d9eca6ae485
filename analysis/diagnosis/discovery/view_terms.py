"""Candidate terms of the sparse regression that discovers the formula of an unknown effect, for one output (`View`).

A view is the filtered residual either of the force along an axis, with the terms of `grammar`, or of the reading of one
response channel, with terms of sensor errors: sign, powers, soft limits, dead zones, hysteresis (play), drift, and
products with other channels. Terms that are linear in the readings (gain, lag, cross-axis sensitivity) are left out,
because the effects of the catalogue describe them. Start values and bounds are chosen by hand.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np

from analysis.diagnosis.discovery.grammar import (
    AXES,
    POWER_BOUNDS,
    Columns,
    Term,
    format_even_power,
    format_odd_power,
    generate_soft_limit_terms,
    list_terms,
    measure_axes,
)
from analysis.diagnosis.discovery.matched_filter import View
from analysis.diagnosis.discovery.periodic_terms import find_periodic_terms


def list_view_terms(view: View) -> tuple[Term, ...]:
    """List all candidate terms of a view. Starting values and bounds, and the periods and frequencies of periodic
    terms, are taken from the record with the largest missing force (sum of squares), so that the order of the
    records does not matter."""
    record = max(view.records, key=lambda candidate: float(np.sum(candidate.missing_force**2)))
    if view.acts_on == "response":
        return list_reading_terms(record.columns, view.axis, len(record.reading_units))
    axes = measure_axes(record.columns, record.missing_force.shape[1])
    terms = list_terms(axes, view.axis, len(record.missing_force) / record.rate_hz, record.rate_hz)
    periodic_terms = find_periodic_terms(
        record.columns, axes[view.axis], record.missing_force[:, view.axis], record.rate_hz
    )
    return (*terms, *periodic_terms)


def list_reading_terms(columns: Columns, channel: int, channel_count: int) -> tuple[Term, ...]:
    """List all candidate terms of one response channel. columns: signals (n,) by name; channel: index of the channel;
    channel_count: number of response channels. Thresholds start at fractions of the channel's largest magnitude."""
    names = [f"a{axis}" for axis in AXES[:channel_count]]
    reading, other_readings = names[channel], [name for name in names if name != names[channel]]
    largest_reading = max(float(np.abs(columns[reading]).max()), 1e-12)
    return (*_generate_single_terms(reading, largest_reading), *_generate_cross_terms(reading, other_readings))


def _generate_single_terms(reading: str, largest_reading: float) -> Iterator[Term]:
    """Generate the terms that contain the reading of the channel alone, and time t. reading: name of the signal;
    largest_reading: its largest magnitude, in its unit."""
    yield Term(f"sign({reading})")
    for start in (0.5, 1.5, 2.0, 3.0, 5.0):
        yield Term(format_odd_power(reading, 0), (start,), (POWER_BOUNDS,), (0,))
    for start in (1.0, 2.0, 4.0):
        yield Term(format_even_power(reading, 0), (start,), (POWER_BOUNDS,), (0,))
    yield from generate_soft_limit_terms(reading, largest_reading)
    for share in (0.2, 0.5, 0.8):
        threshold_range = (share * largest_reading,), ((0.0, largest_reading),)
        yield Term(f"maximum(abs({reading}) - p0, 0)*sign({reading})", *threshold_range)
        yield from (Term(f"maximum({side} - p0, 0)", *threshold_range) for side in (reading, f"(-{reading})"))
        yield Term(
            f"play({reading}, p0)", (0.1 * share * largest_reading,), ((1e-4 * largest_reading, largest_reading),)
        )
    yield from (Term(shape) for shape in (f"{reading}*t", "t"))


def _generate_cross_terms(reading: str, other_readings: list[str]) -> Iterator[Term]:
    """Generate products and powers up to the third order that contain readings of other response channels. reading:
    name of the channel's own."""
    for cross in other_readings:
        shapes = (
            f"{reading}*{cross}", f"{cross}**2", f"{cross}*abs({cross})", f"abs({cross})", f"{reading}*abs({cross})",
            f"abs({reading})*{cross}", f"{reading}*{cross}**2", f"{reading}**2*{cross}", f"{cross}**3",
        )  # fmt: skip
        yield from (Term(shape) for shape in shapes)
    yield from (
        Term(f"{first_reading}*{second_reading}")
        for first_reading, second_reading in product(other_readings, other_readings)
        if first_reading < second_reading
    )
