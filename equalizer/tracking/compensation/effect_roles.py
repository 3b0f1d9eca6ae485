"""Role of each effect in a feedforward: compensated by a force, used for scaling or timing, or not compensated.

The texts are shown to the user as the reason why an effect is not compensated.
"""

import numpy as np

from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.tracking.compensation.known_forces import LAWS
from equalizer.tracking.compensation.law_compensation import SENSOR_ERROR, explain_law_not_compensated

IN_MODEL_REASON = "it is linear, so the identified model has it; compensating it again would count it twice"
"""Reason for linear effects that the identified model contains."""

REASONS_NOT_COMPENSATED = {
    "viscous_damping": IN_MODEL_REASON,
    "added_mass": IN_MODEL_REASON,
    "extra_mode": IN_MODEL_REASON,
    "hand_impedance": IN_MODEL_REASON,
    "constant_force": "the virtual spring balances it before playback, and a constant force has no content in the band",
    "gravity_torque": "for a small motion it acts as a spring, which the identified model contains",
    "cogging": "amplitude and pitch do not determine its sign at a position",
    "backlash": "a force cannot act across a gap",
    "loose_joint": "a force cannot act across a gap",
    "body_on_actuator": IN_MODEL_REASON,
    "end_stop": "a motion that reaches a stop should be made smaller",
    "pose_dependent_inertia": "use a model identified at that place; the inertia is constant during a small vibration",
    "time_varying_grip": "the grip is not known in advance",
    "force_saturation": "the device cannot produce a larger force; the cap keeps forces within this limit",
    "force_nonlinearity": "the identified model contains the gain at the level of its identification",
    "slew_limit": "the device cannot change its force faster",
}
"""Reasons by name of the effect, for effects of mechanism, hand and actuator that are not compensated. The reason for
effects of the sensor other than its lag is `SENSOR_ERROR`."""

SCALING_REASON = "in the identified model as far as it is linear; used to scale what is added"
TIMING_REASON = "in the identified model; used to send what is added ahead of time"
"""Reasons for the effects of `SCALING_EFFECTS` and of `TIMING_EFFECTS`, which act on the compensating forces."""

SCALING_EFFECTS, TIMING_EFFECTS = ("force_gain",), ("amplifier_lag", "transport_delay", "sensor_lag")
"""Effects that scale the added forces, and effects that determine by how much they are advanced (`compute_lead_s`)."""


def explain_not_compensated(effect: ModelEffect, inputs: tuple[str, ...]) -> str:
    """Explain why an effect is not compensated, as a clause for the user; empty for a compensated effect. inputs:
    channels of the commands, by which a discovered law names the axes. Raises KeyError for an effect that is not in the
    catalogue."""
    kind = effect.kind
    if effect.law is not None:
        return explain_law_not_compensated(effect.law, inputs)
    if kind in LAWS or kind == "force_deadband":
        return ""
    if kind in SCALING_EFFECTS:
        return SCALING_REASON
    if kind in TIMING_EFFECTS:
        return TIMING_REASON
    if EFFECTS_BY_NAME[kind].place == "sensor":
        return SENSOR_ERROR
    return REASONS_NOT_COMPENSATED[kind]


def compute_lead_s(physics: MechanicalModel, sample_rate_hz: float) -> float:
    """Compute the delay (s) from a commanded force to its measured effect: half a sample of the hold, delays, and the
    time constant 1 / (2 pi f) of each first-order low pass of actuator and sensor, valid well below its corner f (0: no
    low pass); an effect `sensor_lag` replaces the sensor's corner. The identified model includes this delay; forces
    that are added to the model's forces must be advanced by it."""
    corners_hz = [physics.actuator.bandwidth_hz, physics.sensor.bandwidth_hz]
    delay_s = 0.5 / sample_rate_hz + physics.actuator.delay_s
    for effect in physics.effects:
        match effect.kind:
            case "amplifier_lag":
                delay_s += effect.parameters["time_constant"]
            case "transport_delay":
                delay_s += effect.parameters["delay"]
            case "sensor_lag":
                corners_hz[1] = effect.parameters["bandwidth"]
    return delay_s + sum(1 / (2 * np.pi * corner_hz) for corner_hz in corners_hz if corner_hz > 0)
