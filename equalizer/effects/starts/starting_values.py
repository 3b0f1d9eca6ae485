"""Partial regression of the missing force on laws of the motion, for the starting values of several effects.

The missing force is the additional force at a driven axis that would explain a model's residual. Effects whose force is
linear in its strengths are fitted by least squares, F = sum of strength_i law_i(motion), after the terms that re-tuned
mass, damping and stiffness explain were projected out (theorem of Frisch, Waugh and Lovell). Called by the effects that
add a force or change the structure at an axis, and by `law_entry`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

LEAST_SLIDING_SPEED = 0.02
"""Speed, relative to the rms velocity, below which the direction of sliding is not known. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class AxisMotion:
    """Motion and missing force at a driven axis, at selected samples; all (n,), in SI units (m or rad, s, N or N m)."""

    time_s: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    force: FloatArray
    """The missing force."""

    def select(self, is_selected: npt.NDArray[np.bool_]) -> "AxisMotion":
        """Select the samples where `is_selected` (n,) is true."""
        return AxisMotion(*(getattr(self, name)[is_selected] for name in self.__dataclass_fields__))


@dataclass(frozen=True, slots=True, eq=False)
class LawFit:
    """Regression of the missing force on laws of the motion."""

    strengths: FloatArray
    """(k,): factor of each law."""
    explained_share: float
    """Power that the laws explain, relative to that of the force after the nuisance regressors were projected out."""


def select_axis_motion(evidence: Evidence, axis: int) -> AxisMotion:
    """Select motion and missing force of a driven axis at the samples where `evidence.used` is above 0; acceleration by
    central differences of velocity."""
    time_s = np.arange(len(evidence.command)) / evidence.sample_rate_hz
    acceleration = np.gradient(evidence.axis_velocity[:, axis], 1 / evidence.sample_rate_hz)
    all_samples = AxisMotion(
        time_s, evidence.axis_position[:, axis], evidence.axis_velocity[:, axis], acceleration,
        evidence.axis_force[:, axis],
    )  # fmt: skip
    return all_samples.select(evidence.used > 0)


def select_sliding_motion(evidence: Evidence, axis: int) -> AxisMotion:
    """Select motion and missing force of an axis at the samples whose speed exceeds `LEAST_SLIDING_SPEED` times its rms
    velocity."""
    motion = select_axis_motion(evidence, axis)
    return motion.select(np.abs(motion.velocity) > LEAST_SLIDING_SPEED * np.sqrt(np.mean(motion.velocity**2)))


def stack_linear_regressors(motion: AxisMotion, constant: bool = True) -> FloatArray:
    """Stack position, velocity, acceleration and, if `constant`, 1 as columns (n, 3 or 4): regressors of a linear
    model's errors."""
    regressors = [motion.position, motion.velocity, motion.acceleration]
    return np.column_stack([*regressors, np.ones_like(motion.position)] if constant else regressors)


class PartialRegression:
    """Least squares of laws with nuisance regressors projected out (Frisch-Waugh), fast for many trials of a law."""

    def __init__(self, force: FloatArray, nuisances: FloatArray) -> None:
        """Project the nuisance regressors out of the force. force: (n,); nuisances: (n, k), which may be linearly
        dependent: directions with singular values up to 1e-9 of the largest are dropped."""
        scale = np.linalg.norm(nuisances, axis=0)
        left_vectors, singular_values, _ = np.linalg.svd(
            nuisances / np.where(scale > 0, scale, 1.0), full_matrices=False
        )
        self._basis = left_vectors[
            :, singular_values > 1e-9 * max(float(singular_values.max(initial=0.0)), np.finfo(float).tiny)
        ]
        self.force = self._project_out(force)
        """(n,): residual of the force after projection on the nuisance regressors."""
        self._power = max(float(self.force @ self.force), np.finfo(float).tiny)

    def _project_out(self, signals: FloatArray) -> FloatArray:
        """Return the component of signals (n,) or (n, k) orthogonal to the nuisance regressors."""
        return np.asarray(signals - self._basis @ (self._basis.T @ signals))

    def fit(self, *laws: FloatArray) -> LawFit:
        """Fit laws to the force by least squares, with the nuisance regressors projected out of both. laws: (n,) each,
        evaluated with strength 1, one at least."""
        regressors = self._project_out(np.column_stack(laws))
        norms = np.linalg.norm(regressors, axis=0)
        regressors = regressors / np.where(norms > 0, norms, 1.0)
        products = regressors.T @ self.force
        strengths = np.asarray(np.linalg.lstsq(regressors.T @ regressors, products, rcond=1e-9)[0], dtype=np.float64)
        return LawFit(strengths / np.where(norms > 0, norms, 1.0), float(products @ strengths) / self._power)


def regress_out_linear_terms(motion: AxisMotion, constant: bool = True) -> PartialRegression:
    """Prepare the regression of the missing force with the regressors of `stack_linear_regressors` projected out."""
    return PartialRegression(motion.force, stack_linear_regressors(motion, constant))


def find_best_trial(
    regression: PartialRegression, trials: Sequence[float], laws: Callable[[float], tuple[FloatArray, ...]]
) -> tuple[float, LawFit]:
    """Find the trial value of a nonlinear parameter whose laws explain most, and its fit. laws: from a trial value to
    (n,) each. Raises ValueError without trials."""
    fits = [(trial, regression.fit(*laws(trial))) for trial in trials]
    return max(fits, key=lambda item: item[1].explained_share)


def compute_quadratic_form(matrix: FloatArray, direction: FloatArray) -> float:
    """Compute the quadratic form d' M d of a mass, damping or stiffness matrix M (n, n) and a direction d (n,)."""
    return float(direction @ matrix @ direction)
