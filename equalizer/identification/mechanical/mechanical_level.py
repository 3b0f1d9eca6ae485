"""Friction's share in the damping of a linear fit, from recordings at two levels: it falls as the force grows."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFit, MechanicalFitSettings
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

RIGID_OCTAVES = 3.0
"""Width in octaves of the lowest part of the band, in which the device moves as a rigid body and friction matters
most."""
LEAST_MASS, LEAST_DAMPING = 0.02, 0.05
"""Smallest relative tolerances: how well a laboratory knows mass and damping."""
OF_FRICTION = 0.2
"""Relative tolerance of the damping that was subtracted for friction."""
MOST_OFF = 0.8
"""Largest share of the fitted damping that is subtracted."""
SPRING = 0.03
"""Largest undetected stiffness, relative to the inertial force at the band's lower end."""


@dataclass(frozen=True, slots=True, eq=False)
class RigidBody:
    """The device in the band where it moves as a rigid body, at the stronger level."""

    up_to_hz: float
    mass: FloatArray
    """(m,), at each driven axis"""
    damping: FloatArray
    """(m,), the equivalent damping of friction contained in it."""
    of_friction: FloatArray
    """(m,), the equivalent damping of friction: at forces far above friction the damping is lower by it."""
    tolerance: Tolerance
    """Tolerance of the whole model without the equivalent damping."""


def fit_rigid_body(
    fit: MechanicalFit, strong: Recording, weaker: Recording, settings: MechanicalFitSettings
) -> RigidBody:
    """Rigid fits at two levels. The equivalent damping of friction is proportional to 1 / amplitude (describing
    function): strong = true + c, weaker = true + c ratio."""
    low, high = fit.band_hz
    up_to_hz = min(high, low * 2**RIGID_OCTAVES)
    rigid = replace(
        settings, band_hz=(low, up_to_hz), most_modes=0, joint=False, fit_delay=False, sensors_elsewhere=False
    )
    ratio = _amplitude(strong) / _amplitude(weaker)
    mine, other = (_axis_values(fit_mechanical_model([each], rigid).model) for each in (strong, weaker))
    mass, damping, _ = mine
    of_friction = np.clip((other[1] - damping) / max(ratio - 1, 1e-3), 0.0, MOST_OFF * damping)
    own = fit.model.tolerance or Tolerance()
    heaviest = float(mass.max())
    tolerance = Tolerance(
        mass_kg=max(LEAST_MASS * heaviest, own.mass_kg or 0.0),
        damping_n_s_per_m=max(
            OF_FRICTION * float(of_friction.max()), LEAST_DAMPING * float(damping.max()), own.damping_n_s_per_m or 0.0
        ),
        stiffness_n_per_m=max(SPRING * heaviest * (2 * np.pi * low) ** 2, own.stiffness_n_per_m or 0.0),
        modes=own.modes,
    )
    return RigidBody(up_to_hz, mass, damping, of_friction, tolerance)


def remove_friction_damping(model: MechanicalModel, of_friction: FloatArray) -> MechanicalModel:
    """The model without friction's equivalent damping of_friction (m,), at the driven axes."""
    along = driven_axes(model)
    return replace(model, damping=model.damping - (along * of_friction) @ along.T)


def _axis_values(model: MechanicalModel) -> FloatArray:
    """(3, m): mass, damping and stiffness at each driven axis."""
    parts: Sequence[FloatArray] = (model.mass, model.damping, model.stiffness)
    return np.array([np.diag(part)[: model.inputs] for part in parts])


def _amplitude(recording: Recording) -> float:
    return max(segment.amplitude for segment in recording.segments)
