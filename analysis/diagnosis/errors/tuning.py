"""Re-tuning: the free parameters of a mechanical model, which may move from their calibrated values.

The parameters may move by a limited number of standard deviations of their calibration; only a mismatch that remains
then is attributed to missing physics. The model M q'' + B q' + K q = input is first written in the coordinates of Craig
and Bampton (AIAA Journal 6 (1968), 1313): the m driven axes, and the modes with these axes held (fixed-interface
modes), scaled to unit mass. Free are then

* each entry on or above the diagonal of the m x m blocks of mass, damping and stiffness at the driven axes (an absolute
  change);
* of each mode k its frequency f, mass and damping ratio (relative changes df, dm, dz):  K_kk (1 + df)², B_kk (1 + df)
  (1 + dz), the coupling c to the masses of the axes times sqrt(1 + dm), and dm c c' added to these masses.

`make_tuning` makes a `Tuning`, whose function `tune` maps deviations, in standard deviations, to a model. The
deviations are fitted together with hypotheses by `output_error`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh, eigvalsh, null_space

from analysis.diagnosis.limits import (
    AT_RETUNING_BOUND,
    RETUNING_BOUND,
    UNSTATED_MODE_SHARE,
    UNSTATED_SHARE,
    WIDER_RETUNING_BOUND,
)
from equalizer.plant.effect_vocabulary import MATRIX_UNITS, find_matrix_unit
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, Tolerance
from equalizer.signals.signal import FloatArray

DAMPING_UNCERTAINTY_RATIO = 10.0
"""Relative uncertainty of a mode's damping over that of its frequency. Chosen by hand: damping is identified far less
accurately."""
ROUNDING_SHARE = 1e-9
"""Share of a matrix's largest element by which an eigenvalue may be negative by rounding."""
_LEAST_MASS_FACTOR = 1e-3
"""Least factor 1 + dm on a mode's mass, so that its square root exists for any deviation."""


@dataclass(frozen=True, slots=True, eq=False)
class Tuning:
    """A model and its free parameters, whose changes are counted in standard deviations of the calibration."""

    model: MechanicalModel
    """The given model, with all deviations 0."""
    names: tuple[str, ...]
    """Names of the parameters: mass, damping, stiffness of each pair of axes, then frequency, mass, damping of each
    mode."""
    deviation: FloatArray
    """(parameters,): one standard deviation, in `units`."""
    units: tuple[str, ...]
    """Units of the parameters; "1" for the relative changes of modes."""
    tune: Callable[[FloatArray], MechanicalModel]
    """The model with its parameters changed by deviations (parameters,), in standard deviations. Raises
    MechanicalModelError where that is no valid model, such as one whose mass is not positive definite."""
    bound: float = RETUNING_BOUND
    """Standard deviations of the calibration by which a parameter may move at most."""

    def with_wider_bound(self) -> "Tuning":
        """Replace the bound by `WIDER_RETUNING_BOUND`, beyond what a calibration allows. For a model that was fitted to
        a recording of the same device with the missing physics in it: that physics biased the parameters by more than
        the stated tolerance."""
        return replace(self, bound=WIDER_RETUNING_BOUND)

    def is_at_bound(self, deviations: FloatArray) -> bool:
        """Whether a parameter has moved to its bound, or nearly. deviations: (parameters,), in standard deviations."""
        return bool(np.abs(deviations).max(initial=0.0) >= AT_RETUNING_BOUND * self.bound)

    def is_physical(self, deviations: FloatArray) -> bool:
        """Whether damping and stiffness stay physical with these deviations (parameters,): positive semidefinite, or no
        more indefinite than in the given model. Raises MechanicalModelError as `tune`."""
        tuned_model, given_model = self.tune(deviations), self.model
        return _is_as_definite(tuned_model.damping, given_model.damping) and _is_as_definite(
            tuned_model.stiffness, given_model.stiffness
        )

    def to_changes(self, deviations: FloatArray) -> FloatArray:
        """Convert deviations (parameters,), in standard deviations, to changes of the parameters, in `units`."""
        return np.asarray(deviations * self.deviation)


def make_tuning(model: MechanicalModel, input_channels: tuple[str, ...]) -> Tuning:
    """Make the free parameters of a model. input_channels: names of the driven axes."""
    modal_model = _transform_to_craig_bampton(model)
    m = model.inputs
    axis_pairs = [(i, j) for i in range(m) for j in range(i, m)]
    axis_names = [f"{input_channels[i]}{'' if i == j else ' ' + input_channels[j]}" for i, j in axis_pairs]
    mode_indices = range(len(modal_model.frequency_hz))
    parameter_names = [f"{quantity} {axis}" for quantity in ("mass", "damping", "stiffness") for axis in axis_names]
    parameter_names += [
        f"{quantity} of the mode at {modal_model.frequency_hz[k]:.3g} Hz"
        for quantity in ("frequency", "mass", "damping")
        for k in mode_indices
    ]
    tolerance = model.tolerance or Tolerance()
    mode_deviation = UNSTATED_MODE_SHARE if tolerance.modes is None else tolerance.modes
    axis_deviations = [
        _choose_deviation(stated_deviation, matrix[:m, :m])
        for stated_deviation, matrix in (
            (tolerance.mass_kg, modal_model.mass),
            (tolerance.damping_n_s_per_m, modal_model.damping),
            (tolerance.stiffness_n_per_m, modal_model.stiffness),
        )
    ]
    deviation = np.concatenate(
        [np.full(len(axis_pairs), deviation) for deviation in axis_deviations]
        + [np.full(len(mode_indices), mode_deviation * factor) for factor in (1.0, 1.0, DAMPING_UNCERTAINTY_RATIO)]
    )
    units = [find_matrix_unit(part, model.system) for part in MATRIX_UNITS]
    return Tuning(
        model,
        tuple(parameter_names),
        deviation,
        tuple(unit for unit in units for _ in axis_pairs) + ("1",) * (3 * len(mode_indices)),
        lambda deviations: _apply_changes(model, modal_model, axis_pairs, np.asarray(deviations) * deviation),
    )


