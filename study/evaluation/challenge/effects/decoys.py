"""Decoys: physical effects outside the catalogue, which a diagnosis must leave unexplained instead of naming a wrong
effect.

* creep: viscoelastic ground with relaxation times over two decades, as of plastics and cables; a spring (N/m) in series
  with a damper per time constant.
* damping_of_place: damping of one axis that grows with the square of the position, from the centre (N s/m³).
* stiffness_in_time: the ground stiffness of one axis switches periodically (square wave, Hz), by `depth` times itself.
* bending_sensor: soft saturation (tanh; bend in s²/m), then hysteresis (play operator, m/s²), in all channels.
* crossed_axes: a spring that couples the axes x and y, with the potential coupling x² y / 2 (N/m²).
* skipped_commands: the commands with index n, 2n, … (`every` n) are not written; the previous command is held.
* tired_motor: the force constant falls by `loss_per_n2` (1/N²) times the square of the force, averaged over `seconds`,
  as by heating.
* force_hysteresis: play operator (half width in N) between command and motor force, as magnetic hysteresis.

The main parameter is interpolated geometrically by the strength, 0 to 1, between the two values given to
`interpolate_log`, others are random; these ranges were chosen by hand.
"""

from dataclasses import replace

import numpy as np

from study.evaluation.challenge.actuator_kernel import HEATING_LOSS, HEATING_TIME_S, HYSTERESIS_HALF_WIDTH
from study.evaluation.challenge.concealed_effect import (
    ConcealedEffect,
    Values,
    replace_amplifier_cells,
    replace_handle_forces,
    replace_sensor,
)
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.handle_force_kernel import POSITION_DAMPING

CREEP_TIMES_S = (0.02, 0.2, 2.0)
"""Time constants of the creep (s), a decade apart. Chosen."""


def _build_creep(device: Device, axis: int, values: Values) -> Device:
    """Add the springs between the ground and the axis."""
    stiffness = np.zeros((3, len(CREEP_TIMES_S)))
    stiffness[axis] = values["stiffness"]
    return replace(device, creep_stiffness=stiffness, creep_time_s=np.array(CREEP_TIMES_S))


def _build_stiffness_switching(device: Device, axis: int, values: Values) -> Device:
    """Add a square wave to the ground stiffness of the axis, `depth` times its stiffness. A row of the modulation holds
    rate (Hz), depths of damping and stiffness, phase (rad), and the flag of a square wave."""
    modulation = device.modulation.copy()
    stiffness_n_per_m = values["depth"] * device.bench.stiffness[axis, axis]
    modulation[axis] = (values["rate_hz"], 0.0, stiffness_n_per_m, 0.0, 1.0)
    return replace(device, modulation=modulation)


DECOYS = (
    ConcealedEffect(
        "creep", "mechanism", True,
        lambda context: {
            "stiffness": context.interpolate_log(0.05, 1.0) * context.bench.stiffness[context.axis, context.axis]
        },
        _build_creep,
    ),
    ConcealedEffect(
        "damping_of_place", "mechanism", True,
        lambda context: {"damping_per_m2": context.interpolate_log(0.5, 12.0) / context.travel_m[context.axis] ** 2},
        lambda device, axis, values: replace_handle_forces(device, axis, {POSITION_DAMPING: values["damping_per_m2"]}),
    ),
    ConcealedEffect(
        "stiffness_in_time", "mechanism", True,
        lambda context: {"rate_hz": context.draw_log_uniform(0.7, 9.0), "depth": context.interpolate_log(0.05, 0.7)},
        _build_stiffness_switching,
    ),
    ConcealedEffect(
        "bending_sensor", "sensor", False,
        lambda context: {
            "bend": context.interpolate_log(0.3, 1.5) / context.peak_mps2.max(),
            "play": context.interpolate_log(0.03, 0.8),
        },
        lambda device, axis, values: replace_sensor(
            device, {"inverse_saturation": values["bend"], "play_half_width_mps2": values["play"]}
        ),
    ),
    ConcealedEffect(
        "crossed_axes", "mechanism", False,
        lambda context: {
            "coupling": context.draw_sign()
            * context.interpolate_log(0.02, 0.3)
            * context.bench.stiffness[0, 0]
            / context.travel_m.max()
        },
        lambda device, axis, values: replace(device, coupling=values["coupling"]),
    ),
    ConcealedEffect(
        "skipped_commands", "actuator", False,
        lambda context: {"every": float(round(context.interpolate_log(2000.0, 8.0)))},
        lambda device, axis, values: replace(device, skipped=int(values["every"])),
    ),
    ConcealedEffect(
        "tired_motor", "actuator", True,
        lambda context: {
            "loss_per_n2": context.interpolate_log(0.02, 0.3),
            "seconds": context.draw_log_uniform(2.0, 8.0),
        },
        lambda device, axis, values: replace_amplifier_cells(
            device, axis, {HEATING_LOSS: values["loss_per_n2"], HEATING_TIME_S: values["seconds"]}
        ),
    ),
    ConcealedEffect(
        "force_hysteresis", "actuator", True,
        lambda context: {"half_width": context.interpolate_log(0.01, 0.3)},
        lambda device, axis, values: replace_amplifier_cells(
            device, axis, {HYSTERESIS_HALF_WIDTH: values["half_width"]}
        ),
    ),
)  # fmt: skip
"""The decoys; none of their names is in the vocabulary of effects."""
