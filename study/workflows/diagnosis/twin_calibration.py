"""Change of a device's inertia with the position of the handle, added to its identified mechanical model.

The model of `hapteq twin` is identified at the centre, where its masses are known from recordings. The calibration of
the linkage gives the inertia matrix M(x) (kg) at the handle, from which the slope dM_aa/dx_a (kg/m) along each axis a
follows.
"""

import numpy as np

from equalizer.linkage.calibration import LinkageCalibration, estimate_local_inertia
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.signals.signal import FloatArray
from study.errors import StudyError

MIN_SLOPE_PER_M = 0.05
"""Largest relative slope of inertia that is neglected (1/m): over the 20 mm within which the virtual spring keeps the
handle, it changes the mass by 0.1 %, less than a recording can resolve. Chosen by hand."""


def check_same_device(calibration: LinkageCalibration, device: str, title: str) -> None:
    """Raise StudyError where the calibration is that of another device than `device`, the name of the recorded one.
    title: title of the error message."""
    if calibration.device != device:
        raise StudyError(
            title,
            f"The calibration is of the {calibration.device}; this is the {device}.",
            "Give the calibration of this device (`hapteq calibrate`), or none.",
            saved="Nothing was written.",
        )


def make_inertia_effects(model: MechanicalModel, calibration: LinkageCalibration) -> tuple[ModelEffect, ...]:
    """Make the change of inertia along each axis at the centre, as effects `pose_dependent_inertia` with the parameter
    per_m = (dM_aa/dx_a) / (a' M a) in 1/m for the driven axis a; none where its magnitude is at most `MIN_SLOPE_PER_M`.

    a' M a is the mass at the actuator's end of the transmission alone; per_m is therefore larger than the slope
    relative to the total mass.
    """
    inertia_slopes, axes = estimate_local_inertia(calibration, np.zeros(3))[1], compute_driven_axes(model)
    driven_masses_kg = np.einsum("na,nm,ma->a", axes, model.mass, axes)
    slopes_per_m = _extract_diagonal_slopes(inertia_slopes) / driven_masses_kg
    return tuple(
        ModelEffect("pose_dependent_inertia", axis_name, {"per_m": float(slope_per_m)})
        for axis_name, slope_per_m in zip("xyz", slopes_per_m, strict=True)
        if abs(slope_per_m) > MIN_SLOPE_PER_M
    )


def describe_calibration(
    model: MechanicalModel, recorded_kg: FloatArray, calibration: LinkageCalibration
) -> tuple[str, ...]:
    """Describe the calibration: the masses of the calibration compared with those of the recordings, the change of
    inertia that the model contains, and what it leaves out. recorded_kg: (3,), masses along x, y, z from the
    recordings."""
    inertia_kg, inertia_slopes = estimate_local_inertia(calibration, np.zeros(3))
    calibrated_kg = np.diag(inertia_kg)
    largest_relative_difference = float(np.abs(recorded_kg / calibrated_kg - 1).max())
    changing_axes = {effect.axis for effect in model.effects}
    slope_text = ", ".join(
        f"{slope:.3g} kg/m along {axis_name}"
        for axis_name, slope in zip("xyz", _extract_diagonal_slopes(inertia_slopes), strict=True)
        if axis_name in changing_axes
    )
    return (
        f"Masses along x, y, z: by the calibration of the {calibration.device}, "
        f"{', '.join(f'{mass_kg:.3g}' for mass_kg in calibrated_kg)} kg at the centre; by the recordings, "
        f"{', '.join(f'{mass_kg:.3g}' for mass_kg in recorded_kg)} kg, up to {largest_relative_difference:.0%} apart. "
        "The model has the masses of the recordings, which include all parts that move with the handle.",
        "Its change of inertia with the position along each axis (pose_dependent_inertia) is that of the calibration: "
        f"{slope_text or 'none'}. A change with the position across an axis is not in the model.",
    )


def _extract_diagonal_slopes(inertia_slopes: FloatArray) -> FloatArray:
    """Extract dM_aa/dx_a, (3,), kg/m: the derivative of the inertia along each axis a with the position along the same
    axis. inertia_slopes: (3, 3, 3), entry [a] is dM/dx_a, the derivative of the inertia matrix."""
    return np.array([inertia_slopes[axis, axis, axis] for axis in range(3)])
