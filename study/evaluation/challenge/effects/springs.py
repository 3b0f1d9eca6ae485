"""Concealed effects that exert a force F on one axis of the handle as a function of its position x.

    hardening    F = -k3 x^3                                     k3 in N/m^3
    asymmetric   F = -k2 x^2                                     k2 in N/m^2
    constant     F = force                                       N
    cogging      F = amplitude sin(2 pi x / pitch + phase)       N, m, rad (random phase)
    end stop     F = -stiffness (x - position) beyond position   N/m, m; on one side or on both, which is drawn

The strength interpolates the range of the main parameter geometrically. `handle_force_kernel` computes the force. All
ranges were chosen by hand.
"""

import numpy as np

from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext, Values, replace_handle_forces
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.handle_force_kernel import (
    COGGING_AMPLITUDE,
    COGGING_PHASE,
    COGGING_PITCH,
    CONSTANT_FORCE,
    CUBIC_STIFFNESS,
    LOWER_STOP,
    SQUARE_STIFFNESS,
    STOP_STIFFNESS,
    UPPER_STOP,
)


def _draw_asymmetric_stiffness(context: EffectContext) -> dict[str, float]:
    """Draw k2, of either sign, such that |k2 x| at the end of the travel is 0.5 to 30 % of the ground's stiffness."""
    # Above 50 % the tangent stiffness would be negative there.
    ground_stiffness_n_per_m = context.bench.stiffness[context.axis, context.axis]
    return {
        "k2": float(
            context.draw_sign()
            * context.interpolate_log(0.005, 0.3)
            * ground_stiffness_n_per_m
            / context.travel_m[context.axis]
        )
    }


def _build_cogging(device: Device, axis: int, values: Values) -> Device:
    """Set the cogging force on one axis."""
    cells = {COGGING_AMPLITUDE: values["amplitude"], COGGING_PITCH: values["pitch"], COGGING_PHASE: values["phase"]}
    return replace_handle_forces(device, axis, cells)


def _draw_end_stop(context: EffectContext) -> dict[str, float]:
    """Draw the position, at 99.8 % (weakest) to 40 % of the travel without the stop, of either sign; the stiffness
    (N/m); opposite: 1 for a stop on both sides, else 0."""
    travel_share = 1.0 - 0.6 * context.interpolate_log(0.003, 1.0)
    return {
        "position": context.draw_sign() * travel_share * context.travel_m[context.axis],
        "stiffness": context.draw_log_uniform(300.0, 2e4),
        "opposite": float(context.random.integers(2)),
    }


def _build_end_stop(device: Device, axis: int, values: Values) -> Device:
    """Set one end stop, or two at equal distances from the centre."""
    position_m = values["position"]
    near_side, far_side = (UPPER_STOP, LOWER_STOP) if position_m > 0.0 else (LOWER_STOP, UPPER_STOP)
    cells = {near_side: position_m, STOP_STIFFNESS: values["stiffness"]}
    return replace_handle_forces(device, axis, cells | ({far_side: -position_m} if values["opposite"] else {}))


EFFECTS = (
    ConcealedEffect(
        "hardening_stiffness", "mechanism", True,
        lambda context: {"k3": context.interpolate_log(0.005, 0.4) / context.travel_m[context.axis] ** 3},
        lambda device, axis, values: replace_handle_forces(device, axis, {CUBIC_STIFFNESS: values["k3"]}),
    ),
    ConcealedEffect(
        "asymmetric_stiffness", "mechanism", True, _draw_asymmetric_stiffness,
        lambda device, axis, values: replace_handle_forces(device, axis, {SQUARE_STIFFNESS: values["k2"]}),
    ),
    ConcealedEffect(
        "constant_force", "mechanism", True,
        lambda context: {"force": context.draw_sign() * context.interpolate_log(0.001, 0.3)},
        lambda device, axis, values: replace_handle_forces(device, axis, {CONSTANT_FORCE: values["force"]}),
    ),
    ConcealedEffect(
        "cogging", "mechanism", True,
        lambda context: {
            "amplitude": context.interpolate_log(0.004, 0.15),
            "pitch": context.draw_log_uniform(4e-4, 4e-3),
            "phase": context.random.uniform(0, 2 * np.pi),
        },
        _build_cogging,
    ),
    ConcealedEffect("end_stop", "mechanism", True, _draw_end_stop, _build_end_stop),
)  # fmt: skip
"""Fields of each entry: name, place, whether it acts on one axis, draw of its parameters, and its construction."""
