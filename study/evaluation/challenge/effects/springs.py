"""Concealed effects that exert a force F on one axis of the handle as a function of its position x.

    hardening    F = -k3 x^3                                     k3 in N/m^3
    asymmetric   F = -k2 x^2                                     k2 in N/m^2
    constant     F = force                                       N
    cogging      F = amplitude sin(2 pi x / pitch + phase)       N, m, rad (random phase)
    end stop     F = -stiffness (x - position) beyond position   N/m, m; on one side or on both, which is drawn

The strength interpolates the range of the main parameter geometrically. `handle_force_kernel` computes the force.
"""

import numpy as np

from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext, Values, with_forces
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


def _draw_hardening(context: EffectContext) -> dict[str, float]:
    """k3 such that the force at the end of the travel is 0.005 to 0.4 N."""
    return {"k3": context.interpolate_log(0.005, 0.4) / context.travel_m[context.axis] ** 3}


def _build_hardening(device: Device, axis: int, values: Values) -> Device:
    return with_forces(device, axis, {CUBIC_STIFFNESS: values["k3"]})


def _draw_asymmetric(context: EffectContext) -> dict[str, float]:
    # k2 x at the end of the travel over the ground's stiffness; above 0.5 the tangent stiffness would be negative.
    stiffness = context.bench.stiffness[context.axis, context.axis]
    return {
        "k2": float(
            context.draw_sign() * context.interpolate_log(0.005, 0.3) * stiffness / context.travel_m[context.axis]
        )
    }


def _build_asymmetric(device: Device, axis: int, values: Values) -> Device:
    return with_forces(device, axis, {SQUARE_STIFFNESS: values["k2"]})


def _draw_constant(context: EffectContext) -> dict[str, float]:
    return {"force": context.draw_sign() * context.interpolate_log(0.001, 0.3)}


def _build_constant(device: Device, axis: int, values: Values) -> Device:
    return with_forces(device, axis, {CONSTANT_FORCE: values["force"]})


def _draw_cogging(context: EffectContext) -> dict[str, float]:
    return {
        "amplitude": context.interpolate_log(0.004, 0.15),
        "pitch": context.draw_log_uniform(4e-4, 4e-3),
        "phase": context.random.uniform(0, 2 * np.pi),
    }


def _build_cogging(device: Device, axis: int, values: Values) -> Device:
    cells = {COGGING_AMPLITUDE: values["amplitude"], COGGING_PITCH: values["pitch"], COGGING_PHASE: values["phase"]}
    return with_forces(device, axis, cells)


def _draw_stop(context: EffectContext) -> dict[str, float]:
    """Position at 99.8 % (weakest) to 40 % of the travel without the stop; opposite: 1 for a stop on both sides."""
    travel_share = 1.0 - 0.6 * context.interpolate_log(0.003, 1.0)
    return {
        "position": context.draw_sign() * travel_share * context.travel_m[context.axis],
        "stiffness": context.draw_log_uniform(300.0, 2e4),
        "opposite": float(context.random.integers(2)),
    }


def _build_stop(device: Device, axis: int, values: Values) -> Device:
    position = values["position"]
    near_side, far_side = (UPPER_STOP, LOWER_STOP) if position > 0.0 else (LOWER_STOP, UPPER_STOP)
    cells = {near_side: position, STOP_STIFFNESS: values["stiffness"]}
    return with_forces(device, axis, cells | ({far_side: -position} if values["opposite"] else {}))


EFFECTS = (
    ConcealedEffect("hardening_stiffness", "mechanism", True, _draw_hardening, _build_hardening),
    ConcealedEffect("asymmetric_stiffness", "mechanism", True, _draw_asymmetric, _build_asymmetric),
    ConcealedEffect("constant_force", "mechanism", True, _draw_constant, _build_constant),
    ConcealedEffect("cogging", "mechanism", True, _draw_cogging, _build_cogging),
    ConcealedEffect("end_stop", "mechanism", True, _draw_stop, _build_stop),
)
"""Each: name, place, whether it acts on one axis (else on all), how its parameters are drawn, how it is built."""
