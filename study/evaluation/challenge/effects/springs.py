"""Forces that depend on the handle's place on one axis.

Hardening -k3 x^3; asymmetric -k2 x^2; constant +force; cogging amplitude sin(2 pi x / pitch + phase), any phase; an end
stop is a spring that begins at `position`, on that side alone or as far on the other: which is drawn.
"""

import numpy as np

from study.evaluation.challenge.device import Device
from study.evaluation.challenge.handle_force_kernel import (
    ABOVE,
    BELOW,
    CONSTANT,
    CUBE,
    PHASE,
    PITCH,
    RIPPLE,
    SQUARE,
    STOP,
)
from study.evaluation.challenge.hidden import Circumstances, HiddenEffect, Values, with_forces


def _draw_hardening(at: Circumstances) -> dict[str, float]:
    return {"k3": at.between(0.005, 0.4) / at.travel_m[at.axis] ** 3}


def _hardening(device: Device, axis: int, values: Values) -> Device:
    return with_forces(device, axis, {CUBE: values["k3"]})


def _draw_asymmetric(at: Circumstances) -> dict[str, float]:
    # A part of the ground's stiffness at the travel's end: with more, the handle would leave on the soft side.
    stiffness = at.bench.stiffness[at.axis, at.axis]
    return {"k2": float(at.sign() * at.between(0.005, 0.3) * stiffness / at.travel_m[at.axis])}


def _asymmetric(device: Device, axis: int, values: Values) -> Device:
    return with_forces(device, axis, {SQUARE: values["k2"]})


def _draw_constant(at: Circumstances) -> dict[str, float]:
    return {"force": at.sign() * at.between(0.001, 0.3)}


def _constant(device: Device, axis: int, values: Values) -> Device:
    return with_forces(device, axis, {CONSTANT: values["force"]})


def _draw_cogging(at: Circumstances) -> dict[str, float]:
    return {
        "amplitude": at.between(0.004, 0.15),
        "pitch": at.some(4e-4, 4e-3),
        "phase": at.random.uniform(0, 2 * np.pi),
    }


def _cogging(device: Device, axis: int, values: Values) -> Device:
    cells = {RIPPLE: values["amplitude"], PITCH: values["pitch"], PHASE: values["phase"]}
    return with_forces(device, axis, cells)


def _draw_stop(at: Circumstances) -> dict[str, float]:
    reached = 1.0 - 0.6 * at.between(0.003, 1.0)
    return {
        "position": at.sign() * reached * at.travel_m[at.axis],
        "stiffness": at.some(300.0, 2e4),
        "opposite": float(at.random.integers(2)),
    }


def _stop(device: Device, axis: int, values: Values) -> Device:
    place = values["position"]
    one, other = (ABOVE, BELOW) if place > 0.0 else (BELOW, ABOVE)
    cells = {one: place, STOP: values["stiffness"]}
    return with_forces(device, axis, cells | ({other: -place} if values["opposite"] else {}))


EFFECTS = (
    HiddenEffect("hardening_stiffness", "mechanism", True, _draw_hardening, _hardening),
    HiddenEffect("asymmetric_stiffness", "mechanism", True, _draw_asymmetric, _asymmetric),
    HiddenEffect("constant_force", "mechanism", True, _draw_constant, _constant),
    HiddenEffect("cogging", "mechanism", True, _draw_cogging, _cogging),
    HiddenEffect("end_stop", "mechanism", True, _draw_stop, _stop),
)
