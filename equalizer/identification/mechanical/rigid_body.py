"""Fit of the device as a rigid body at two levels, and the equivalent viscous damping of its friction.

A linear fit attributes dry friction to viscous damping. By the describing function, Coulomb friction of magnitude F (N)
under a sinusoidal motion of amplitude X (m) and angular frequency w (rad/s) has the equivalent viscous damping

    c = 4 F / (pi w X)

so c falls as 1 / X, and far above friction X grows in proportion to the command. With the damping d1 fitted at the
stronger level and d2 at the weaker, and r > 1 the ratio of the commands, the damping without friction is d1 - c with

    c = (d2 - d1) / (r - 1)

Reference: Gelb and Vander Velde, Multiple-Input Describing Functions and Nonlinear System Design (1968), chapter 2.
Called by `study.workflows.diagnosis.write_twin`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.mechanical_fit_result import (
    MechanicalFit,
    MechanicalFitError,
    MechanicalFitSettings,
)
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

RIGID_OCTAVES = 3.0
"""Width in octaves of the lowest part of the band, in which the device moves as a rigid body and friction matters
most. Chosen by hand."""
LEAST_MASS_TOLERANCE, LEAST_DAMPING_TOLERANCE = 0.02, 0.05
"""Smallest tolerances of mass and damping, relative to the largest value of all axes. Chosen by hand: about the
accuracy of a laboratory's measurement of them."""
FRICTION_TOLERANCE = 0.2
"""Tolerance of the subtracted equivalent damping, relative to it: real friction is not exactly Coulomb friction. Chosen
by hand."""
LARGEST_REMOVED_SHARE = 0.8
"""Largest share of the fitted damping that is subtracted, so that a damping above zero remains. Chosen by hand."""
LEAST_STIFFNESS_TOLERANCE = 0.03
"""Smallest tolerance of the stiffness, relative to the inertial force per displacement, m (2 pi f)², at the lower end f
of the band: a weaker spring does not show in the fit. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class RigidBody:
    """The device in the band where it moves as a rigid body, at the stronger level. Arrays are (m,): driven axes."""

    up_to_hz: float
    """Upper end of that band."""
    mass: FloatArray
    """kg"""
    damping: FloatArray
    """N s/m, as fitted: it contains the equivalent damping of friction."""
    friction_damping: FloatArray
    """N s/m, equivalent damping c of friction at the stronger level, to be subtracted from `damping`."""
    tolerance: Tolerance
    """Tolerance of the whole model without the equivalent damping."""


def fit_rigid_body(
    fit: MechanicalFit, stronger_recording: Recording, weaker_recording: Recording, settings: MechanicalFitSettings
) -> RigidBody:
    """Fit a rigid body to two recordings of the same device, at a stronger and a weaker level of the excitation, and
    compute the equivalent damping of friction from their difference (limited to 0 to `LARGEST_REMOVED_SHARE` of the
    damping; r - 1 counts as at least 0.001). fit: that of the whole band, whose tolerances are kept where they are
    wider. settings: of `fit`. Raises MechanicalFitError where a recording does not determine a rigid body, or states no
    amplitude."""
    low_hz, high_hz = fit.band_hz
    up_to_hz = min(high_hz, low_hz * 2**RIGID_OCTAVES)
    rigid_settings = replace(
        settings, band_hz=(low_hz, up_to_hz), most_modes=0, joint=False, fit_delay=False, noncollocated_sensors=False
    )
    level_ratio = _find_largest_amplitude(stronger_recording) / _find_largest_amplitude(weaker_recording)
    stronger_values, weaker_values = (
        _extract_axis_parameters(fit_mechanical_model([recording], rigid_settings).model)
        for recording in (stronger_recording, weaker_recording)
    )
    mass, damping, _ = stronger_values
    friction_damping = np.clip(
        (weaker_values[1] - damping) / max(level_ratio - 1, 1e-3), 0.0, LARGEST_REMOVED_SHARE * damping
    )
    fitted_tolerance = fit.model.tolerance or Tolerance()
    largest_mass = float(mass.max())
    tolerance = Tolerance(
        mass_kg=max(LEAST_MASS_TOLERANCE * largest_mass, fitted_tolerance.mass_kg or 0.0),
        damping_n_s_per_m=max(
            FRICTION_TOLERANCE * float(friction_damping.max()),
            LEAST_DAMPING_TOLERANCE * float(damping.max()),
            fitted_tolerance.damping_n_s_per_m or 0.0,
        ),
        stiffness_n_per_m=max(
            LEAST_STIFFNESS_TOLERANCE * largest_mass * (2 * np.pi * low_hz) ** 2,
            fitted_tolerance.stiffness_n_per_m or 0.0,
        ),
        modes=fitted_tolerance.modes,
    )
    return RigidBody(up_to_hz, mass, damping, friction_damping, tolerance)


def remove_friction_damping(model: MechanicalModel, friction_damping: FloatArray) -> MechanicalModel:
    """Subtract friction's equivalent damping from the model. friction_damping: (m,), N s/m at each driven axis."""
    driven_axes = compute_driven_axes(model)
    return replace(model, damping=model.damping - (driven_axes * friction_damping) @ driven_axes.T)


def _extract_axis_parameters(model: MechanicalModel) -> FloatArray:
    """Extract mass, damping and stiffness (3, m) at each driven axis, which are the first m coordinates of a fitted
    model."""
    matrices: Sequence[FloatArray] = (model.mass, model.damping, model.stiffness)
    return np.array([np.diag(matrix)[: model.inputs] for matrix in matrices])


def _find_largest_amplitude(recording: Recording) -> float:
    """Find the largest amplitude of a recording's segments, in the command's unit. Raises MechanicalFitError where none
    is above 0."""
    largest_amplitude = max((segment.amplitude for segment in recording.segments), default=0.0)
    if largest_amplitude <= 0:
        raise MechanicalFitError("no segment of a recording states an amplitude above 0; state those of both levels")
    return largest_amplitude
