"""End stop: a stiff one-sided spring at an end of the travel, on one side or on both.

    F = -k (x - x_s) where x lies beyond the stop x_s, else 0        k in N/m (a rotation: N m/rad)

A second stop at -x_s has the stiffness `opposite` times k (0 = none). Beyond means away from zero, unless `side` states
the direction (1: upwards, -1: downwards); there is no second stop then.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import (
    AxisMotion,
    PartialRegression,
    axis_motion,
    regress_out_linear_terms,
)
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

COARSE_SHARES, FINE_OFFSETS = np.linspace(0.3, 0.98, 18), np.linspace(-0.04, 0.04, 9)
"""Stop positions that are tried, relative to the largest deflection: a coarse grid, then offsets around its best
point."""


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Weighted mean of the force at the step's start and end. A stop only pushes, and its penetration at the end
    depends on its force (implicit step). parameters: stop and stiffness, signs of both sides, relative stiffness of the
    second."""
    force = last = 0.0
    for side in range(2):
        side_sign = parameters[2 + side]
        stiffness = parameters[1] if side == 0 else parameters[1] * parameters[4]
        start = max(side_sign * at[X] - parameters[0], 0.0)
        end = side_sign * (at[X_FREE] + at[X_PER_N] * force) - parameters[0]
        # Weight of the end: 1/2 (trapezoidal rule) for a soft stop, towards 1 (backward Euler) for a stop that is too
        # stiff for the step, where the trapezoidal rule would oscillate.
        slack = stiffness * at[X_PER_N]
        end_weight = (0.5 + slack) / (1 + slack)
        contact_force = stiffness * ((1 - end_weight) * start + end_weight * end) / (1 + end_weight * slack)
        if end - at[X_PER_N] * contact_force < 0:
            contact_force = stiffness * (1 - end_weight) * start
        force -= side_sign * max(contact_force, 0.0)
        last -= side_sign * stiffness * max(end - at[X_PER_N] * contact_force, 0.0)
    at[F_END] = last
    return float(force)


def _pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """Parameters of `_law`; the sign of the position states the side where `side` is 0 or missing."""
    side = values.get("side", 0.0)
    direction = float(np.sign(side)) or (-1.0 if values["position"] < 0 else 1.0)
    # With `side`, a stop may lie on the other side of zero, where a stop at -position would overlap with it.
    opposite = 0.0 if side else values.get("opposite", 0.0)
    return np.array([direction * values["position"], values["stiffness"], direction, -direction, opposite])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """The best stop on either side by grid search and linear regression, the better first."""
    motion = axis_motion(evidence, axis)
    regression, farthest = regress_out_linear_terms(motion), float(np.abs(motion.position).max())
    candidates = []
    for direction in (1.0, -1.0):
        coarse = _best_stop(motion, regression, direction, COARSE_SHARES * farthest)
        if coarse is not None:
            fine = _best_stop(motion, regression, direction, abs(coarse[1]["position"]) + FINE_OFFSETS * farthest)
            candidates.append(coarse if fine is None else fine)
    return tuple(values for _, values in sorted(candidates, key=lambda item: -item[0]))


def _best_stop(
    motion: AxisMotion, regression: PartialRegression, direction: float, stops: FloatArray
) -> tuple[float, Values] | None:
    """Explained share of the missing force, and values, of the best stop on the side `direction` (1 or -1) with a
    second stop that is at most 10 % stiffer; None where no stop has a positive stiffness. stops: distances (m) to
    try."""
    candidates: list[tuple[float, Values]] = []
    for stop in stops.tolist():
        penetration, opposite_penetration = (
            np.maximum(side * motion.position - stop, 0.0) for side in (direction, -direction)
        )
        if not (penetration > 0).any():
            continue
        laws = (
            (-direction * penetration, direction * opposite_penetration)
            if (opposite_penetration > 0).any()
            else (-direction * penetration,)
        )
        fit = regression.fit(*laws)
        stiffness, opposite_stiffness = float(fit.strengths[0]), float(fit.strengths[-1]) if len(laws) > 1 else 0.0
        if stiffness > 0 and opposite_stiffness <= 1.1 * stiffness:
            share = min(max(opposite_stiffness / stiffness, 0.0), 1.0)
            candidates.append(
                (fit.explained_share, {"position": direction * stop, "stiffness": stiffness, "opposite": share})
            )
    return max(candidates, key=lambda item: item[0], default=None)


EFFECT = Effect(
    name="end_stop",
    equation="F = -stiffness (x - position) beyond position; beyond is above for a positive side and below "
    "for a negative one; without a side, or for 0, beyond is away from zero, and at -position stands a stop of "
    "opposite times that stiffness",
    source="Brogliato, Nonsmooth Mechanics, chapter 2",
    signature="nothing is missing until the axis comes near its farthest positions; then a force pushes back, and odd "
    "and even harmonics appear",
    parameters=(
        Parameter("position", -1e3, 1e3, none=None, scale="signed"),
        Parameter("stiffness", 1e-6, 1e12, none=0.0),
        Parameter("opposite", 0.0, 1.5, none=None, scale="linear", step=0.05),
    ),
    action=AxisForce(_law, _pack),
    starts=_starts,
)
