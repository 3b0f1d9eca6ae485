"""Laws without a name in the catalogue as terms of the force balance: powers, saturation, products and attraction.

Called by `compare_free_laws`. With position q and velocity v of the driven axis, weight w, and nonlinear parameters p
(exponent), s (scale) and a (position), the force that resists the motion is

    power_of_speed           w sgn(v) |v|^p         power_of_position        w sgn(q) |q|^p
    even_power_of_speed      w |v|^p                even_power_of_position   w |q|^p
    saturating_damping       w tanh(v / s)          exponential_spring       w exp(q / s)
    damping_beyond_speed     w sgn(v) max(|v| - s, 0)   contact_beyond_position  w max(q - a, 0) or -w max(a - q, 0)
    falling_friction         w sgn(v) exp(-(v / s)^2)
    product_of_position_and_speed   w g(q, v), for each g in `PRODUCTS`
    inverse_distance         w / (q - a)^n, n = 1 or 2, with a outside the travel

Each depends on one axis alone, so that a formula can express it. Nonlinear parameters are tried on grids over the
motion and refined like those of the catalogue's laws (`structures`), within wide bounds, chosen by hand, that exclude
columns that are nearly zero or linear. In the code, c is the index of the driven channel in the motion m, n are the
nonlinear parameters and w the weights, as in `law`.
"""

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from analysis.diagnosis.balance.laws.friction_laws import LEAST_WIDTH_SHARE
from analysis.diagnosis.balance.laws.law import (
    Columns,
    Formula,
    Law,
    NonlinearParameters,
    Scales,
    WeightConverter,
    make_contact_columns,
    smooth_sign,
)
from analysis.diagnosis.balance.motion import Motion
from equalizer.signals.signal import FloatArray

FREE_SPEED_LAWS = {"power_of_speed", "even_power_of_speed", "saturating_damping", "damping_beyond_speed",
                   "falling_friction"}  # fmt: skip
FREE_POSITION_LAWS = {"power_of_position", "even_power_of_position", "exponential_spring", "inverse_distance",
                      "contact_beyond_position"}  # fmt: skip
"""Laws of the speed alone, and of the position alone: each group is a family of similar laws (`judged_law`)."""
FREE_LAWS = frozenset({*FREE_SPEED_LAWS, *FREE_POSITION_LAWS, "product_of_position_and_speed"})
"""Names of all laws of this file; a diagnosis reports their formulas as `discovered_law`."""


POWERS, POWER_BOUNDS = (0.3, 0.6, 1.5, 2.0, 3.0, 4.5), ((0.05, 6.0),)
"""Tried exponents, and bounds of their refinement; 6 is the largest that a search by simulation names as well."""
SPEED_SHARES = (0.03, 0.1, 0.3, 1.0)
"""Tried scales of a speed, relative to the rms speed: from dry friction to nearly viscous damping."""
TRAVEL_SHARES = (0.1, 0.3, 1.0)
"""Tried scales of a position and distances beyond the ends of the travel, relative to the travel."""
LARGEST_EXPONENT = 30.0
"""Largest |q / s| of a tried exponential: beyond it, the column is one spike at the end of the travel."""
STOP_SHARES = (0.05, 0.15, 0.3, 0.5)
"""Tried onsets of a contact: distances from either end of the travel, relative to the travel."""
PRODUCTS: dict[str, Callable[[FloatArray, FloatArray, FloatArray], FloatArray]] = {
    "q*v": lambda q, v, _: q * v,
    "abs(q)*v": lambda q, v, _: np.abs(q) * v,
    "q**2*v": lambda q, v, _: q**2 * v,
    "q*v**2": lambda q, v, _: q * v**2,
    "q*abs(v)": lambda q, v, _: q * np.abs(v),
    "abs(q)*abs(v)*v": lambda q, v, _: np.abs(q) * np.abs(v) * v,
    "q*sign(v)": lambda q, _, sign: q * sign,
    "abs(q)*sign(v)": lambda q, _, sign: np.abs(q) * sign,
    "q**2*sign(v)": lambda q, _, sign: q**2 * sign,
}
"""Products of position q and velocity v, or the smoothed sign of v, by their formula."""


