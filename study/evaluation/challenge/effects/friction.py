"""Dry friction between the handle and the ground, on one axis.

Every law is a bristle. Where the law itself has no presliding, the bristle is so stiff (3e6 N/m) that it yields within
nanometres. Levels are of the moving handle; along the way they change as level (1 + slope x + bend x^2). Stribeck's
excess falls as exp(-(v / speed)^2).
"""

from dataclasses import replace

from study.evaluation.challenge.device import Device
from study.evaluation.challenge.friction_kernel import BEND, NEGATIVE, POSITIVE, SLOPE, SPEED, STATIC_RATIO, STIFFNESS
from study.evaluation.challenge.hidden import Circumstances, HiddenEffect, Values, with_cells

STIFF_N_PER_M = 3e6


def _rubbing(device: Device, axis: int, cells: dict[int, float]) -> Device:
    return replace(device, friction=with_cells(device.friction, axis, {STIFFNESS: STIFF_N_PER_M} | cells))


def _draw_coulomb(at: Circumstances) -> dict[str, float]:
    return {"level": at.between(0.003, 0.25)}


def _coulomb(device: Device, axis: int, values: Values) -> Device:
    return _rubbing(device, axis, {POSITIVE: values["level"], NEGATIVE: values["level"]})


def _draw_asymmetric(at: Circumstances) -> dict[str, float]:
    mean, unlike = at.between(0.01, 0.25), at.sign() * at.random.uniform(0.2, 0.6)
    return {"level_positive": mean * (1 + unlike), "level_negative": mean * (1 - unlike)}


def _asymmetric(device: Device, axis: int, values: Values) -> Device:
    return _rubbing(device, axis, {POSITIVE: values["level_positive"], NEGATIVE: values["level_negative"]})


def _draw_stribeck(at: Circumstances) -> dict[str, float]:
    coulomb = at.between(0.01, 0.2)
    return {"coulomb": coulomb, "static": coulomb * at.random.uniform(1.3, 2.2), "speed": at.some(0.003, 0.02)}


def _stribeck(device: Device, axis: int, values: Values) -> Device:
    level = values["coulomb"]
    ratio = values["static"] / level if level > 0.0 else 1.0
    return _rubbing(device, axis, {POSITIVE: level, NEGATIVE: level, STATIC_RATIO: ratio, SPEED: values["speed"]})


def _draw_presliding(at: Circumstances) -> dict[str, float]:
    level = at.between(0.01, 0.25)
    return {"level": level, "stiffness": level / at.some(5e-5, 5e-4)}


def _presliding(device: Device, axis: int, values: Values) -> Device:
    level = values["level"]
    return _rubbing(device, axis, {POSITIVE: level, NEGATIVE: level, STIFFNESS: values["stiffness"]})


def _draw_along(at: Circumstances) -> dict[str, float]:
    slope = at.sign() * at.random.uniform(0.3, 0.7) / at.travel_m[at.axis]
    bend = at.random.uniform(-0.25, 0.6) / at.travel_m[at.axis] ** 2
    return {"level": at.between(0.01, 0.25), "slope_per_m": float(slope), "bend_per_m2": float(bend)}


def _along(device: Device, axis: int, values: Values) -> Device:
    level = values["level"]
    cells = {POSITIVE: level, NEGATIVE: level, SLOPE: values["slope_per_m"], BEND: values["bend_per_m2"]}
    return _rubbing(device, axis, cells)


EFFECTS = (
    HiddenEffect("coulomb_friction", "mechanism", True, _draw_coulomb, _coulomb),
    HiddenEffect("asymmetric_friction", "mechanism", True, _draw_asymmetric, _asymmetric),
    HiddenEffect("stribeck_friction", "mechanism", True, _draw_stribeck, _stribeck),
    HiddenEffect("presliding_hysteresis", "mechanism", True, _draw_presliding, _presliding),
    HiddenEffect("position_dependent_friction", "mechanism", True, _draw_along, _along),
)
