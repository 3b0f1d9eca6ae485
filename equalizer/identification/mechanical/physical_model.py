"""Conversion of a fitted structure to a mechanical model with tolerances, in coordinates that have a physical meaning.

Oscillators are fitted in coordinates relative to the driven axes, and modes in modal coordinates; the model has
absolute coordinates instead, in which an oscillator is a mass at the end of a spring. Tolerances are standard
deviations from the covariance of the least-squares fit, s² (J'J)^-1, with J the Jacobian and s² the residual variance.
"""

from dataclasses import replace

import numpy as np

from equalizer.identification.mechanical.mechanical_misfit import numerical_jacobian
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_structure import ModalStructure, to_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance
from equalizer.signals.signal import FloatArray

LEAST_TOLERANCE = 0.01
"""Smallest relative standard deviation: a calibration is not more exact than its force sensor or current loop."""


AnyFit = RefinedFit[Structure] | RefinedFit[ModalStructure]
"""A fit with either parametrisation: oscillators on the driven axes, or modes with free shapes."""


def readable_model(fit: AnyFit, name: str) -> MechanicalModel:
    """Mechanical model of a fit with its tolerance, in absolute coordinates, in which oscillators have no inertial
    coupling with the driven axes; a fit with modes is converted by `to_driven_axes`. Raises numpy.linalg.LinAlgError
    where such modes do not move every driven axis independently."""
    model = fit.structure.model(fit.unknowns, name)
    if isinstance(fit.structure, ModalStructure):
        model = to_driven_axes(model)
    else:
        model = _to_absolute_coordinates(model, fit.structure.inputs, fit.structure.joint)
    return replace(model, tolerance=tolerance_of(fit))


def tolerance_of(fit: AnyFit) -> Tolerance:
    """Standard deviations of mass, damping and stiffness, the largest over the driven axes, and the median one of the
    modal frequencies (relative), none below `LEAST_TOLERANCE`. For modes with free shapes that of the frequencies only:
    without a sensor at a command, the data do not determine the mass there."""
    if isinstance(fit.structure, ModalStructure):
        structure = fit.structure
        logs = np.sqrt(np.diag(_covariance(fit))).reshape(structure.modes, -1)[:, 0]
        return Tolerance(modes=max(float(np.median(logs)), LEAST_TOLERANCE))
    return _oscillator_tolerance(fit.structure, fit)


def _oscillator_tolerance(structure: Structure, fit: AnyFit) -> Tolerance:
    """Tolerance of a structure of oscillators: the covariance of the unknowns, propagated to the values at the axes by
    their Jacobian. The unknowns of the modes are log frequencies: their deviations are relative."""
    axis_values = _axis_values(structure, fit.unknowns)
    slope = numerical_jacobian(
        lambda unknowns: _axis_values(structure, unknowns),
        fit.unknowns,
        axis_values,
        np.full(structure.parameters, np.inf),
    )
    covariance = _covariance(fit)
    spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slope, covariance, slope), 0.0))
    spread, values = spread.reshape(3, -1).max(axis=1), axis_values.reshape(3, -1).max(axis=1)
    mass, damping, stiffness = np.maximum(spread, LEAST_TOLERANCE * values).tolist()
    mode_tolerance = None
    if structure.modes:
        deviations = np.sqrt(np.diag(covariance)[structure.slices["modes"]]).reshape(structure.modes, -1)
        mode_tolerance = max(float(np.median(deviations[:, 0])), LEAST_TOLERANCE)
    return Tolerance(mass, damping, stiffness, mode_tolerance)


def _axis_values(structure: Structure, unknowns: FloatArray) -> FloatArray:
    """(3 m,): mass, then damping to the ground, then stiffness to the ground, each at all m driven axes."""
    return np.concatenate([np.diag(part) for part in structure.find_grounded_parts(unknowns)])


def _covariance(fit: AnyFit) -> FloatArray:
    """Covariance of the unknowns (parameters, parameters). Columns of the Jacobian are scaled to length 1; directions
    that the data do not determine are left out by the pseudo-inverse."""
    slope = fit.slope
    size = np.maximum(np.linalg.norm(slope, axis=0), 1e-300)
    inverse = np.linalg.pinv((slope / size).T @ (slope / size), rcond=1e-10)
    residual_variance = fit.squares / max(len(slope) - slope.shape[1], 1)
    return np.asarray(residual_variance * inverse / np.outer(size, size))


def _to_absolute_coordinates(model: MechanicalModel, m: int, joint: bool) -> MechanicalModel:
    """The model with absolute positions z of the oscillators in place of their relative modal coordinates
    e = |L| (z - hᵀ x), where L is the participation, h = L / |L| the direction, and |L|² the mass of an oscillator.
    Unchanged where a participation is too small to divide by. m: number of driven axes."""
    n, carrier, oscillators = (
        model.coordinates,
        slice(m, 2 * m) if joint else slice(0, m),
        slice(2 * m if joint else m, None),
    )
    participation = model.mass[oscillators, carrier]
    roots = np.linalg.norm(participation, axis=1)
    if not len(roots) or roots.min() < 1e-6 * np.sqrt(model.mass[carrier, carrier].max()):
        return model
    change = np.eye(n)
    change[oscillators, oscillators], change[oscillators, carrier] = np.diag(roots), -participation
    mass, damping, stiffness = (change.T @ part @ change for part in (model.mass, model.damping, model.stiffness))
    # The transformation makes these entries zero up to rounding.
    mass[oscillators, carrier] = mass[carrier, oscillators] = 0.0
    return replace(model, mass=(mass + mass.T) / 2, damping=damping, stiffness=stiffness, output=model.output @ change)
