"""Conversion of a fitted structure to a mechanical model in absolute coordinates, with tolerances."""

from dataclasses import replace

import numpy as np

from equalizer.identification.mechanical.mechanical_misfit import numerical_jacobian
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_structure import ModalStructure, to_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance
from equalizer.signals.signal import FloatArray

LEAST_TOLERANCE = 0.01
"""Smallest relative tolerance: no calibration is better than its force sensor or current loop."""


AnyFit = RefinedFit[Structure] | RefinedFit[ModalStructure]


def readable_model(fit: AnyFit, name: str) -> MechanicalModel:
    """Mechanical model of a fit with its tolerance, in absolute coordinates: oscillators' masses are diagonal."""
    model = fit.structure.model(fit.unknowns, name)
    if isinstance(fit.structure, ModalStructure):
        model = to_driven_axes(model)
    else:
        model = _to_absolute_coordinates(model, fit.structure.inputs, fit.structure.joint)
    return replace(model, tolerance=tolerance_of(fit))


def tolerance_of(fit: AnyFit) -> Tolerance:
    """Standard deviations from the size of the residuals, the largest over the driven axes. For modes with free shapes
    only those of the frequencies: without a sensor at a command, the data do not determine how strongly it drives
    them."""
    if isinstance(fit.structure, ModalStructure):
        structure = fit.structure
        logs = np.sqrt(np.diag(_covariance(fit))).reshape(structure.modes, -1)[:, 0]
        return Tolerance(modes=max(float(np.median(logs)), LEAST_TOLERANCE))
    return _oscillator_tolerance(fit.structure, fit)


def _oscillator_tolerance(structure: Structure, fit: AnyFit) -> Tolerance:
    here = _axis_values(structure, fit.unknowns)
    slope = numerical_jacobian(
        lambda unknowns: _axis_values(structure, unknowns), fit.unknowns, here, np.full(structure.parameters, np.inf)
    )
    covariance = _covariance(fit)
    spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slope, covariance, slope), 0.0))
    spread, values = spread.reshape(3, -1).max(axis=1), here.reshape(3, -1).max(axis=1)
    mass, damping, stiffness = np.maximum(spread, LEAST_TOLERANCE * values).tolist()
    of_modes = None
    if structure.modes:
        each = np.sqrt(np.diag(covariance)[structure.slices["modes"]]).reshape(structure.modes, -1)
        of_modes = max(float(np.median(each[:, 0])), LEAST_TOLERANCE)
    return Tolerance(mass, damping, stiffness, of_modes)


def _axis_values(structure: Structure, unknowns: FloatArray) -> FloatArray:
    """(3 m,): masses, damping and stiffness to the ground at each driven axis."""
    return np.concatenate([np.diag(part) for part in structure.find_grounded_parts(unknowns)])


def _covariance(fit: AnyFit) -> FloatArray:
    slope = fit.slope
    size = np.maximum(np.linalg.norm(slope, axis=0), 1e-300)
    inverse = np.linalg.pinv((slope / size).T @ (slope / size), rcond=1e-10)
    left = fit.squares / max(len(slope) - slope.shape[1], 1)
    return np.asarray(left * inverse / np.outer(size, size))


def _to_absolute_coordinates(model: MechanicalModel, m: int, joint: bool) -> MechanicalModel:
    """e = |L| (z - hᵀ x): z is the position of an oscillator of mass |L|² along its direction h."""
    n, carrier, rest = model.coordinates, slice(m, 2 * m) if joint else slice(0, m), slice(2 * m if joint else m, None)
    participation = model.mass[rest, carrier]
    roots = np.linalg.norm(participation, axis=1)
    if not len(roots) or roots.min() < 1e-6 * np.sqrt(model.mass[carrier, carrier].max()):
        return model
    change = np.eye(n)
    change[rest, rest], change[rest, carrier] = np.diag(roots), -participation
    mass, damping, stiffness = (change.T @ part @ change for part in (model.mass, model.damping, model.stiffness))
    # Entries that the transformation makes zero are set to zero exactly.
    mass[rest, carrier] = mass[carrier, rest] = 0.0
    return replace(model, mass=(mass + mass.T) / 2, damping=damping, stiffness=stiffness, output=model.output @ change)