def list_excluded_laws(excluded_effects: Iterable[str], discovery: bool) -> frozenset[str]:
    """List the laws that the force balance leaves out: these effects and, without discovery, all of `FREE_LAWS`."""
    return frozenset(excluded_effects) | (frozenset() if discovery else FREE_LAWS)


def make_free_laws(channel: int, scales: Scales) -> Iterator[Law]:
    """Make all free laws of one channel of the motion. Without a time axis, only those of the position; without speed,
    none of the speed alone; for a shaft that turns freely or without travel, only those of the speed."""
    if np.isfinite(scales.band_hz) and scales.speed > 0:
        yield from _make_speed_laws(channel, scales.speed)
    if scales.turns_freely or not scales.travel > 0:
        return
    yield from _make_position_laws(channel, scales)
    yield from _make_contact_laws(channel, scales)
    if np.isfinite(scales.band_hz):
        for text, compute in PRODUCTS.items():
            yield Law(
                "product_of_position_and_speed", channel, (), _make_product_columns(channel, compute, scales.speed),
                _read_weight, formula=_make_formula(f"-p0*{text}"),
            )  # fmt: skip


def _make_speed_laws(c: int, speed: float) -> Iterator[Law]:
    """Make the laws of the speed alone. speed: rms, m/s (rad/s)."""
    for power in POWERS:
        yield Law(
            "power_of_speed", c, (power,), lambda m, n: _raise_with_sign(m.velocity[:, [c]], n[0]), _read_weight,
            bounds=POWER_BOUNDS, formula=_make_formula("-p0*abs(v)**p1*sign(v)"),
        )  # fmt: skip
        yield Law(
            "even_power_of_speed", c, (power,), lambda m, n: np.abs(m.velocity[:, [c]]) ** n[0], _read_weight,
            bounds=POWER_BOUNDS, formula=_make_formula("-p0*abs(v)**p1"),
        )  # fmt: skip
    for share in SPEED_SHARES:
        yield Law(
            "saturating_damping", c, (share * speed,), lambda m, n: smooth_sign(m.velocity[:, [c]], n[0]), _read_weight,
            bounds=((1e-3 * speed, 3 * speed),), formula=_make_formula("-p0*tanh(v/p1)"),
        )  # fmt: skip
        yield Law(
            "damping_beyond_speed", c, (share * speed,), lambda m, n: _cut_dead_zone(m.velocity[:, [c]], n[0]),
            _read_weight, bounds=((1e-2 * speed, 3 * speed),),
            formula=_make_formula("-p0*sign(v)*maximum(abs(v) - p1, 0)"),
        )  # fmt: skip
        yield Law(
            "falling_friction", c, (share * speed,),
            lambda m, n: np.sign(m.velocity[:, [c]]) * np.exp(-((m.velocity[:, [c]] / n[0]) ** 2)), _read_weight,
            bounds=((1e-3 * speed, 3 * speed),), formula=_make_formula("-p0*sign(v)*exp(-(v/p1)**2)"),
        )  # fmt: skip


