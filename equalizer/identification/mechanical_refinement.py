"""The unknowns of a structure, refined on measured lines: weighted least squares of the output's error."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from equalizer.identification.mechanical_misfit import LineGroup, jacobian, misfits, stacked
from equalizer.identification.mechanical_structure import Structure, diagonal_places
from equalizer.plant.mechanical_model import MechanicalModelError
from equalizer.signals.signal import FloatArray

_WIDEST_LOG = 12.0
_FARTHEST_MODE = 4.0
"""Times the band's end, or a part of its beginning."""
_LARGEST_TURN = 0.3
_MOST_DELAY_SAMPLES = 200.0


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    structure: Structure
    unknowns: FloatArray
    squares: float
    """Of the fitted lines' misfits."""
    left_out: float
    """Sum of squares over the lines that were not fitted."""
    left_out_count: int
    slope: FloatArray
    """(2 rows, parameters) at the solution."""

    @property
    def error(self) -> float:
        """On lines left out, where there are any."""
        return float(np.sqrt(self.left_out / max(self.left_out_count, 1)))


def refined(
    groups: Sequence[LineGroup],
    structure: Structure,
    start: FloatArray,
    band_hz: tuple[float, float],
    most_steps: int = 40,
) -> Refined:
    """Raises ValueError where the start itself is no model."""
    fitted = [group.without_left_out() for group in groups]
    low, high = bounds(structure, band_hz)

    def residuals(unknowns: FloatArray) -> FloatArray:
        try:
            found = stacked(misfits(fitted, structure.model(unknowns)))
        except (np.linalg.LinAlgError, MechanicalModelError):
            return np.full_like(worst, 1e6)
        return found if np.isfinite(found).all() else np.full_like(worst, 1e6)

    start = np.clip(start, low + 1e-9, high - 1e-9)
    worst = stacked(misfits(fitted, structure.model(start)))
    answer = least_squares(
        residuals,
        start,
        jac=lambda unknowns: jacobian(residuals, unknowns, residuals(unknowns), high),
        bounds=(low, high),
        method="trf",
        x_scale="jac",
        max_nfev=most_steps,
        ftol=1e-6,
        xtol=1e-7,
    )
    kept = [
        misfit[group.left_out] for group, misfit in zip(groups, misfits(groups, structure.model(answer.x)), strict=True)
    ]
    return Refined(
        structure,
        answer.x,
        2 * float(answer.cost),
        float(sum(np.sum(np.abs(part) ** 2) for part in kept)),
        int(sum(group.count[group.left_out].sum() for group in groups)),
        answer.jac,
    )


def bounds(structure: Structure, band_hz: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Within which unknowns are sought: no negative damper or spring, modes about the band."""
    low, high = np.full(structure.parameters, -np.inf), np.full(structure.parameters, np.inf)
    part, m = structure.slices, structure.inputs
    diagonal = diagonal_places(m)
    for name in ("damping", "stiffness"):
        if part[name].stop > part[name].start:
            low[part[name].start + diagonal] = 0.0
    low[part["mass"].start + diagonal], high[part["mass"].start + diagonal] = -_WIDEST_LOG, _WIDEST_LOG
    low[part["turn"]], high[part["turn"]] = -_LARGEST_TURN, _LARGEST_TURN
    low[part["delay"]], high[part["delay"]] = 0.0, _MOST_DELAY_SAMPLES
    if structure.modes:
        size = (part["modes"].stop - part["modes"].start) // structure.modes
        first = part["modes"].start + size * np.arange(structure.modes)
        low[first] = np.log(2 * np.pi * band_hz[0] / _FARTHEST_MODE / structure.speed_scale)
        high[first] = np.log(2 * np.pi * band_hz[1] * _FARTHEST_MODE / structure.speed_scale)
        low[first + 1], high[first + 1] = np.log(1e-4), np.log(3.0)
    return low, high
