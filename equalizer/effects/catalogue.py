"""Catalogue of the effects that a diagnosis can name and a simulation can include by their name.

A diagnosis can also name laws that are not listed here; a simulation includes them as formulas, if at all
(`analysis.diagnosis.effect_words`). Each effect module that is imported here defines one `EFFECT`. A new effect needs
its own module, an entry here and its name in `equalizer.plant.effect_vocabulary`, in the same order; the other places
(words, roles, tests) are listed in docs/contributing.md.
"""

from equalizer.effects import (
    added_mass,
    amplifier_lag,
    asymmetric_friction,
    asymmetric_stiffness,
    backlash,
    body_on_actuator,
    clock_drift,
    cogging,
    constant_force,
    coulomb_friction,
    cross_axis_sensitivity,
    end_stop,
    extra_mode,
    force_deadband,
    force_gain,
    force_nonlinearity,
    force_saturation,
    gravity_torque,
    hand_impedance,
    hardening_stiffness,
    logger_offset,
    loose_joint,
    lost_samples,
    mains_hum,
    pose_dependent_inertia,
    position_dependent_friction,
    presliding_hysteresis,
    quadratic_damping,
    quantization,
    sensor_clipping,
    sensor_drift,
    sensor_gain,
    sensor_lag,
    sensor_misalignment,
    sensor_nonlinearity,
    sensor_offset,
    slew_limit,
    stribeck_friction,
    time_varying_grip,
    transport_delay,
    viscous_damping,
)
from equalizer.effects.effect import Effect

CATALOGUE: tuple[Effect, ...] = tuple(
    module.EFFECT
    for module in (
        coulomb_friction, asymmetric_friction, stribeck_friction, position_dependent_friction, presliding_hysteresis,
        viscous_damping, quadratic_damping, hardening_stiffness, asymmetric_stiffness, constant_force,
        gravity_torque, cogging,
        backlash, loose_joint, end_stop, pose_dependent_inertia, extra_mode, added_mass,
        hand_impedance, time_varying_grip,
        body_on_actuator, force_saturation, force_deadband, slew_limit, amplifier_lag, transport_delay, force_gain,
        force_nonlinearity,
        sensor_lag, sensor_clipping, sensor_misalignment, cross_axis_sensitivity, sensor_gain, sensor_nonlinearity,
        sensor_offset, sensor_drift, quantization, mains_hum, clock_drift, logger_offset, lost_samples,
    )
)  # fmt: skip
"""Effects in the order of `equalizer.plant.effect_vocabulary`."""

EFFECTS: dict[str, Effect] = {effect.name: effect for effect in CATALOGUE}
"""Effects of `CATALOGUE` by name."""
