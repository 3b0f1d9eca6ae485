"""Decoys: physics outside the catalogue, which a diagnosis must leave unexplained.

creep: viscoelastic ground with three relaxation times over two decades, as in plastics and cables. damping_of_place:
damping grows with the square of the distance from the centre. stiffness_in_time: the ground stiffness of one axis
switches periodically. bending_sensor: soft saturation with hysteresis in all channels. crossed_axes: a potential c x^2
y / 2. skipped_commands: every n-th command is not written. tired_motor: the force constant falls with heating.
force_hysteresis: play between command and motor force, as in iron.
"""

from dataclasses import replace

import numpy as np

from study.evaluation.challenge.actuator_kernel import FADE, FADE_S, HELD
from study.evaluation.challenge.concealed_effect import (
    ConcealedEffect,
    EffectContext,
    Values,
    with_amplifier,
    with_forces,
)
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.handle_force_kernel import DAMPING_SQUARE

CREEP_TIMES_S = (0.02, 0.2, 2.0)
"""Time constants of the creep (s), a decade apart."""


def _draw_creep(at: EffectContext) -> dict[str, float]:
    return {"stiffness": at.log_between(0.05, 1.0) * at.bench.stiffness[at.axis, at.axis]}


def _build_creep(device: Device, axis: int, values: Values) -> Device:
    stiffness = np.zeros((3, len(CREEP_TIMES_S)))
    stiffness[axis] = values["stiffness"]
    return replace(device, creep_stiffness=stiffness, creep_time_s=np.array(CREEP_TIMES_S))


def _draw_damping(at: EffectContext) -> dict[str, float]:
    return {"damping_per_m2": at.log_between(0.5, 12.0) / at.travel_m[at.axis] ** 2}


def _build_damping(device: Device, axis: int, values: Values) -> Device:
    return with_forces(device, axis, {DAMPING_SQUARE: values["damping_per_m2"]})


def _draw_swing(at: EffectContext) -> dict[str, float]:
    return {"rate_hz": at.draw_log_uniform(0.7, 9.0), "depth": at.log_between(0.05, 0.7)}


def _build_swing(device: Device, axis: int, values: Values) -> Device:
    varying = device.varying.copy()
    stiffness = values["depth"] * device.bench.stiffness[axis, axis]
    varying[axis] = (values["rate_hz"], 0.0, stiffness, 0.0, 1.0)
    return replace(device, varying=varying)


def _draw_bending(at: EffectContext) -> dict[str, float]:
    return {"bend": at.log_between(0.3, 1.5) / at.peak_mps2.max(), "play": at.log_between(0.03, 0.8)}


def _build_bending(device: Device, axis: int, values: Values) -> Device:
    return replace(device, sensor=replace(device.sensor, bend=values["bend"], play=values["play"]))


def _draw_crossed(at: EffectContext) -> dict[str, float]:
    return {"coupling": at.sign() * at.log_between(0.02, 0.3) * at.bench.stiffness[0, 0] / at.travel_m.max()}


def _build_crossed(device: Device, axis: int, values: Values) -> Device:
    return replace(device, coupling=values["coupling"])


def _draw_skipped(at: EffectContext) -> dict[str, float]:
    return {"every": float(round(at.log_between(2000.0, 8.0)))}


def _build_skipped(device: Device, axis: int, values: Values) -> Device:
    return replace(device, skipped=int(values["every"]))


def _draw_tired(at: EffectContext) -> dict[str, float]:
    return {"loss_per_n2": at.log_between(0.02, 0.3), "seconds": at.draw_log_uniform(2.0, 8.0)}


def _build_tired(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, axis, {FADE: values["loss_per_n2"], FADE_S: values["seconds"]})


def _draw_iron(at: EffectContext) -> dict[str, float]:
    return {"half_width": at.log_between(0.01, 0.3)}


def _build_iron(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, axis, {HELD: values["half_width"]})


DECOYS = (
    ConcealedEffect("creep", "mechanism", True, _draw_creep, _build_creep),
    ConcealedEffect("damping_of_place", "mechanism", True, _draw_damping, _build_damping),
    ConcealedEffect("stiffness_in_time", "mechanism", True, _draw_swing, _build_swing),
    ConcealedEffect("bending_sensor", "sensor", False, _draw_bending, _build_bending),
    ConcealedEffect("crossed_axes", "mechanism", False, _draw_crossed, _build_crossed),
    ConcealedEffect("skipped_commands", "actuator", False, _draw_skipped, _build_skipped),
    ConcealedEffect("tired_motor", "actuator", True, _draw_tired, _build_tired),
    ConcealedEffect("force_hysteresis", "actuator", True, _draw_iron, _build_iron),
)
"""As `EFFECTS` of the other files; the names are none of the vocabulary."""
