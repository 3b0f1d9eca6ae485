"""What a linear fit has taken from friction, told from two levels: a damper that shrinks as the force grows."""

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
"""Of the band from its beginning: there the device moves as one piece, and friction shows most."""
LEAST_MASS, LEAST_DAMPING = 0.02, 0.05
"""Of the value: as well as a laboratory knows it."""
OF_FRICTION = 0.2
"""Of what was taken off for friction, that may be wrong."""
MOST_OFF = 0.8
"""Of the damping that a fit has found."""
SPRING = 0.03
"""Of the inertia's force at the band's beginning, that a spring below it may hide behind."""


@dataclass(frozen=True, slots=True, eq=False)
class AsOnePiece:
    """The device where it moves as one piece, at the stronger level."""

    up_to_hz: float
    mass: FloatArray
    """(m,), at each driven axis"""
    damping: FloatArray
    """(m,), friction's equivalent in it"""
    of_friction: FloatArray
    """(m,): that equivalent; what the damping would fall by at forces far above friction."""
    tolerance: Tolerance
    """Of the whole model without it."""


def as_one_piece(
    fit: MechanicalFit, strong: Recording, weaker: Recording, settings: MechanicalFitSettings
) -> AsOnePiece:
    """From rigid fits at the two levels. Friction's equivalent is as 1 / amplitude: strong = true + c, weaker = true +
    c ratio."""
    low, high = fit.band_hz
    up_to_hz = min(high, low * 2**RIGID_OCTAVES)
    rigid = replace(
        settings, band_hz=(low, up_to_hz), most_modes=0, joint=False, fit_delay=False, sensors_elsewhere=False
    )
    ratio = _amplitude(strong) / _amplitude(weaker)
    mine, other = (_driven(fit_mechanical_model([each], rigid).model) for each in (strong, weaker))
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
    return AsOnePiece(up_to_hz, mass, damping, of_friction, tolerance)


def without_friction(model: MechanicalModel, of_friction: FloatArray) -> MechanicalModel:
    """of_friction: (m,), taken off the dampers to the ground at the driven axes."""
    along = driven_axes(model)
    return replace(model, damping=model.damping - (along * of_friction) @ along.T)


def _driven(model: MechanicalModel) -> FloatArray:
    """(3, m)"""
    parts: Sequence[FloatArray] = (model.mass, model.damping, model.stiffness)
    return np.array([np.diag(part)[: model.inputs] for part in parts])


def _amplitude(recording: Recording) -> float:
    return max(segment.amplitude for segment in recording.segments)
