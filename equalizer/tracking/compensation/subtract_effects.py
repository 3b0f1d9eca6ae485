"""Subtraction of known effects from a recording: their forces along the measured motion are subtracted from the
commands. A model identified from the result describes the linear part only; `compensate` then adds the complete forces
of the effects.

The force of an axis that sticks cannot be computed from its motion. All axes must therefore move all the time
(multisines on all axes, well above friction), which excludes sweeps of one axis after the other.
"""

from dataclasses import replace

import numpy as np

from equalizer.laws.evaluate import evaluate
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.tracking.compensation.effect_compensation import (
    compute_axis_gains,
    compute_slip_speed,
    convert_motion_to_axes,
    evaluate_force_law,
    find_effect_axes,
)
from equalizer.tracking.compensation.effect_roles import compute_lead_s, explain_not_compensated
from equalizer.tracking.compensation.known_forces import apply_deadband
from equalizer.tracking.feedforward.planned_motion import integrate_motion

HIGHEST_SHARE = 3.0
"""Upper end of the band in which the motion is integrated, relative to the highest driven frequency: it includes the
third harmonic, the strongest harmonic of dry friction."""
LOWEST_SHARE = 0.75
"""Lower end of that band, relative to the lowest driven frequency; below it, double integration amplifies the noise and
drift of the sensor by 1/f². Set by hand."""
NYQUIST_SHARE = 0.45
"""Limit of the upper end, relative to the sample rate: it leaves room for the edge of the band below Nyquist."""


def subtract_effects(recording: Recording, physics: MechanicalModel, excited_hz: tuple[float, float]) -> Recording:
    """The recording with commands u - F(x, v) / g, where F is the force that would compensate the known effects along
    the measured motion, and g the gain of the axis's actuator.

    The response must be the acceleration, one channel per command, in the same order. excited_hz: band of the commands'
    power. The excitation is not changed. Effects that act on the command are applied to it before forces are
    subtracted. Raises ValueError for another response, missing samples, and unknown axes.
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
    band_hz = (LOWEST_SHARE * excited_hz[0], min(HIGHEST_SHARE * excited_hz[1], NYQUIST_SHARE * rate_hz))
    planned = integrate_motion(recording.response.samples, rate_hz, band_hz, compute_lead_s(physics, rate_hz))
    motion = convert_motion_to_axes(planned, physics)
    gain, commands = compute_axis_gains(physics, inputs, outputs), recording.command.samples.copy()
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
        law_place = "force" if effect.law is None else effect.law.acts_on
        if law_place == "force" and effect.kind != "force_deadband" and not explain_not_compensated(effect, inputs):
            for axis in find_effect_axes(effect, inputs, outputs):
                slip = max(compute_slip_speed(motion.velocity[:, axis]), np.finfo(np.float64).tiny)
                commands[:, axis] -= evaluate_force_law(effect, axis, motion, (inputs, rate_hz), slip)[1] / gain[axis]
    return replace(recording, command=replace(recording.command, samples=commands))
