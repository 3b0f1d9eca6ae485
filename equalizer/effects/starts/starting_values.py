"""Partial regression of the missing force on laws of the motion, for the starting values of several effects.

The missing force is the additional force at a driven axis that would explain a model's residual. Effects whose force
is linear in its strengths are fitted by least squares, F = sum of strength_i law_i(motion), after the terms that
re-tuned mass, damping and stiffness explain were projected out (theorem of Frisch, Waugh and Lovell).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

SLOW = 0.02
"""Speed, relative to the rms velocity, below which the direction of sliding is not known. Heuristic."""


@dataclass(frozen=True, slots=True, eq=False)
class AxisMotion:
    """Motion and missing force at a driven axis, at selected samples; all (n,), in SI units (m or rad, s, N or N m)."""

    time_s: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    force: FloatArray
    """The missing force."""

    def select(self, keep: npt.NDArray[np.bool_]) -> "AxisMotion":
        """The samples where `keep` (n,) is true; their times need not be evenly spaced."""
        return AxisMotion(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))


@dataclass(frozen=True, slots=True, eq=False)
class LawFit:
    """Regression of the missing force on laws of the motion."""

    strengths: FloatArray
    """(k,): factor of each law."""
    explained_share: float
    """Power that the laws explain, relative to that of the force after the nuisance regressors were projected out."""


def axis_motion(evidence: Evidence, axis: int) -> AxisMotion:
    """Motion and missing force of a driven axis at the samples where `evidence.used` is above 0; acceleration by
    central differences of velocity."""
    time_s = np.arange(len(evidence.command)) / evidence.sample_rate_hz
    acceleration = np.gradient(evidence.axis_velocity[:, axis], 1 / evidence.sample_rate_hz)
    all_samples = AxisMotion(
        time_s, evidence.axis_position[:, axis], evidence.axis_velocity[:, axis], acceleration,
        evidence.axis_force[:, axis],
    )  # fmt: skip
    return all_samples.select(evidence.used > 0)


def select_sliding_motion(evidence: Evidence, axis: int) -> AxisMotion:
    """Motion of an axis at the samples whose speed exceeds `SLOW` times its rms velocity."""
    motion = axis_motion(evidence, axis)
    return motion.select(np.abs(motion.velocity) > SLOW * np.sqrt(np.mean(motion.velocity**2)))


def linear_part(motion: AxisMotion, constant: bool = True) -> FloatArray:
    """(n, 3 or 4): position, velocity, acceleration and, if `constant`, 1: regressors of a linear model's errors."""
    shapes = [motion.position, motion.velocity, motion.acceleration]
    return np.column_stack([*shapes, np.ones_like(motion.position)] if constant else shapes)


class PartialRegression:
    """Least squares of laws with nuisance regressors projected out (Frisch-Waugh), fast for many trials of a law."""

    def __init__(self, force: FloatArray, nuisances: FloatArray) -> None:
        """force: (n,); nuisances: (n, k), regressors to be projected out. Linearly dependent ones are permitted."""
        scale = np.linalg.norm(nuisances, axis=0)
        left_vectors, sizes, _ = np.linalg.svd(nuisances / np.where(scale > 0, scale, 1.0), full_matrices=False)
        self._basis = left_vectors[:, sizes > 1e-9 * max(float(sizes.max(initial=0.0)), np.finfo(float).tiny)]
        self.force = self._residual_without(force)
        """(n,): residual of the force after projection on the nuisance regressors."""
        self._power = max(float(self.force @ self.force), np.finfo(float).tiny)

    def _residual_without(self, shapes: FloatArray) -> FloatArray:
        """Component of shapes (n,) or (n, k) orthogonal to the nuisance regressors."""
        return np.asarray(shapes - self._basis @ (self._basis.T @ shapes))

    def fit(self, *laws: FloatArray) -> LawFit:
        """Least-squares fit of laws to the force, with the nuisance regressors projected out of both. laws: (n,) each,
        evaluated with strength 1."""
        shapes = self._residual_without(np.column_stack(laws))
        size = np.linalg.norm(shapes, axis=0)
        shapes = shapes / np.where(size > 0, size, 1.0)
        products = shapes.T @ self.force
        strengths = np.asarray(np.linalg.lstsq(shapes.T @ shapes, products, rcond=1e-9)[0], dtype=np.float64)
        return LawFit(strengths / np.where(size > 0, size, 1.0), float(products @ strengths) / self._power)


def regress_out_linear_terms(motion: AxisMotion, constant: bool = True) -> PartialRegression:
    """Regression of the missing force with the regressors of `linear_part` projected out."""
    return PartialRegression(motion.force, linear_part(motion, constant))


def best_trial(
    regression: PartialRegression, trials: Sequence[float], laws: Callable[[float], tuple[FloatArray, ...]]
) -> tuple[float, LawFit]:
    """The trial value of a nonlinear parameter whose laws explain most, and its fit. laws: from a trial value to (n,)
    each. Raises ValueError without trials."""
    fits = [(trial, regression.fit(*laws(trial))) for trial in trials]
    return max(fits, key=lambda item: item[1].explained_share)


def quadratic_form(matrix: FloatArray, direction: FloatArray) -> float:
    """Quadratic form d' M d of a mass, damping or stiffness matrix M (n, n) and a direction d (n,)."""
    return float(direction @ matrix @ direction)
