"""Adds the calibration of a device's linkage to its identified model: the change of inertia along each axis.

The model is identified at the centre, where its masses are known from recordings. The calibration gives the inertia
M(x) at the handle, from which the slope dM_aa/dx_a (kg/m) along each axis a follows.
"""

import numpy as np

from equalizer.linkage.calibration import LinkageCalibration, inertia_about
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.signals.signal import FloatArray
from study.errors import StudyError

LEAST_PER_M = 0.05
"""Smallest relative slope of inertia that is added (1/m): over the 20 mm within which the spring keeps the handle, it
changes the mass by 0.1 %, which no recording shows."""


def check_same_device(calibration: LinkageCalibration, device: str, title: str) -> None:
    """Raise StudyError where the calibration is of another device than `device`, the recorded one. title: of the
    message."""
    if calibration.device != device:
        raise StudyError(
            title,
            f"The calibration is of the {calibration.device}; this is the {device}.",
            "Give the calibration of this device (`hapteq calibrate`), or none.",
            saved="Nothing was written.",
        )


def inertia_effects(model: MechanicalModel, calibration: LinkageCalibration) -> tuple[ModelEffect, ...]:
    """Change of inertia along each axis at the centre as effects `pose_dependent_inertia`, with the parameter per_m =
    (dM_aa/dx_a) / (a' M a) in 1/m for the driven axis a; none for an axis with a smaller slope than `LEAST_PER_M`.

    a' M a is the mass on the drive's side of the cables alone, so per_m is larger than relative to the whole mass.
    """
    slopes, axes = inertia_about(calibration, np.zeros(3))[1], driven_axes(model)
    driven_kg = np.einsum("na,nm,ma->a", axes, model.mass, axes)
    per_m = _diagonal_slopes(slopes) / driven_kg
    return tuple(
        ModelEffect("pose_dependent_inertia", letter, {"per_m": float(slope_per_m)})
        for letter, slope_per_m in zip("xyz", per_m, strict=True)
        if abs(slope_per_m) > LEAST_PER_M
    )


def calibration_notes(
    model: MechanicalModel, identified_kg: FloatArray, calibration: LinkageCalibration
) -> tuple[str, ...]:
    """Sentences that compare the masses of the calibration with those of the recordings, and state the change of
    inertia. identified_kg: (3,), masses along x, y, z from the recordings."""
    inertia, slopes = inertia_about(calibration, np.zeros(3))
    masses_kg = np.diag(inertia)
    largest_difference = float(np.abs(identified_kg / masses_kg - 1).max())
    changing_axes = {effect.axis for effect in model.effects}
    changing = ", ".join(
        f"{slope:.3g} kg/m along {letter}"
        for letter, slope in zip("xyz", _diagonal_slopes(slopes), strict=True)
        if letter in changing_axes
    )
    return (
        f"The calibration of the {calibration.device} says {', '.join(f'{mass_kg:.3g}' for mass_kg in masses_kg)} kg "
        f"at the centre; the recordings say {', '.join(f'{mass_kg:.3g}' for mass_kg in identified_kg)} kg, up to "
        f"{largest_difference:.0%} apart. "
        "The model has those of the recordings, with all that moves at the handle.",
        f"How its inertia changes is the calibration's, as pose_dependent_inertia: {changing or 'nowhere'}. What "
        "changes with the position across an axis is not in the model.",
    )


def _diagonal_slopes(slopes: FloatArray) -> FloatArray:
    """(3,), kg/m: derivative of the inertia along each axis with the position along the same axis. slopes: (3, 3, 3),
    entry [a] is the derivative of the inertia matrix along axis a."""
    return np.array([slopes[axis, axis, axis] for axis in range(3)])
