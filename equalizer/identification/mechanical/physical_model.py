"""Conversion of a fitted structure to a mechanical model with tolerances, in coordinates that have a physical meaning.

Oscillators are fitted in coordinates relative to the driven axes, and modes in modal coordinates; the model has
absolute coordinates instead, in which an oscillator is a mass at the end of a spring. Tolerances are standard
deviations from the covariance of the least-squares fit, s² (J'J)^-1, with J the Jacobian and s² the residual variance.
Called by `mechanical_fit`.
"""

from dataclasses import replace

import numpy as np

from equalizer.identification.mechanical.mechanical_misfit import compute_numerical_jacobian
from equalizer.identification.mechanical.mechanical_refinement import RefinedFit
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_structure import ModalStructure, transform_to_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance
from equalizer.signals.signal import FloatArray

LEAST_RELATIVE_TOLERANCE = 0.01
"""Smallest relative standard deviation that is stated: the calibration of the force limits the accuracy to about 1 %.
Heuristic."""


AnyFit = RefinedFit[Structure] | RefinedFit[ModalStructure]
"""A fit with either parametrisation: oscillators on the driven axes, or modes with free shapes."""


def make_physical_model(fit: AnyFit, name: str) -> MechanicalModel:
    """Make the mechanical model of a fit with its tolerance, in absolute coordinates; a fit with modes is converted by
    `transform_to_driven_axes`. Raises numpy.linalg.LinAlgError where such modes do not move every driven axis
    independently."""
    model = fit.structure.build_model(fit.unknowns, name)
    if isinstance(fit.structure, ModalStructure):
        model = transform_to_driven_axes(model)
    else:
        model = _convert_to_absolute_coordinates(model, fit.structure.inputs, fit.structure.joint)
    return replace(model, tolerance=estimate_tolerance(fit))


def estimate_tolerance(fit: AnyFit) -> Tolerance:
    """Estimate the standard deviations of mass, damping and stiffness, the largest over the driven axes, and the median
    one of the modal frequencies (relative), none below `LEAST_RELATIVE_TOLERANCE`. For modes with free shapes that of
    the frequencies only: without a sensor at a command, the data do not determine the mass there."""
    if isinstance(fit.structure, ModalStructure):
        structure = fit.structure
        frequency_deviations = np.sqrt(np.diag(_compute_covariance(fit))).reshape(structure.modes, -1)[:, 0]
        return Tolerance(modes=max(float(np.median(frequency_deviations)), LEAST_RELATIVE_TOLERANCE))
    return _estimate_oscillator_tolerance(fit.structure, fit)


def _estimate_oscillator_tolerance(structure: Structure, fit: AnyFit) -> Tolerance:
    """Estimate the tolerance of a structure of oscillators: the covariance of the unknowns, propagated to the values at
    the axes by their Jacobian. The unknowns of the modes are log frequencies: their deviations are relative."""
    axis_values = _list_axis_values(structure, fit.unknowns)
    jacobian = compute_numerical_jacobian(
        lambda unknowns: _list_axis_values(structure, unknowns),
        fit.unknowns,
        axis_values,
        np.full(structure.parameters, np.inf),
    )
    covariance = _compute_covariance(fit)
    deviations = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", jacobian, covariance, jacobian), 0.0))
    deviations, largest_values = deviations.reshape(3, -1).max(axis=1), axis_values.reshape(3, -1).max(axis=1)
    mass, damping, stiffness = np.maximum(deviations, LEAST_RELATIVE_TOLERANCE * largest_values).tolist()
    mode_tolerance = None
    if structure.modes:
        mode_deviations = np.sqrt(np.diag(covariance)[structure.slices["modes"]]).reshape(structure.modes, -1)
        mode_tolerance = max(float(np.median(mode_deviations[:, 0])), LEAST_RELATIVE_TOLERANCE)
    return Tolerance(mass, damping, stiffness, mode_tolerance)


def _list_axis_values(structure: Structure, unknowns: FloatArray) -> FloatArray:
    """List the values (3 m,) at the m driven axes: masses, then dampings and stiffnesses to the ground."""
    return np.concatenate([np.diag(part) for part in structure.compute_axis_matrices(unknowns)])


def _compute_covariance(fit: AnyFit) -> FloatArray:
    """Compute the covariance of the unknowns (parameters, parameters). Columns of the Jacobian are scaled to length 1;
    the pseudo-inverse truncates directions that the data do not determine (singular values of J'J below 1e-10 of the
    largest), as of an unknown on which no line depends."""
    jacobian = fit.jacobian
    column_norms = np.linalg.norm(jacobian, axis=0)
    column_norms = np.where(column_norms > 0, column_norms, np.inf)
    inverse = np.linalg.pinv((jacobian / column_norms).T @ (jacobian / column_norms), rcond=1e-10)
    residual_variance = fit.squares / max(len(jacobian) - jacobian.shape[1], 1)
    return np.asarray(residual_variance * inverse / column_norms / column_norms[:, None])


def _convert_to_absolute_coordinates(model: MechanicalModel, m: int, joint: bool) -> MechanicalModel:
    """Convert to a model with absolute positions z of the oscillators in place of their relative modal coordinates
    e = |L| (z - hᵀ x), where L is the participation, h = L / |L| the direction, and |L|² the mass of an oscillator.
    Unchanged without oscillators, and where a participation is too small to divide by: |L| below 1e-6 of the root of
    the largest mass. m: number of driven axes. joint: whether the oscillators are on the axes beyond a joint."""
    n, carrier, oscillators = (
        model.coordinates,
        slice(m, 2 * m) if joint else slice(0, m),
        slice(2 * m if joint else m, None),
    )
    participation = model.mass[oscillators, carrier]
    root_masses = np.linalg.norm(participation, axis=1)
    if not len(root_masses) or root_masses.min() < 1e-6 * np.sqrt(model.mass[carrier, carrier].max()):
        return model
    transformation = np.eye(n)
    transformation[oscillators, oscillators], transformation[oscillators, carrier] = (
        np.diag(root_masses),
        -participation,
    )
    mass, damping, stiffness = (
        transformation.T @ matrix @ transformation for matrix in (model.mass, model.damping, model.stiffness)
    )
    # The transformation makes these entries zero up to rounding.
    mass[oscillators, carrier] = mass[carrier, oscillators] = 0.0
    return replace(
        model, mass=(mass + mass.T) / 2, damping=damping, stiffness=stiffness, output=model.output @ transformation
    )
