"""Friction, damping, stiffness and force that depend on a recorded condition, such as a temperature or a setting.

With c the deviation of the condition from its mean, in units of its standard deviation, and q, v the motion of one
axis, the force that resists the motion is

    friction  (w1 + w2 c) tanh(v / width)      damping  w c v      stiffness  w c q      force  w c

The catalogue has no such effects; simulations use the formulas of these laws.
"""

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from analysis.diagnosis.balance.friction_laws import friction_widths
from analysis.diagnosis.balance.law import Columns, Formula, Law, Scales, name_weights, smooth_sign
from analysis.diagnosis.balance.motion import Condition, Motion
from equalizer.signals.signal import FloatArray


def condition_laws(motions: Sequence[Motion], c: int, scales: Scales) -> Iterator[Law]:
    """Laws of one axis for every recorded condition. c: channel of the motion, scales: the sizes of that motion."""
    for k, condition in enumerate(motions[0].conditions):
        yield from _laws_of_condition(condition, k, c, scales)


def _laws_of_condition(condition: Condition, k: int, c: int, scales: Scales) -> Iterator[Law]:
    """Laws of one condition. k: its column in `Motion.condition`; c and scales: as in `condition_laws`."""
    sharp, spans = friction_widths(scales)
    for width in sharp:
        yield Law(
            "condition_dependent_friction", c, (float(width),), _friction_columns(c, k), _friction_values,
            bounded=spans, formula=_friction_formula(condition),
        )  # fmt: skip
    if np.isfinite(scales.band_hz):
        yield Law(
            "condition_dependent_damping", c, (), lambda m, _: m.condition[:, [k]] * m.velocity[:, [c]],
            name_weights("change"), formula=_formula(condition, "v"),
        )  # fmt: skip
    yield Law(
        "condition_dependent_stiffness", c, (), lambda m, _: m.condition[:, [k]] * m.position[:, [c]],
        name_weights("change"), formula=_formula(condition, "q"),
    )  # fmt: skip
    yield Law(
        "condition_dependent_force", c, (), lambda m, _: m.condition[:, [k]], name_weights("change"),
        formula=_formula(condition),
    )  # fmt: skip


def _friction_columns(c: int, k: int) -> Columns:
    def columns(m: Motion, n: tuple[float, ...]) -> FloatArray:
        friction_sign = smooth_sign(m.velocity[:, [c]], n[0])
        return np.hstack([friction_sign, friction_sign * m.condition[:, [k]]])

    return columns


def _friction_values(w: FloatArray, n: tuple[float, ...], mass: float) -> dict[str, float] | None:
    return {"level": float(w[0]), "change": float(w[1])} if w[0] > 0 else None


def _friction_formula(condition: Condition) -> Callable[[dict[str, float]], Formula]:
    # Negative friction would drive the motion.
    text = f"-maximum(p0 + p1*{_deviation(condition)}, 0)*sign(v)"
    return lambda parameters: Formula(text, (parameters["level"], parameters["change"]), "force")


def _formula(condition: Condition, *factors: str) -> Callable[[dict[str, float]], Formula]:
    text = "*".join(("-p0", _deviation(condition), *factors))
    return lambda parameters: Formula(text, (parameters["change"],), "force")


def _deviation(condition: Condition) -> str:
    """Formula of a condition's deviation from its mean, in standard deviations. Its numbers are integers, which belong
    to the form of a formula and are not fitted. The standard deviation is rounded to about four digits, the mean to
    the same decimal place."""
    factor = 10 ** max(0, min(3 - math.floor(math.log10(condition.spread)), 15 - _digits(condition.mean)))
    mean, spread = round(condition.mean * factor), max(round(condition.spread * factor), 1)
    scaled = condition.name if factor == 1 else f"{factor}*{condition.name}"
    return f"(({scaled} {'-' if mean >= 0 else '+'} {abs(mean)})/{spread})"


def _digits(value: float) -> int:
    """Number of digits before the decimal point."""
    return max(math.floor(math.log10(abs(value))) + 1, 1) if value else 1
