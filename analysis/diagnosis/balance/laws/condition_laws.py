"""Laws of friction, damping, stiffness and force that depend on a recorded condition, such as a temperature.

With c the deviation of the condition from its mean, in units of its standard deviation, and q, v position and velocity
of one axis, the force that resists the motion is

    friction  (w1 + w2 c) tanh(v / width)      damping  w c v      stiffness  w c q      force  w c

with the weights w, w1, w2 fitted by `regression`. The catalogue has no such effects; simulations use the formulas of
these laws, with sgn(v) for tanh and friction of at least 0. In callables, m is the motion, n the nonlinear parameters
and w the weights, as in `law`.
"""

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from analysis.diagnosis.balance.laws.friction_laws import compute_friction_widths
from analysis.diagnosis.balance.laws.law import Columns, Formula, Law, Scales, name_weights, smooth_sign
from analysis.diagnosis.balance.motion import Condition, Motion
from equalizer.signals.signal import FloatArray


def make_condition_laws(motions: Sequence[Motion], channel: int, scales: Scales) -> Iterator[Law]:
    """Make the laws of one axis for every recorded condition. channel: index in the motion; scales: of its position and
    velocity, from which the friction widths follow."""
    for condition_index, condition in enumerate(motions[0].conditions):
        yield from _make_laws_of_condition(condition, condition_index, channel, scales)


def _make_laws_of_condition(condition: Condition, index: int, channel: int, scales: Scales) -> Iterator[Law]:
    """Make the laws of one condition; no damping without a time axis. index: its column in `Motion.condition`."""
    widths, width_bounds = compute_friction_widths(scales)
    for width in widths:
        yield Law(
            "condition_dependent_friction", channel, (float(width),), _make_friction_columns(channel, index),
            _read_friction_values, bounds=width_bounds, formula=_make_friction_formula(condition),
        )  # fmt: skip
    if np.isfinite(scales.band_hz):
        yield Law(
            "condition_dependent_damping", channel, (), lambda m, _: m.condition[:, [index]] * m.velocity[:, [channel]],
            name_weights("change"), formula=_make_formula(condition, "v"),
        )  # fmt: skip
    yield Law(
        "condition_dependent_stiffness", channel, (), lambda m, _: m.condition[:, [index]] * m.position[:, [channel]],
        name_weights("change"), formula=_make_formula(condition, "q"),
    )  # fmt: skip
    yield Law(
        "condition_dependent_force", channel, (), lambda m, _: m.condition[:, [index]], name_weights("change"),
        formula=_make_formula(condition),
    )  # fmt: skip


def _make_friction_columns(channel: int, index: int) -> Columns:
    """Make the function for the columns (n, 2): the smoothed sign of the velocity, and the same times the condition."""

    def compute_columns(m: Motion, n: tuple[float, ...]) -> FloatArray:
        friction_sign = smooth_sign(m.velocity[:, [channel]], n[0])
        return np.hstack([friction_sign, friction_sign * m.condition[:, [index]]])

    return compute_columns


def _read_friction_values(w: FloatArray, n: tuple[float, ...], mass: float) -> dict[str, float] | None:
    """Convert the weights to the friction at the mean condition (level) and its change per standard deviation (N or N
    m); None where the level is not positive."""
    return {"level": float(w[0]), "change": float(w[1])} if w[0] > 0 else None


def _make_friction_formula(condition: Condition) -> Callable[[dict[str, float]], Formula]:
    """Make the formula of the friction, whose magnitude is limited to at least 0: negative friction would drive the
    motion."""
    text = f"-maximum(p0 + p1*{_format_deviation(condition)}, 0)*sign(v)"
    return lambda parameters: Formula(text, (parameters["level"], parameters["change"]), "force")


def _make_formula(condition: Condition, *factors: str) -> Callable[[dict[str, float]], Formula]:
    """Make the formula of a force -p0 c times the factors (symbols of the motion)."""
    text = "*".join(("-p0", _format_deviation(condition), *factors))
    return lambda parameters: Formula(text, (parameters["change"],), "force")


def _format_deviation(condition: Condition) -> str:
    """Format a condition's deviation from its mean, in standard deviations, as a formula. Its numbers are integers,
    because integers in a formula are constants that are not fitted. The standard deviation, above 0, is rounded to an
    integer from 1000 on, else to about four digits (fewer where the mean would exceed 15), the mean likewise."""
    factor = 10 ** max(
        0, min(3 - math.floor(math.log10(condition.standard_deviation)), 15 - _count_integer_digits(condition.mean))
    )
    mean, deviation = round(condition.mean * factor), max(round(condition.standard_deviation * factor), 1)
    scaled = condition.name if factor == 1 else f"{factor}*{condition.name}"
    return f"(({scaled} {'-' if mean >= 0 else '+'} {abs(mean)})/{deviation})"


def _count_integer_digits(value: float) -> int:
    """Count the digits before the decimal point, at least 1."""
    return max(math.floor(math.log10(abs(value))) + 1, 1) if value else 1