def _is_as_definite(matrix: FloatArray, original: FloatArray) -> bool:
    """Whether the smallest eigenvalue of the symmetric part is not negative, or no smaller than that of `original`."""
    least_eigenvalue, original_eigenvalue = (
        float(eigvalsh((candidate + candidate.T) / 2)[0]) for candidate in (matrix, original)
    )
    return least_eigenvalue >= min(original_eigenvalue, 0.0) - ROUNDING_SHARE * float(np.abs(original).max())


@dataclass(frozen=True, slots=True, eq=False)
class _CraigBamptonModel:
    """Mass, damping and stiffness in Craig-Bampton coordinates: the driven axes first, then the modes of unit mass."""

    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    inverse_basis: FloatArray
    """Inverse of the basis of these coordinates; inverse_basis.T @ matrix @ inverse_basis is in the model's
    coordinates."""
    frequency_hz: FloatArray
    """(modes,): natural frequencies with the driven axes held."""


def _choose_deviation(deviation: float | None, axis_block: FloatArray) -> float:
    """Choose the standard deviation of the entries of a block (m, m) at the driven axes: as stated, else
    `UNSTATED_SHARE` of the largest diagonal entry; above 0 even where the block is 0."""
    if deviation is not None:
        return deviation
    return UNSTATED_SHARE * float(np.abs(np.diagonal(axis_block)).max()) or UNSTATED_SHARE


def _transform_to_craig_bampton(model: MechanicalModel) -> _CraigBamptonModel:
    """Transform a model to Craig-Bampton coordinates: constraint modes (static shapes) of the driven axes, then
    fixed-interface modes."""
    driven_axes = compute_driven_axes(model)
    interior_basis = null_space(driven_axes.T)
    m = driven_axes.shape[1]
    # Dual basis of the driven axes, so that a force along one axis moves that axis alone.
    dual_axes = driven_axes @ np.linalg.inv(driven_axes.T @ driven_axes)
    basis = dual_axes
    frequency_hz = np.zeros(0)
    if interior_basis.shape[1]:
        interior_stiffness, interior_mass = (
            interior_basis.T @ model.stiffness @ interior_basis,
            interior_basis.T @ model.mass @ interior_basis,
        )
        eigenvalues, shapes = eigh((interior_stiffness + interior_stiffness.T) / 2, interior_mass)
        frequency_hz = np.sqrt(np.maximum(eigenvalues, 0.0)) / (2 * np.pi)
        # Static deflection of the inner coordinates with the axes, so that axes and modes share no stiffness.
        static_deflection = -np.linalg.lstsq(
            interior_stiffness, interior_basis.T @ model.stiffness @ dual_axes, rcond=None
        )[0]
        basis = np.hstack([dual_axes + interior_basis @ static_deflection, interior_basis @ shapes])
    mass, damping, stiffness = (
        np.asarray(basis.T @ matrix @ basis) for matrix in (model.mass, model.damping, model.stiffness)
    )
    # For a symmetric stiffness, the remaining entries between driven axes and modes are rounding.
    stiffness[:m, m:] = stiffness[m:, :m] = 0.0
    return _CraigBamptonModel(mass, damping, stiffness, np.linalg.inv(basis), frequency_hz)


def _apply_changes(
    model: MechanicalModel, modal_model: _CraigBamptonModel, axis_pairs: list[tuple[int, int]], changes: FloatArray
) -> MechanicalModel:
    """Change the parameters of a model by `changes` (parameters,), in their units; equations: module docstring."""
    m, mode_count = model.inputs, len(modal_model.frequency_hz)
    axis_changes = changes[: 3 * len(axis_pairs)].reshape(3, len(axis_pairs))
    frequency_change, mass_change, damping_change = changes[3 * len(axis_pairs) :].reshape(3, mode_count)
    matrices = [modal_model.mass.copy(), modal_model.damping.copy(), modal_model.stiffness.copy()]
    for matrix, matrix_changes in zip(matrices, axis_changes, strict=True):
        for (i, j), matrix_change in zip(axis_pairs, matrix_changes, strict=True):
            matrix[i, j] += matrix_change
            matrix[j, i] += matrix_change if i != j else 0.0
    mass, damping, stiffness = matrices
    for k in range(mode_count):
        mode_row = m + k
        coupling, mass_factor = modal_model.mass[:m, mode_row], max(1 + mass_change[k], _LEAST_MASS_FACTOR)
        # A mode of unit mass adds coupling coupling^T to the mass that the axes carry at low frequencies.
        mass[:m, :m] += (mass_factor - 1) * np.outer(coupling, coupling)
        mass[:m, mode_row] *= np.sqrt(mass_factor)
        mass[mode_row, :m] *= np.sqrt(mass_factor)
        stiffness[mode_row, mode_row] *= (1 + frequency_change[k]) ** 2
        damping[mode_row, mode_row] *= (1 + frequency_change[k]) * (1 + damping_change[k])
    mass, damping, stiffness = (modal_model.inverse_basis.T @ matrix @ modal_model.inverse_basis for matrix in matrices)
    return replace(model, mass=(mass + mass.T) / 2, damping=damping, stiffness=stiffness)
