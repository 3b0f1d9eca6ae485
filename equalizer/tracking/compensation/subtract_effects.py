"""Subtraction of known nonlinear effects, such as friction, from the commands of a recording.

The motion is integrated from the measured acceleration, the effects' forces are evaluated along it, and their
compensating forces are subtracted from the commands. A model identified from the result describes the linear part only;
`effect_compensation` then adds the complete forces of the effects.

The friction force of an axis that sticks cannot be computed from its motion. All axes must therefore move all the time
(multisines on all axes, well above friction), which excludes sweeps of one axis after the other.
"""

from dataclasses import replace

import numpy as np

from equalizer.laws.evaluate import evaluate
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.tracking.compensation.effect_compensation import (
    compute_axis_gains,
    compute_channels_to_axes,
    compute_slip_speed,
    convert_motion_to_axes,
    evaluate_force_law,
    find_effect_axes,
)
from equalizer.tracking.compensation.effect_roles import compute_lead_s, explain_not_compensated
from equalizer.tracking.compensation.known_forces import apply_deadband
from equalizer.tracking.feedforward.planned_motion import integrate_motion

UPPER_LIMIT_FACTOR = 3.0
"""Upper limit of the band in which the motion is integrated, relative to the highest driven frequency: it includes the
third harmonic, the strongest harmonic of dry friction."""
LOWER_LIMIT_FACTOR = 0.75
"""Lower limit of that band, relative to the lowest driven frequency; below it, double integration amplifies the noise
and drift of the sensor by 1/f². Chosen."""
LARGEST_RATE_SHARE = 0.45
"""Largest upper limit, relative to the sample rate: it leaves room for the edge of the band below the Nyquist
frequency, 0.5. Chosen."""


def subtract_effects(recording: Recording, physics: MechanicalModel, excited_hz: tuple[float, float]) -> Recording:
    """Change the commands u of a recording to u - F(x, v) / g, where F is the force that would compensate the known
    effects along the measured motion, and g the gain of the axis's actuator (`force_gain`).

    Effects on the command (deadbands and laws) are applied to it first. Effects that cannot be compensated are left out
    (`explain_not_compensated`); the recording's excitation is not changed. The response must be the acceleration, one
    channel per command, in the same order. excited_hz: band (Hz) of the commands' power, above 0. Raises ValueError for
    another response, missing samples, a band from 0 Hz, and unknown axes.
    """
    inputs, outputs = recording.command.channels, recording.response.channels
    if recording.response.quantity != "acceleration" or len(inputs) != len(outputs):
        raise ValueError(
            f"the motion is integrated from accelerations, one per command; there are {len(inputs)} commands and "
            f"{len(outputs)} channels of {recording.response.quantity}"
        )
    if not (np.isfinite(recording.response.samples).all() and np.isfinite(recording.command.samples).all()):
        raise ValueError("the recording has missing samples; a motion cannot be integrated across them")
    rate_hz = recording.sample_rate_hz
    band_hz = (
        LOWER_LIMIT_FACTOR * excited_hz[0],
        min(UPPER_LIMIT_FACTOR * excited_hz[1], LARGEST_RATE_SHARE * rate_hz),
    )
    # Without the offset of the sensor, such as gravity: the record must begin and end at zero.
    acceleration = recording.response.samples - recording.response.samples.mean(axis=0)
    integrated_motion = integrate_motion(acceleration, rate_hz, band_hz, compute_lead_s(physics, rate_hz))
    motion = convert_motion_to_axes(integrated_motion, compute_channels_to_axes(physics, len(outputs)))
    axis_gains, commands = compute_axis_gains(physics, inputs, outputs), recording.command.samples.copy()
    for effect in physics.effects:
        for axis in find_effect_axes(effect, inputs, outputs):
            if (
                effect.law is not None
                and effect.law.acts_on == "command"
                and not explain_not_compensated(effect, inputs)
            ):
                commands[:, axis] = evaluate(effect.law, {effect.law.variables[0]: commands[:, axis]}, rate_hz)
            if effect.kind == "force_deadband":
                commands[:, axis] = apply_deadband(effect.parameters, commands[:, axis])
    for effect in physics.effects:
        acts_on = "force" if effect.law is None else effect.law.acts_on
        if acts_on == "force" and effect.kind != "force_deadband" and not explain_not_compensated(effect, inputs):
            for axis in find_effect_axes(effect, inputs, outputs):
                slip_mps = max(compute_slip_speed(motion.velocity[:, axis]), np.finfo(np.float64).tiny)
                commands[:, axis] -= (
                    evaluate_force_law(effect, axis, motion, (inputs, rate_hz), slip_mps)[1] / axis_gains[axis]
                )
    return replace(recording, command=replace(recording.command, samples=commands))
