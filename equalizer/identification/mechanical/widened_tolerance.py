"""Widened tolerance of a model that was fitted to the same recordings in which missing physics is searched for.

A linear fit absorbs part of the missing physics: friction mainly as damping, a hardening spring as stiffness, a lag as
mass. The standard deviations of its parameters, which follow from the residuals, do not include that error; a diagnosis
therefore re-tunes the parameters within wider tolerances. Called by `analysis.diagnosis.first_model`.
"""

from dataclasses import replace

import numpy as np

from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance

MIN_MASS_SHARE, MIN_DAMPING_SHARE, MIN_STIFFNESS_SHARE, MIN_MODE_SHARE = 0.1, 0.5, 0.2, 0.03
"""Smallest tolerances (one standard deviation): of mass, damping and stiffness relative to the largest at any driven
axis, and of the modes' frequencies and masses, relative. Chosen."""


def widen_tolerance(model: MechanicalModel) -> MechanicalModel:
    """Widen the tolerance of a model to at least the shares above of its largest mass, damping and stiffness at any
    driven axis, and of its modes. A missing tolerance counts as 0."""
    axes = compute_driven_axes(model)
    mass, damping, stiffness = (
        float(np.einsum("ni,nk,ki->i", axes, matrix, axes).max())
        for matrix in (model.mass, model.damping, model.stiffness)
    )
    model_tolerance = model.tolerance or Tolerance()
    tolerance = Tolerance(
        mass_kg=max(MIN_MASS_SHARE * mass, model_tolerance.mass_kg or 0.0),
        damping_n_s_per_m=max(MIN_DAMPING_SHARE * damping, model_tolerance.damping_n_s_per_m or 0.0),
        stiffness_n_per_m=max(MIN_STIFFNESS_SHARE * stiffness, model_tolerance.stiffness_n_per_m or 0.0),
        modes=max(MIN_MODE_SHARE, model_tolerance.modes or 0.0),
    )
    return replace(model, tolerance=tolerance)
