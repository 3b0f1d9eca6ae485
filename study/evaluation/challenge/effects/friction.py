"""Concealed effects of dry friction between handle and ground, on one axis.

    Coulomb                     |F| = level                                            level in N
    asymmetric                  a level for each direction of motion                   levels in N
    Stribeck                    |F| = coulomb + (static - coulomb) exp(-(v / speed)^2)  N, m/s
    presliding                  Coulomb friction behind a spring                       level in N, stiffness in N/m
    position-dependent          |F| = level (1 + slope x + bend x^2)                   N, 1/m, 1/m^2

All are a bristle with elastic presliding (Dahl; `friction_kernel`). Where the law has no presliding, the bristle has
3e6 N/m and slides within 0.1 um. The ranges of the levels go from 0.003 or 0.01 N (strength 0) to 0.2 or 0.25 N (1).
"""

from dataclasses import replace

from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext, Values, with_cells
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.friction_kernel import (
    BRISTLE_STIFFNESS,
    LEVEL_CURVATURE,
    LEVEL_NEGATIVE,
    LEVEL_POSITIVE,
    LEVEL_SLOPE,
    STATIC_RATIO,
    STRIBECK_SPEED,
)

STIFF_N_PER_M = 3e6
"""Stiffness of the bristle where the effect has none of its own: far stiffer than any part of a bench."""


def _with_bristle(device: Device, axis: int, cells: dict[int, float]) -> Device:
    """The device with these columns of friction on an axis; `STIFF_N_PER_M` where `cells` has no stiffness."""
    return replace(device, friction=with_cells(device.friction, axis, {BRISTLE_STIFFNESS: STIFF_N_PER_M} | cells))


def _draw_coulomb(context: EffectContext) -> dict[str, float]:
    return {"level": context.interpolate_log(0.003, 0.25)}


def _build_coulomb(device: Device, axis: int, values: Values) -> Device:
    return _with_bristle(device, axis, {LEVEL_POSITIVE: values["level"], LEVEL_NEGATIVE: values["level"]})


def _draw_asymmetric(context: EffectContext) -> dict[str, float]:
    mean, asymmetry = context.interpolate_log(0.01, 0.25), context.draw_sign() * context.random.uniform(0.2, 0.6)
    return {"level_positive": mean * (1 + asymmetry), "level_negative": mean * (1 - asymmetry)}


def _build_asymmetric(device: Device, axis: int, values: Values) -> Device:
    return _with_bristle(
        device, axis, {LEVEL_POSITIVE: values["level_positive"], LEVEL_NEGATIVE: values["level_negative"]}
    )


def _draw_stribeck(context: EffectContext) -> dict[str, float]:
    coulomb = context.interpolate_log(0.01, 0.2)
    return {
        "coulomb": coulomb,
        "static": coulomb * context.random.uniform(1.3, 2.2),
        "speed": context.draw_log_uniform(0.003, 0.02),
    }


def _build_stribeck(device: Device, axis: int, values: Values) -> Device:
    level = values["coulomb"]
    ratio = values["static"] / level if level > 0.0 else 1.0
    return _with_bristle(
        device,
        axis,
        {LEVEL_POSITIVE: level, LEVEL_NEGATIVE: level, STATIC_RATIO: ratio, STRIBECK_SPEED: values["speed"]},
    )


def _draw_presliding(context: EffectContext) -> dict[str, float]:
    level = context.interpolate_log(0.01, 0.25)
    return {"level": level, "stiffness": level / context.draw_log_uniform(5e-5, 5e-4)}


def _build_presliding(device: Device, axis: int, values: Values) -> Device:
    level = values["level"]
    return _with_bristle(
        device, axis, {LEVEL_POSITIVE: level, LEVEL_NEGATIVE: level, BRISTLE_STIFFNESS: values["stiffness"]}
    )


def _draw_position_dependent(context: EffectContext) -> dict[str, float]:
    slope = context.draw_sign() * context.random.uniform(0.3, 0.7) / context.travel_m[context.axis]
    bend = context.random.uniform(-0.25, 0.6) / context.travel_m[context.axis] ** 2
    return {"level": context.interpolate_log(0.01, 0.25), "slope_per_m": float(slope), "bend_per_m2": float(bend)}


def _build_position_dependent(device: Device, axis: int, values: Values) -> Device:
    level = values["level"]
    cells = {
        LEVEL_POSITIVE: level,
        LEVEL_NEGATIVE: level,
        LEVEL_SLOPE: values["slope_per_m"],
        LEVEL_CURVATURE: values["bend_per_m2"],
    }
    return _with_bristle(device, axis, cells)


EFFECTS = (
    ConcealedEffect("coulomb_friction", "mechanism", True, _draw_coulomb, _build_coulomb),
    ConcealedEffect("asymmetric_friction", "mechanism", True, _draw_asymmetric, _build_asymmetric),
    ConcealedEffect("stribeck_friction", "mechanism", True, _draw_stribeck, _build_stribeck),
    ConcealedEffect("presliding_hysteresis", "mechanism", True, _draw_presliding, _build_presliding),
    ConcealedEffect(
        "position_dependent_friction", "mechanism", True, _draw_position_dependent, _build_position_dependent
    ),
)
"""Each: name, place, whether it acts on one axis (else on all), how its parameters are drawn, how it is built."""
