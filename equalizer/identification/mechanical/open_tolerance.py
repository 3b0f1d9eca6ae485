"""Tolerance of a model that was fitted to the same recordings in which missing physics is searched for.

A linear fit absorbs part of the missing physics: friction mainly as damping, a hardening spring as stiffness, a lag as
mass. The standard deviations of its parameters, which follow from the residuals, do not include that error; a diagnosis
therefore re-tunes the parameters within wider tolerances.
"""

from dataclasses import replace

import numpy as np

from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance

MASS, DAMPING, STIFFNESS, MODES = 0.1, 0.5, 0.2, 0.03
"""Least tolerances (one standard deviation): of mass, damping and stiffness relative to the largest at any driven axis,
and of the modes' frequencies and masses, relative. Heuristic."""


def widen_tolerance(model: MechanicalModel) -> MechanicalModel:
    """The model with its own tolerance, widened to at least the constants above times its largest mass, damping and
    stiffness at any driven axis."""
    axes = compute_driven_axes(model)
    mass, damping, stiffness = (
        float(np.einsum("ni,nk,ki->i", axes, part, axes).max()) for part in (model.mass, model.damping, model.stiffness)
    )
    model_tolerance = model.tolerance or Tolerance()
    tolerance = Tolerance(
        mass_kg=max(MASS * mass, model_tolerance.mass_kg or 0.0),
        damping_n_s_per_m=max(DAMPING * damping, model_tolerance.damping_n_s_per_m or 0.0),
        stiffness_n_per_m=max(STIFFNESS * stiffness, model_tolerance.stiffness_n_per_m or 0.0),
        modes=max(MODES, model_tolerance.modes or 0.0),
    )
    return replace(model, tolerance=tolerance)
