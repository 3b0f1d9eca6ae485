"""A fitted structure as a mechanical model for others to read, with oscillators in their own right and tolerances."""

from dataclasses import replace

import numpy as np

from equalizer.identification.mechanical_refinement import Refined
from equalizer.identification.mechanical_structure import diagonal_places
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance
from equalizer.signals.signal import FloatArray

LEAST_TOLERANCE = 0.01
"""Of the value: no calibration is better than its force sensor or current loop."""


def readable_model(fit: Refined, name: str) -> MechanicalModel:
    """With a tolerance; absolute coordinates for the oscillators, so that their masses stand on the diagonal."""
    model = _absolute(fit.structure.model(fit.unknowns, name), fit.structure.inputs)
    return replace(model, tolerance=tolerance_of(fit, model))


def tolerance_of(fit: Refined, model: MechanicalModel) -> Tolerance:
    """One standard deviation by the misfit's own size, the largest over the driven axes."""
    structure = fit.structure
    slope, m = fit.slope, structure.inputs
    rows = max(len(slope) - structure.parameters, 1)
    size = np.maximum(np.linalg.norm(slope, axis=0), 1e-300)
    spread = np.sqrt(np.diag(np.linalg.pinv((slope / size).T @ (slope / size)))) / size
    spread = spread * np.sqrt(max(fit.squares / rows, 1e-300))
    diagonal, units, part = diagonal_places(m), structure.units, structure.slices
    mass, damping, stiffness = (np.diag(matrix)[:m] for matrix in (model.mass, model.damping, model.stiffness))
    # The logarithm of the root is what is fitted: twice its spread is the mass's relative one.
    of_mass = float((2 * spread[part["mass"]][diagonal] * mass).max())
    of_damping = float((spread[part["damping"]][diagonal] * units[1]).max())
    of_stiffness = float((spread[part["stiffness"]][diagonal] * units[2]).max()) if structure.grounded else 0.0
    of_modes = None
    if structure.modes:
        each = spread[part["modes"]].reshape(structure.modes, -1)
        of_modes = max(float(np.median(each[:, 0])), LEAST_TOLERANCE)
    grounded = stiffness if structure.modes == 0 else _grounded(fit)
    return Tolerance(
        mass_kg=max(of_mass, LEAST_TOLERANCE * float(mass.max())),
        damping_n_s_per_m=max(of_damping, LEAST_TOLERANCE * float(damping.max())),
        stiffness_n_per_m=max(of_stiffness, LEAST_TOLERANCE * float(grounded.max(initial=0.0))),
        modes=of_modes,
    )


def _grounded(fit: Refined) -> FloatArray:
    return np.asarray(np.diag(fit.structure.model(fit.unknowns).stiffness)[: fit.structure.inputs])


def _absolute(model: MechanicalModel, m: int) -> MechanicalModel:
    """e = |L| (z - hᵀ x): z is where an oscillator of mass |L|² is, along its direction h."""
    n = model.coordinates
    participation = model.mass[m:, :m]
    roots = np.linalg.norm(participation, axis=1)
    if not n - m or roots.min() < 1e-6 * np.sqrt(model.mass[:m, :m].max()):
        return model
    change = np.eye(n)
    change[m:, m:], change[m:, :m] = np.diag(roots), -participation
    mass, damping, stiffness = (change.T @ part @ change for part in (model.mass, model.damping, model.stiffness))
    # What the change makes zero is zero but for rounding.
    mass[m:, :m] = mass[:m, m:] = 0.0
    return replace(model, mass=(mass + mass.T) / 2, damping=damping, stiffness=stiffness, output=model.output @ change)
