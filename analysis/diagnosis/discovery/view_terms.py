"""Candidate terms of one view: for a force along an axis those of the grammar, for a reading those of a sensor's error.

Terms of a reading are powers, soft limits, dead zones, hysteresis (play), drift, and products with other channels. What
is linear in the readings, such as a gain, a lag or a cross-axis share, is left to the effects of the catalogue.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np

from analysis.diagnosis.discovery.grammar import (
    AXES,
    POWER,
    Columns,
    Term,
    axes_of,
    bent_terms,
    even_power,
    odd_power,
    periodic_terms,
    terms_of,
)
from analysis.diagnosis.discovery.matched_filter import View


def view_terms(view: View) -> tuple[Term, ...]:
    """All terms of a view. Spatial periods and frequencies of periodic terms are estimated from its first recording."""
    seen = view.records[0]
    if view.acts_on == "response":
        return terms_of_readings(seen.columns, view.axis, len(seen.reading_units))
    axes = axes_of(seen.columns, seen.missing_force.shape[1])
    terms = terms_of(axes, view.axis, len(seen.missing_force) / seen.rate_hz, seen.rate_hz)
    lines = periodic_terms(seen.columns, axes[view.axis], seen.missing_force[:, view.axis], seen.rate_hz)
    return (*terms, *lines)


def terms_of_readings(columns: Columns, channel: int, channels: int) -> tuple[Term, ...]:
    """All terms for one channel of a response. columns: signals by name; channel: its index; channels: their number.
    Thresholds start at shares of the channel's largest reading."""
    names = [f"a{axis}" for axis in AXES[:channels]]
    own, others = names[channel], [name for name in names if name != names[channel]]
    size = max(float(np.abs(columns[own]).max()), 1e-12)
    return (*_own_terms(own, size), *_cross_terms(own, others))


def _own_terms(own: str, size: float) -> Iterator[Term]:
    """Terms of one channel's own reading. size: its largest magnitude."""
    yield Term(f"sign({own})")
    for start in (0.5, 1.5, 2.0, 3.0, 5.0):
        yield Term(odd_power(own, 0), (start,), (POWER,), (0,))
    for start in (1.0, 2.0, 4.0):
        yield Term(even_power(own, 0), (start,), (POWER,), (0,))
    yield from bent_terms(own, size)
    for share in (0.2, 0.5, 0.8):
        edge = (share * size,), ((0.0, size),)
        yield Term(f"maximum(abs({own}) - p0, 0)*sign({own})", *edge)
        yield from (Term(f"maximum({side} - p0, 0)", *edge) for side in (own, f"(-{own})"))
        yield Term(f"play({own}, p0)", (0.1 * share * size,), ((1e-4 * size, size),))
    yield from (Term(shape) for shape in (f"{own}*t", "t"))


def _cross_terms(own: str, others: list[str]) -> Iterator[Term]:
    """Products and powers up to the third order that involve other channels of the response."""
    for other in others:
        shapes = (
            f"{own}*{other}", f"{other}**2", f"{other}*abs({other})", f"abs({other})", f"{own}*abs({other})",
            f"abs({own})*{other}", f"{own}*{other}**2", f"{own}**2*{other}", f"{other}**3",
        )  # fmt: skip
        yield from (Term(shape) for shape in shapes)
    yield from (Term(f"{first}*{second}") for first, second in product(others, others) if first < second)
