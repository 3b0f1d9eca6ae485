"""Concealed effects of dry friction between handle and ground, on one axis.

    Coulomb                     |F| = level                                            level in N
    asymmetric                  a level for each direction of motion                   levels in N
    Stribeck                    |F| = coulomb + (static - coulomb) exp(-(v / speed)^2)  N, m/s
    presliding                  Coulomb friction behind a spring                       level in N, stiffness in N/m
    position-dependent          |F| = level (1 + slope x + bend x^2)                   N, 1/m, 1/m^2

All are a bristle with elastic presliding (Dahl; `friction_kernel`). Where the law has no presliding, the bristle has
3e6 N/m and slides within 0.2 um. The ranges of the levels go from 0.003 or 0.01 N (strength 0) to 0.2 or 0.25 N (1).
All ranges were chosen by hand.
"""

from dataclasses import replace

from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext, Values, replace_cells
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

RIGID_BRISTLE_N_PER_M = 3e6
"""Stiffness of the bristle of an effect without presliding (N/m). Chosen: far stiffer than any part of a bench."""


def _replace_bristle(device: Device, axis: int, cells: dict[int, float]) -> Device:
    """Replace these columns of the friction on an axis; returns a new device. The stiffness of the bristle is
    `RIGID_BRISTLE_N_PER_M` where `cells` has none."""
    return replace(
        device, friction=replace_cells(device.friction, axis, {BRISTLE_STIFFNESS: RIGID_BRISTLE_N_PER_M} | cells)
    )


def _draw_asymmetric_friction(context: EffectContext) -> dict[str, float]:
    """Draw the levels (N) of the two directions, which differ from their mean by 20 to 60 %."""
    mean_level_n, asymmetry = (
        context.interpolate_log(0.01, 0.25),
        context.draw_sign() * context.random.uniform(0.2, 0.6),
    )
    return {"level_positive": mean_level_n * (1 + asymmetry), "level_negative": mean_level_n * (1 - asymmetry)}


def _draw_stribeck_friction(context: EffectContext) -> dict[str, float]:
    """Draw the Coulomb level (N), the static level, 1.3 to 2.2 times that, and the Stribeck speed (m/s)."""
    coulomb_level_n = context.interpolate_log(0.01, 0.2)
    return {
        "coulomb": coulomb_level_n,
        "static": coulomb_level_n * context.random.uniform(1.3, 2.2),
        "speed": context.draw_log_uniform(0.003, 0.02),
    }


def _build_stribeck_friction(device: Device, axis: int, values: Values) -> Device:
    """Build in the Stribeck friction; the ratio of the levels is 1 where the Coulomb level is 0."""
    coulomb_level_n = values["coulomb"]
    static_ratio = values["static"] / coulomb_level_n if coulomb_level_n > 0.0 else 1.0
    return _replace_bristle(
        device,
        axis,
        {
            LEVEL_POSITIVE: coulomb_level_n,
            LEVEL_NEGATIVE: coulomb_level_n,
            STATIC_RATIO: static_ratio,
            STRIBECK_SPEED: values["speed"],
        },
    )


def _draw_presliding(context: EffectContext) -> dict[str, float]:
    """Draw the level (N) and the stiffness (N/m), which reaches the level after 0.05 to 0.5 mm."""
    level_n = context.interpolate_log(0.01, 0.25)
    return {"level": level_n, "stiffness": level_n / context.draw_log_uniform(5e-5, 5e-4)}


def _build_presliding(device: Device, axis: int, values: Values) -> Device:
    """Build in a level with a soft bristle."""
    level_n = values["level"]
    return _replace_bristle(
        device, axis, {LEVEL_POSITIVE: level_n, LEVEL_NEGATIVE: level_n, BRISTLE_STIFFNESS: values["stiffness"]}
    )


def _draw_position_dependent(context: EffectContext) -> dict[str, float]:
    """Draw the level (N) at the centre, and its changes at the end of the travel: linear +-30 to 70 %, square -25 to
    60 %."""
    slope_per_m = context.draw_sign() * context.random.uniform(0.3, 0.7) / context.travel_m[context.axis]
    bend_per_m2 = context.random.uniform(-0.25, 0.6) / context.travel_m[context.axis] ** 2
    return {
        "level": context.interpolate_log(0.01, 0.25),
        "slope_per_m": float(slope_per_m),
        "bend_per_m2": float(bend_per_m2),
    }


def _build_position_dependent(device: Device, axis: int, values: Values) -> Device:
    """Build in the level with its slope and bend."""
    level_n = values["level"]
    cells = {
        LEVEL_POSITIVE: level_n,
        LEVEL_NEGATIVE: level_n,
        LEVEL_SLOPE: values["slope_per_m"],
        LEVEL_CURVATURE: values["bend_per_m2"],
    }
    return _replace_bristle(device, axis, cells)


EFFECTS = (
    ConcealedEffect(
        "coulomb_friction", "mechanism", True,
        lambda context: {"level": context.interpolate_log(0.003, 0.25)},
        lambda device, axis, values: _replace_bristle(
            device, axis, {LEVEL_POSITIVE: values["level"], LEVEL_NEGATIVE: values["level"]}
        ),
    ),
    ConcealedEffect(
        "asymmetric_friction", "mechanism", True, _draw_asymmetric_friction,
        lambda device, axis, values: _replace_bristle(
            device, axis, {LEVEL_POSITIVE: values["level_positive"], LEVEL_NEGATIVE: values["level_negative"]}
        ),
    ),
    ConcealedEffect("stribeck_friction", "mechanism", True, _draw_stribeck_friction, _build_stribeck_friction),
    ConcealedEffect("presliding_hysteresis", "mechanism", True, _draw_presliding, _build_presliding),
    ConcealedEffect(
        "position_dependent_friction", "mechanism", True, _draw_position_dependent, _build_position_dependent
    ),
)  # fmt: skip