def _make_position_laws(c: int, scales: Scales) -> Iterator[Law]:
    """Make the laws of the position alone."""
    for power in POWERS:
        yield Law(
            "power_of_position", c, (power,), lambda m, n: _raise_with_sign(m.position[:, [c]], n[0]), _read_weight,
            bounds=POWER_BOUNDS, formula=_make_formula("-p0*abs(q)**p1*sign(q)"),
        )  # fmt: skip
        yield Law(
            "even_power_of_position", c, (power,), lambda m, n: np.abs(m.position[:, [c]]) ** n[0], _read_weight,
            bounds=POWER_BOUNDS, formula=_make_formula("-p0*abs(q)**p1"),
        )  # fmt: skip
    largest_position = max(abs(scales.low), abs(scales.high))
    for scale in (sign * share * scales.travel for share in TRAVEL_SHARES for sign in (1.0, -1.0)):
        if largest_position < LARGEST_EXPONENT * abs(scale):
            yield Law(
                "exponential_spring", c, (scale,), lambda m, n: np.exp(m.position[:, [c]] / n[0]), _read_weight,
                bounds=((min(0.3 * scale, 3 * scale), max(0.3 * scale, 3 * scale)),),
                formula=_make_formula("-p0*exp(q/p1)"),
            )  # fmt: skip
    for share in TRAVEL_SHARES:
        for end, side in ((scales.high, 1.0), (scales.low, -1.0)):
            for power in (1, 2):
                yield Law(
                    "inverse_distance", c, (share * scales.travel,), _make_inverse_columns(c, end, side, power),
                    _make_position_reader(end, side), bounds=((0.02 * scales.travel, 3 * scales.travel),),
                    formula=_make_formula(f"-p0/(q - p1)**{power}"),
                )  # fmt: skip


def _make_contact_laws(c: int, scales: Scales) -> Iterator[Law]:
    """Make the springs that act beyond a position, in either direction. Their nonlinear parameter is the depth of the
    contact at the end of the travel."""
    for depth in (share * scales.travel for share in STOP_SHARES):
        for end, side, text in (
            (scales.high, 1.0, "-p0*maximum(q - p1, 0)"), (scales.low, -1.0, "p0*maximum(p1 - q, 0)")
        ):  # fmt: skip
            yield Law(
                "contact_beyond_position", c, (depth,), make_contact_columns(c, end, side),
                _make_position_reader(end, -side), bounds=((0.01 * scales.travel, 0.8 * scales.travel),),
                formula=_make_formula(text),
            )  # fmt: skip


def _make_position_reader(end: float, side: float) -> WeightConverter:
    """Make the function that converts the weight and a distance from the end of the travel to p0 and the position p1.
    Distances are refined by factors, which would change a position near zero too little and one far off too much."""
    return lambda w, n, mass: {"p0": float(w[0]), "p1": end + side * n[0]}


def _raise_with_sign(signal: FloatArray, power: float) -> FloatArray:
    """sgn(u) |u|^power, elementwise."""
    return np.asarray(np.sign(signal) * np.abs(signal) ** power)


def _cut_dead_zone(signal: FloatArray, width: float) -> FloatArray:
    """sgn(u) max(|u| - width, 0), elementwise."""
    return np.asarray(np.sign(signal) * np.maximum(np.abs(signal) - width, 0.0))


def _make_product_columns(
    c: int, compute: Callable[[FloatArray, FloatArray, FloatArray], FloatArray], speed: float
) -> Columns:
    """Make the function for the column (n, 1) of a product of position and velocity. speed: rms, for the width of the
    smoothed sign."""
    width = LEAST_WIDTH_SHARE * speed
    return lambda m, _: compute(m.position[:, [c]], m.velocity[:, [c]], smooth_sign(m.velocity[:, [c]], width))


def _make_inverse_columns(c: int, end: float, side: float, power: int) -> Columns:
    """Make the function for the column (n, 1) of an attraction to a position at the distance n[0] beyond an end of the
    travel."""

    def compute_columns(m: Motion, n: NonlinearParameters) -> FloatArray:
        return np.asarray(1.0 / (m.position[:, [c]] - (end + side * n[0])) ** power)

    return compute_columns


def _read_weight(w: FloatArray, n: NonlinearParameters, mass: float) -> dict[str, float] | None:
    """Convert the weight and the nonlinear parameters to p0, p1, … of the formula; either sign is possible."""
    return {f"p{index}": float(value) for index, value in enumerate((w[0], *n))}


def _make_formula(text: str) -> Callable[[dict[str, float]], Formula]:
    """Make the formula of a force with the parameters p0, p1, …"""
    return lambda parameters: Formula(text, tuple(parameters.values()), "force")
