"""Concealable effects of inertia and damping of the mechanism that the model of a simulated device lacks.

- Viscous damping -d v (N s/m) and an added mass (kg) act on one axis of the handle.
- Quadratic damping is the force -c v |v| (c in N s²/m²).
- Pose-dependent inertia multiplies the mass by 1 + b x (b in 1/m), with x along the named axis and without the force
  from the derivative of the mass; whether it holds for the whole handle or for motion along this axis only is drawn.
- An extra mode is a mass (kg) on a spring and damper attached to the handle (natural frequency in Hz); its direction
  has components up to 0.25 along each other axis, relative to the named axis.
- Backlash (total gap in m) lies between the motor, a part of the axis's mass on which the force acts, and the handle;
  in contact a stiff spring (N/m) with little damping (N s/m) couples them.

Ranges were set by hand for a device of the size of the omega.3. Strengths 0 and 1 are the ends of the main parameter's
range (`EffectContext.interpolate_log`); other parameters are drawn independently of the strength.
"""

from dataclasses import replace

import numpy as np

from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext, Values, replace_handle_forces
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.handle_force_kernel import QUADRATIC_DAMPING


def _add_to_handle(device: Device, axis: int, mass_kg: float, damping_n_s_per_m: float) -> Device:
    """Add a mass (kg) and a viscous damping (N s/m) to one axis of the handle; returns a new device."""
    mass, damping_matrix = device.bench.mass.copy(), device.bench.damping.copy()
    mass[axis, axis] += mass_kg
    damping_matrix[axis, axis] += damping_n_s_per_m
    return replace(device, bench=replace(device.bench, mass=mass, damping=damping_matrix))


def _draw_pose_dependent_inertia(context: EffectContext) -> dict[str, float]:
    """Draw per_m (1/m), by which the mass changes by 1 to 50 % over the largest distance from the centre, and
    whole_handle (1: whole handle, 0: this axis only)."""
    whole_handle = float(context.random.integers(2))
    return {
        "per_m": context.draw_sign() * context.interpolate_log(0.01, 0.5) / context.travel_m[context.axis],
        "whole_handle": whole_handle,
    }


def _build_pose_dependent_inertia(device: Device, axis: int, values: Values) -> Device:
    """Add the change of the inertia of the whole handle, or of the mass of one axis."""
    change_per_m = np.zeros(3)
    change_per_m[axis] = values["per_m"]
    if values["whole_handle"]:
        return replace(device, inertia_per_m=device.inertia_per_m + change_per_m)
    return replace(device, axis_mass_per_m=device.axis_mass_per_m + change_per_m * device.bench.mass[axis, axis])


def _draw_extra_mode(context: EffectContext) -> dict[str, float]:
    """Draw the oscillator: frequency (Hz), mass (kg), damping ratio. The tilts are components of its direction along
    the two other axes, in cyclic order."""
    tilts = context.random.uniform(-0.25, 0.25, 2)
    return {
        "frequency": context.draw_log_uniform(18.0, 190.0),
        "mass": context.interpolate_log(0.0005, 0.025),
        "damping_ratio": context.draw_log_uniform(0.02, 0.06),
        "tilt_next": float(tilts[0]),
        "tilt_after_next": float(tilts[1]),
    }


def _build_extra_mode(device: Device, axis: int, values: Values) -> Device:
    """Attach the oscillator to the handle; with a mass of 0 the device is unchanged."""
    direction = np.roll((1.0, values["tilt_next"], values["tilt_after_next"]), axis)
    direction /= np.linalg.norm(direction)
    if values["mass"] == 0.0:
        return device
    oscillators = device.bench.oscillators.append_oscillator(
        values["frequency"], values["mass"], values["damping_ratio"], direction
    )
    return replace(device, bench=replace(device.bench, oscillators=oscillators))


def _draw_backlash(context: EffectContext) -> dict[str, float]:
    """Draw the gap, the motor mass m, 20 to 40 % of the axis's mass, the contact stiffness m (2 pi f)² with f from 220
    to 400 Hz, and the contact damping 2 zeta sqrt(stiffness m) with zeta from 0.015 to 0.06."""
    motor_mass_kg = context.bench.mass[context.axis, context.axis] * context.random.uniform(0.2, 0.4)
    contact_stiffness = motor_mass_kg * (2 * np.pi * context.draw_log_uniform(220.0, 400.0)) ** 2
    return {
        "gap": context.interpolate_log(3e-6, 1.5e-4),
        "motor_mass": float(motor_mass_kg),
        "contact_stiffness": float(contact_stiffness),
        "contact_damping": float(
            2 * context.draw_log_uniform(0.015, 0.06) * np.sqrt(contact_stiffness * motor_mass_kg)
        ),
    }


def _build_backlash(device: Device, axis: int, values: Values) -> Device:
    """Set the play of the device, replacing an earlier one."""
    parameter_names = ("motor_mass", "gap", "contact_stiffness", "contact_damping")
    return replace(device, play=np.array([axis, *(values[name] for name in parameter_names)]))


EFFECTS = (
    ConcealedEffect(
        "viscous_damping", "mechanism", True,
        lambda context: {"damping": context.interpolate_log(0.2, 6.0)},
        lambda device, axis, values: _add_to_handle(device, axis, 0.0, values["damping"]),
    ),
    ConcealedEffect(
        "added_mass", "mechanism", True,
        lambda context: {"mass": context.interpolate_log(0.003, 0.08)},
        lambda device, axis, values: _add_to_handle(device, axis, values["mass"], 0.0),
    ),
    ConcealedEffect(
        "quadratic_damping", "mechanism", True,
        lambda context: {"coefficient": context.interpolate_log(1.0, 60.0)},
        lambda device, axis, values: replace_handle_forces(device, axis, {QUADRATIC_DAMPING: values["coefficient"]}),
    ),
    ConcealedEffect(
        "pose_dependent_inertia", "mechanism", True, _draw_pose_dependent_inertia, _build_pose_dependent_inertia
    ),
    ConcealedEffect("extra_mode", "mechanism", True, _draw_extra_mode, _build_extra_mode),
    ConcealedEffect("backlash", "mechanism", True, _draw_backlash, _build_backlash),
)  # fmt: skip
