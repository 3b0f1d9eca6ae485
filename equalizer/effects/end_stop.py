"""End stop: a stiff one-sided spring at an end of the travel, on one side or on both.

    F = -k (x - x_s) where x lies beyond the stop x_s, else 0        k in N/m (a rotation: N m/rad)

A second stop at -x_s has the stiffness `opposite` times k (0 = none). Beyond means away from zero, unless `side` states
the direction (1: upwards, -1: downwards); there is no second stop then. An entry of `catalogue`.
"""

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, Parameter, Values
from equalizer.effects.simulation.instant import F_END, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import (
    AxisMotion,
    PartialRegression,
    regress_out_linear_terms,
    select_axis_motion,
)
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

COARSE_POSITION_SHARES, FINE_POSITION_OFFSETS = np.linspace(0.3, 0.98, 18), np.linspace(-0.04, 0.04, 9)
"""Stop positions that are tried, relative to the largest deflection: a coarse grid, then offsets around its best
point. Chosen."""


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the weighted mean of the force (N) at the step's start and end. A stop only pushes, and its penetration
    at the end depends on its force (implicit step). parameters: as `_pack_parameters` returns them. step_motion: see
    `instant`; the force at the end is written to it."""
    force = force_at_end = 0.0
    for stop_index in range(2):
        side_sign = parameters[2 + stop_index]
        stiffness = parameters[1] if stop_index == 0 else parameters[1] * parameters[4]
        start_penetration = max(side_sign * step_motion[X] - parameters[0], 0.0)
        end_penetration = side_sign * (step_motion[X_FREE] + step_motion[X_PER_N] * force) - parameters[0]
        # Weight of the end: 1/2 (trapezoidal rule) for a soft stop, towards 1 (backward Euler) for a stop that is too
        # stiff for the step, where the trapezoidal rule would oscillate.
        stiffness_ratio = stiffness * step_motion[X_PER_N]
        end_weight = (0.5 + stiffness_ratio) / (1 + stiffness_ratio)
        contact_force = (
            stiffness
            * ((1 - end_weight) * start_penetration + end_weight * end_penetration)
            / (1 + end_weight * stiffness_ratio)
        )
        if end_penetration - step_motion[X_PER_N] * contact_force < 0:
            contact_force = stiffness * (1 - end_weight) * start_penetration
        force -= side_sign * max(contact_force, 0.0)
        force_at_end -= side_sign * stiffness * max(end_penetration - step_motion[X_PER_N] * contact_force, 0.0)
    step_motion[F_END] = force_at_end
    return float(force)


def _pack_parameters(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """Pack the parameters of `_compute_mean_force`, (5,): distance (m) and stiffness (N/m) of the stop, signs of both
    sides, relative stiffness of the second. The sign of the position states the side where `side` is 0 or missing."""
    side = values.get("side", 0.0)
    stop_sign = float(np.sign(side)) or (-1.0 if values["position"] < 0 else 1.0)
    # With `side`, a stop may lie on the other side of zero, where a stop at -position would overlap with it.
    relative_stiffness = 0.0 if side else values.get("opposite", 0.0)
    return np.array([stop_sign * values["position"], values["stiffness"], stop_sign, -stop_sign, relative_stiffness])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find the best stop on either side by grid search and linear regression, the better first; a side without a stop
    is left out."""
    motion = select_axis_motion(evidence, axis)
    regression, largest_deflection = regress_out_linear_terms(motion), float(np.abs(motion.position).max())
    candidates = []
    for stop_sign in (1.0, -1.0):
        coarse_fit = _find_best_stop(motion, regression, stop_sign, COARSE_POSITION_SHARES * largest_deflection)
        if coarse_fit is not None:
            refined_fit = _find_best_stop(
                motion,
                regression,
                stop_sign,
                abs(coarse_fit[1]["position"]) + FINE_POSITION_OFFSETS * largest_deflection,
            )
            candidates.append(coarse_fit if refined_fit is None else refined_fit)
    return tuple(values for _, values in sorted(candidates, key=lambda item: -item[0]))


def _find_best_stop(
    motion: AxisMotion, regression: PartialRegression, stop_sign: float, stop_distances: FloatArray
) -> tuple[float, Values] | None:
    """Find the best stop on the side `stop_sign` (1 or -1), with a second stop at the same distance on the other side
    where the motion goes beyond it. A trial whose second stop is more than 10 % stiffer (chosen) is left out, because
    the stiffer stop is found from the other side; up to 10 % stiffer counts as equal. Returns the share of the missing
    force that both explain, and the values; None where every trial is left out, as where the motion reaches none or no
    stiffness is positive. stop_distances: distances (m) to try."""
    candidates: list[tuple[float, Values]] = []
    for stop_distance in stop_distances.tolist():
        penetration, opposite_penetration = (
            np.maximum(side_sign * motion.position - stop_distance, 0.0) for side_sign in (stop_sign, -stop_sign)
        )
        if not (penetration > 0).any():
            continue
        regressors = (
            (-stop_sign * penetration, stop_sign * opposite_penetration)
            if (opposite_penetration > 0).any()
            else (-stop_sign * penetration,)
        )
        fit = regression.fit(*regressors)
        stiffness, opposite_stiffness = (
            float(fit.strengths[0]),
            float(fit.strengths[-1]) if len(regressors) > 1 else 0.0,
        )
        if stiffness > 0 and opposite_stiffness <= 1.1 * stiffness:
            relative_stiffness = min(max(opposite_stiffness / stiffness, 0.0), 1.0)
            candidates.append(
                (
                    fit.explained_share,
                    {"position": stop_sign * stop_distance, "stiffness": stiffness, "opposite": relative_stiffness},
                )
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
    # `side` is no fitted parameter and not listed: `analysis.diagnosis` sets it where the position's sign does not
    # state the side. Bounds are chosen: of position and stiffness far beyond any device; of `opposite` (0: no second
    # stop, 1: equally stiff) above 1, so that equal stiffness lies inside the range of a fit.
    parameters=(
        Parameter("position", -1e3, 1e3, none=None, scale="signed"),
        Parameter("stiffness", 1e-6, 1e12, none=0.0),
        Parameter("opposite", 0.0, 1.5, none=None, scale="linear", step=0.05),
    ),
    action=AxisForce(_compute_mean_force, _pack_parameters),
    starts=_find_starting_values,
)
