"""Decoys: physical effects outside the catalogue, which a diagnosis must leave unexplained rather than misname.

* creep: viscoelastic ground with relaxation times over two decades, as of plastics and cables.
* damping_of_place: damping of one axis that grows with the square of the position, from the centre.
* stiffness_in_time: the ground stiffness of one axis switches periodically (square wave).
* bending_sensor: soft saturation (tanh), then hysteresis (play operator), in all channels.
* crossed_axes: a spring that couples the axes x and y, with the potential coupling x² y / 2.
* skipped_commands: every n-th command is not written; the force of the command before is held.
* tired_motor: the force constant falls in proportion to the averaged square of the force, as by heating.
* force_hysteresis: play operator between command and motor force, as magnetic hysteresis.

For each decoy, `_draw_…` draws the parameters for a strength from 0 to 1, between the two values given to
`log_between`; these ranges were chosen by hand. `_build_…` returns the device with the effect.
"""

from dataclasses import replace

import numpy as np

from study.evaluation.challenge.actuator_kernel import HEATING_LOSS, HEATING_TIME_S, HYSTERESIS_HALF_WIDTH
from study.evaluation.challenge.concealed_effect import (
    ConcealedEffect,
    EffectContext,
    Values,
    with_amplifier,
    with_forces,
)
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.handle_force_kernel import POSITION_DAMPING

CREEP_TIMES_S = (0.02, 0.2, 2.0)
"""Time constants of the creep (s), a decade apart."""


def _draw_creep(context: EffectContext) -> dict[str, float]:
    """stiffness: N/m, of each of the relaxing springs; relative to the ground stiffness of the axis."""
    return {"stiffness": context.interpolate_log(0.05, 1.0) * context.bench.stiffness[context.axis, context.axis]}


def _build_creep(device: Device, axis: int, values: Values) -> Device:
    stiffness = np.zeros((3, len(CREEP_TIMES_S)))
    stiffness[axis] = values["stiffness"]
    return replace(device, creep_stiffness=stiffness, creep_time_s=np.array(CREEP_TIMES_S))


def _draw_damping(context: EffectContext) -> dict[str, float]:
    """damping_per_m2: N s/m per m²; at the largest distance of the motion, 0.5 to 12 N s/m."""
    return {"damping_per_m2": context.interpolate_log(0.5, 12.0) / context.travel_m[context.axis] ** 2}


def _build_damping(device: Device, axis: int, values: Values) -> Device:
    return with_forces(device, axis, {POSITION_DAMPING: values["damping_per_m2"]})


def _draw_switching(context: EffectContext) -> dict[str, float]:
    """rate_hz: of the switching; depth: change of the stiffness, relative to that of the axis."""
    return {"rate_hz": context.draw_log_uniform(0.7, 9.0), "depth": context.interpolate_log(0.05, 0.7)}


def _build_switching(device: Device, axis: int, values: Values) -> Device:
    varying = device.varying.copy()
    stiffness = values["depth"] * device.bench.stiffness[axis, axis]
    varying[axis] = (values["rate_hz"], 0.0, stiffness, 0.0, 1.0)
    return replace(device, varying=varying)


def _draw_bending(context: EffectContext) -> dict[str, float]:
    """bend: s²/m, reciprocal of the largest reading of the saturation; play: m/s², half its width."""
    return {
        "bend": context.interpolate_log(0.3, 1.5) / context.peak_mps2.max(),
        "play": context.interpolate_log(0.03, 0.8),
    }


def _build_bending(device: Device, axis: int, values: Values) -> Device:
    return replace(
        device, sensor=replace(device.sensor, inverse_saturation=values["bend"], play_half_width_mps2=values["play"])
    )


def _draw_coupling(context: EffectContext) -> dict[str, float]:
    """coupling: N/m²; relative to the ground stiffness of the x axis over the largest travel."""
    return {
        "coupling": context.draw_sign()
        * context.interpolate_log(0.02, 0.3)
        * context.bench.stiffness[0, 0]
        / context.travel_m.max()
    }


def _build_coupling(device: Device, axis: int, values: Values) -> Device:
    return replace(device, coupling=values["coupling"])


def _draw_skipped(context: EffectContext) -> dict[str, float]:
    """every: n; the command numbered n, 2n, … is not written. Stronger is a smaller n."""
    return {"every": float(round(context.interpolate_log(2000.0, 8.0)))}


def _build_skipped(device: Device, axis: int, values: Values) -> Device:
    return replace(device, skipped=int(values["every"]))


def _draw_heating(context: EffectContext) -> dict[str, float]:
    """loss_per_n2: share of the force lost per N² of mean square force; seconds: averaging time of that mean."""
    return {"loss_per_n2": context.interpolate_log(0.02, 0.3), "seconds": context.draw_log_uniform(2.0, 8.0)}


def _build_heating(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, axis, {HEATING_LOSS: values["loss_per_n2"], HEATING_TIME_S: values["seconds"]})


def _draw_hysteresis(context: EffectContext) -> dict[str, float]:
    """half_width: N, half the play between command and force."""
    return {"half_width": context.interpolate_log(0.01, 0.3)}


def _build_hysteresis(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, axis, {HYSTERESIS_HALF_WIDTH: values["half_width"]})


DECOYS = (
    ConcealedEffect("creep", "mechanism", True, _draw_creep, _build_creep),
    ConcealedEffect("damping_of_place", "mechanism", True, _draw_damping, _build_damping),
    ConcealedEffect("stiffness_in_time", "mechanism", True, _draw_switching, _build_switching),
    ConcealedEffect("bending_sensor", "sensor", False, _draw_bending, _build_bending),
    ConcealedEffect("crossed_axes", "mechanism", False, _draw_coupling, _build_coupling),
    ConcealedEffect("skipped_commands", "actuator", False, _draw_skipped, _build_skipped),
    ConcealedEffect("tired_motor", "actuator", True, _draw_heating, _build_heating),
    ConcealedEffect("force_hysteresis", "actuator", True, _draw_hysteresis, _build_hysteresis),
)
"""The decoys, in the form of `EFFECTS` in the modules of this package; no name is in the vocabulary of effects."""
