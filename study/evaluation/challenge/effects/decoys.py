"""Decoys: physical effects outside the catalogue, which a diagnosis must leave unexplained instead of naming a wrong
effect.

* creep: viscoelastic ground with relaxation times over two decades, as of plastics and cables.
* damping_of_place: damping of one axis that grows with the square of the position, from the centre.
* stiffness_in_time: the ground stiffness of one axis switches periodically (square wave).
* bending_sensor: soft saturation (tanh), then hysteresis (play operator), in all channels.
* crossed_axes: a spring that couples the axes x and y, with the potential coupling x² y / 2.
* skipped_commands: every n-th command is not written; the previous command is held.
* tired_motor: the force constant falls in proportion to the averaged square of the force, as by heating.
* force_hysteresis: play operator between command and motor force, as magnetic hysteresis.

For each decoy, `_draw_…` draws the parameters: the main one is interpolated geometrically by the strength, 0 to 1,
between the two values given to `interpolate_log`, others are random; these ranges were chosen by hand. `_build_…`
returns the device with the effect.
"""

from dataclasses import replace

import numpy as np

from study.evaluation.challenge.actuator_kernel import HEATING_LOSS, HEATING_TIME_S, HYSTERESIS_HALF_WIDTH
from study.evaluation.challenge.concealed_effect import (
    ConcealedEffect,
    EffectContext,
    Values,
    replace_amplifier_cells,
    replace_handle_forces,
)
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.handle_force_kernel import POSITION_DAMPING

CREEP_TIMES_S = (0.02, 0.2, 2.0)
"""Time constants of the creep (s), a decade apart. Chosen."""


def _draw_creep(context: EffectContext) -> dict[str, float]:
    """Draw stiffness (N/m), the same for each relaxing spring: 0.05 to 1 times the ground stiffness of the axis."""
    return {"stiffness": context.interpolate_log(0.05, 1.0) * context.bench.stiffness[context.axis, context.axis]}


def _build_creep(device: Device, axis: int, values: Values) -> Device:
    """Add a spring in series with a damper per time constant, between the ground and the axis."""
    stiffness = np.zeros((3, len(CREEP_TIMES_S)))
    stiffness[axis] = values["stiffness"]
    return replace(device, creep_stiffness=stiffness, creep_time_s=np.array(CREEP_TIMES_S))


def _draw_position_damping(context: EffectContext) -> dict[str, float]:
    """Draw damping_per_m2 (N s/m³): 0.5 to 12 N s/m at the largest distance of the motion from the centre."""
    return {"damping_per_m2": context.interpolate_log(0.5, 12.0) / context.travel_m[context.axis] ** 2}


def _build_position_damping(device: Device, axis: int, values: Values) -> Device:
    """Add the damping of the axis that grows with the square of its position."""
    return replace_handle_forces(device, axis, {POSITION_DAMPING: values["damping_per_m2"]})


def _draw_stiffness_switching(context: EffectContext) -> dict[str, float]:
    """Draw rate_hz (Hz) of the switching, and depth: change of the stiffness relative to that of the axis."""
    return {"rate_hz": context.draw_log_uniform(0.7, 9.0), "depth": context.interpolate_log(0.05, 0.7)}


def _build_stiffness_switching(device: Device, axis: int, values: Values) -> Device:
    """Add a square wave to the ground stiffness of the axis, `depth` times its stiffness. A row of the modulation holds
    rate (Hz), depths of damping and stiffness, phase (rad), and the flag of a square wave."""
    modulation = device.modulation.copy()
    stiffness_n_per_m = values["depth"] * device.bench.stiffness[axis, axis]
    modulation[axis] = (values["rate_hz"], 0.0, stiffness_n_per_m, 0.0, 1.0)
    return replace(device, modulation=modulation)


def _draw_sensor_distortion(context: EffectContext) -> dict[str, float]:
    """Draw bend (s²/m), the reciprocal of the saturated reading, and play (m/s²), half the width of the play."""
    return {
        "bend": context.interpolate_log(0.3, 1.5) / context.peak_mps2.max(),
        "play": context.interpolate_log(0.03, 0.8),
    }


def _build_sensor_distortion(device: Device, axis: int, values: Values) -> Device:
    """Add soft saturation and play to all channels of the accelerometer."""
    return replace(
        device, sensor=replace(device.sensor, inverse_saturation=values["bend"], play_half_width_mps2=values["play"])
    )


def _draw_axis_coupling(context: EffectContext) -> dict[str, float]:
    """Draw coupling (N/m²), of either sign: 0.02 to 0.3 times the ground stiffness of the x axis over the largest
    travel."""
    return {
        "coupling": context.draw_sign()
        * context.interpolate_log(0.02, 0.3)
        * context.bench.stiffness[0, 0]
        / context.travel_m.max()
    }


def _build_axis_coupling(device: Device, axis: int, values: Values) -> Device:
    """Add the spring that couples the axes x and y."""
    return replace(device, coupling=values["coupling"])


def _draw_skipped_commands(context: EffectContext) -> dict[str, float]:
    """Draw every: n, where the commands with index n, 2n, … (from 0) are not written; 2000 (weakest) to 8."""
    return {"every": float(round(context.interpolate_log(2000.0, 8.0)))}


def _build_skipped_commands(device: Device, axis: int, values: Values) -> Device:
    """Hold the previous command instead of every n-th one, on all axes."""
    return replace(device, skipped=int(values["every"]))


def _draw_motor_heating(context: EffectContext) -> dict[str, float]:
    """Draw loss_per_n2 (1/N²), share of the force lost per mean square force, and seconds (s), averaging time of that
    mean."""
    return {"loss_per_n2": context.interpolate_log(0.02, 0.3), "seconds": context.draw_log_uniform(2.0, 8.0)}


def _build_motor_heating(device: Device, axis: int, values: Values) -> Device:
    """Let the force constant of the axis fall with the mean square of its force."""
    return replace_amplifier_cells(
        device, axis, {HEATING_LOSS: values["loss_per_n2"], HEATING_TIME_S: values["seconds"]}
    )


def _draw_force_hysteresis(context: EffectContext) -> dict[str, float]:
    """Draw half_width (N), half the width of the play between command and force."""
    return {"half_width": context.interpolate_log(0.01, 0.3)}


def _build_force_hysteresis(device: Device, axis: int, values: Values) -> Device:
    """Add the play between command and motor force of the axis."""
    return replace_amplifier_cells(device, axis, {HYSTERESIS_HALF_WIDTH: values["half_width"]})


DECOYS = (
    ConcealedEffect("creep", "mechanism", True, _draw_creep, _build_creep),
    ConcealedEffect("damping_of_place", "mechanism", True, _draw_position_damping, _build_position_damping),
    ConcealedEffect("stiffness_in_time", "mechanism", True, _draw_stiffness_switching, _build_stiffness_switching),
    ConcealedEffect("bending_sensor", "sensor", False, _draw_sensor_distortion, _build_sensor_distortion),
    ConcealedEffect("crossed_axes", "mechanism", False, _draw_axis_coupling, _build_axis_coupling),
    ConcealedEffect("skipped_commands", "actuator", False, _draw_skipped_commands, _build_skipped_commands),
    ConcealedEffect("tired_motor", "actuator", True, _draw_motor_heating, _build_motor_heating),
    ConcealedEffect("force_hysteresis", "actuator", True, _draw_force_hysteresis, _build_force_hysteresis),
)
"""The decoys; none of their names is in the vocabulary of effects."""
