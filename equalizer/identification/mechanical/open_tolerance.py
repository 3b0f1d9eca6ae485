"""How far a model may be re-tuned that was fitted to the very recordings in which physics is sought."""

from dataclasses import replace

import numpy as np

from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance

MASS, DAMPING, STIFFNESS, MODES = 0.1, 0.5, 0.2, 0.03
"""Of the largest at any driven axis; of a mode's frequency and mass. Friction reads as damping above all, a hardening
spring as stiffness, a lag as mass."""


def opened(model: MechanicalModel) -> MechanicalModel:
    """With a tolerance that is wider than the fit's own: that one is of its misfit, and does not know that a linear
    model takes on itself what missing physics does."""
    along = driven_axes(model)
    mass, damping, stiffness = (
        float(np.einsum("ni,nk,ki->i", along, part, along).max())
        for part in (model.mass, model.damping, model.stiffness)
    )
    own = model.tolerance or Tolerance()
    tolerance = Tolerance(
        mass_kg=max(MASS * mass, own.mass_kg or 0.0),
        damping_n_s_per_m=max(DAMPING * damping, own.damping_n_s_per_m or 0.0),
        stiffness_n_per_m=max(STIFFNESS * stiffness, own.stiffness_n_per_m or 0.0),
        modes=max(MODES, own.modes or 0.0),
    )
    return replace(model, tolerance=tolerance)
