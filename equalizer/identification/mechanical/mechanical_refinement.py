"""Refinement of a mechanical structure's unknowns by weighted nonlinear least squares on measured spectral lines.

Minimises the sum over lines of |Y(f) - G(f, unknowns) U(f)|² / expected error power (output error; `LineGroup` holds
the weighted spectra), with SciPy's bounded trust-region reflective method. Held-out lines measure the error of the
result. Called by `mechanical_fit` and the selection of the order (`mechanical_order`, `modal_order`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Generic, TypeVar

import numpy as np

from equalizer.identification.mechanical.mechanical_misfit import (
    LineGroup,
    compute_misfits,
    compute_numerical_jacobian,
    stack_real,
)
from equalizer.identification.mechanical.mechanical_structure import Structure
from equalizer.identification.mechanical.modal_structure import ModalStructure
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.signal import FloatArray

StructureT = TypeVar("StructureT", Structure, ModalStructure)


@dataclass(frozen=True, slots=True, eq=False)
class RefinedFit(Generic[StructureT]):
    """Unknowns refined by `refine_unknowns`, with their misfit on the fitted and on the held-out lines."""

    structure: StructureT
    unknowns: FloatArray
    squares: float
    """Sum of squares of the fitted lines' misfits, each in units of its expected error."""
    held_out_squares: float
    """Sum of squares of the held-out lines' misfits."""
    held_out_count: int
    """Number of misfits in that sum."""
    jacobian: FloatArray
    """Jacobian at the solution, (2 n, parameters): real, then imaginary parts of the n complex misfits."""

    @property
    def error(self) -> float:
        """Root mean square misfit over the held-out lines, in units of the expected error; 0 without such lines."""
        return float(np.sqrt(self.held_out_squares / max(self.held_out_count, 1)))


def refine_unknowns(
    groups: Sequence[LineGroup],
    structure: StructureT,
    start: FloatArray,
    band_hz: tuple[float, float],
    max_evaluations: int = 40,
) -> RefinedFit[StructureT]:
    """Refine unknowns from a start (parameters,), which is first moved within the bounds. band_hz: fitted band, which
    sets the bounds. max_evaluations: limit of the evaluations of the residuals, without those for the Jacobian (default
    and stopping tolerances chosen). Raises MechanicalModelError where the start is not a valid model, and
    numpy.linalg.LinAlgError where the state matrix of the start or of the result cannot be diagonalised."""
    # Imported here: a diagnosis that fits no model does not need SciPy's optimiser.
    from scipy.optimize import least_squares

    fitted_groups = [group.exclude_held_out() for group in groups]
    lower_bounds, upper_bounds = structure.compute_bounds(band_hz)

    start = np.clip(start, lower_bounds + 1e-9, upper_bounds - 1e-9)
    compute_residuals = _make_residuals(fitted_groups, structure, start)
    solution = least_squares(
        compute_residuals,
        start,
        jac=lambda unknowns: compute_numerical_jacobian(
            compute_residuals, unknowns, compute_residuals(unknowns), upper_bounds
        ),
        bounds=(lower_bounds, upper_bounds),
        method="trf",
        x_scale="jac",
        max_nfev=max_evaluations,
        ftol=1e-6,
        xtol=1e-7,
    )
    held_out_squares, held_out_count = _sum_held_out_squares(groups, structure.build_model(solution.x))
    return RefinedFit(structure, solution.x, 2 * float(solution.cost), held_out_squares, held_out_count, solution.jac)


def _make_residuals(
    groups: Sequence[LineGroup], structure: Structure | ModalStructure, start: FloatArray
) -> Callable[[FloatArray], FloatArray]:
    """Make the function from unknowns (parameters,) to the real residuals on all lines; 1e6 each for an invalid model
    or non-finite residuals. It remembers the last: the optimiser asks for a Jacobian where it has just evaluated them.
    Raises as `refine_unknowns` for the start."""
    rejected = np.full_like(stack_real(compute_misfits(groups, structure.build_model(start))), 1e6)

    @lru_cache(maxsize=1)
    def evaluate(unknown_bytes: bytes) -> FloatArray:
        try:
            residuals = stack_real(compute_misfits(groups, structure.build_model(np.frombuffer(unknown_bytes))))
        except (np.linalg.LinAlgError, MechanicalModelError):
            return rejected  # so that the step to an invalid model is rejected
        return residuals if np.isfinite(residuals).all() else rejected

    return lambda unknowns: evaluate(unknowns.tobytes())


def _sum_held_out_squares(groups: Sequence[LineGroup], model: MechanicalModel) -> tuple[float, int]:
    """Sum the squares of the held-out lines' misfits; returns the sum and the number of misfits in it."""
    group_misfits = list(zip(groups, compute_misfits(groups, model), strict=True))
    squares = sum(np.sum(np.abs(misfit[group.held_out]) ** 2) for group, misfit in group_misfits)
    return float(squares), int(sum(group.count[group.held_out].sum() for group in groups))
