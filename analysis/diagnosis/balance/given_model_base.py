"""A given model as the base of a force balance: the force that it requires, and its sensitivity to free parameters.

Both are columns of a linear regression of the measured force. The column of the required force has the fixed weight 1.
The other columns are the change of that force per standard deviation of each parameter's calibration, so that their
weights have the prior N(0, 1). The precision of this prior in the normal equations is the variance of the residual: its
sum of squares per degree of freedom, of which a residual with a narrow spectrum has few (equivalent degrees of freedom
of a power estimate; Bendat and Piersol 2010, Random Data, ch. 8). `confirm.balance_with_model` builds the columns."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.laws.law import Law
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.balance.regression import Regression, build_regression, fit_all_laws
from equalizer.signals.signal import FloatArray

FIXED_WEIGHT_PRECISION = 1e6
"""Precision of the prior that fixes the first weight at 1, relative to its precision by the data. Chosen so large that
the data do not change the weight."""


@dataclass(frozen=True, slots=True, eq=False)
class GivenModelBase:
    """Columns of a given mechanical model along one axis, in place of free mass, damping and stiffness."""

    columns: tuple[FloatArray, ...]
    """Per motion, (n, 1 + parameters), N (N m): the force that the model requires along the measured motion, and its
    change per standard deviation of each free parameter; at the motion's rate."""
    mass: float
    """Mass that moves along the axis, kg (kg m^2)."""
    least_share: float = 0.0
    """Smallest share of the force's rms that all laws together must explain; below it no law is searched for."""


def build_regression_with_model(
    motions: Sequence[Motion], axis: int, laws: Sequence[Law], given_base: GivenModelBase
) -> Regression:
    """Build a regression as `build_regression`, with the model's required force and its sensitivities as the base. Free
    parameters that change the force by no more than 1e-9 of its rms (rounding) are left out."""
    sensitive_columns = _find_sensitive_columns(given_base)
    columns = [motion_columns[:, sensitive_columns] for motion_columns in given_base.columns]
    regression = replace(build_regression(motions, axis, laws, False, None, columns), mass=given_base.mass)
    base_scales = regression.scale[: regression.base_column_count - 1]
    precision, precision_times_mean = np.zeros(len(base_scales)), np.zeros(len(base_scales))
    precision[0] = FIXED_WEIGHT_PRECISION * sum(block.gram[0, 0] for block in regression.fit)
    precision_times_mean[0] = precision[0] * base_scales[0]
    unconstrained = replace(regression, prior=(precision.copy(), precision_times_mean))
    precision[1:] = _estimate_residual_variance(unconstrained) / base_scales[1:] ** 2
    return replace(regression, prior=(precision, precision_times_mean))


def can_laws_explain(regression: Regression, least_share: float) -> bool:
    """Whether all laws together explain more than the share `least_share` of the force's rms: they lower the
    cross-validated sum of squares by more than `least_share`² times the force's sum of squares."""
    base_error = float(regression.cross_validate(regression.select_columns(())).sum())
    all_laws_error = fit_all_laws(regression, range(regression.columns[0].shape[1]))[0]
    return base_error - all_laws_error > least_share**2 * sum(block.centred_power for block in regression.fit)


def _find_sensitive_columns(given_base: GivenModelBase) -> list[int]:
    """Find the indices of the columns: 0 (required force), and those of the parameters that change its rms by more than
    1e-9."""
    rms = np.sqrt(np.mean(np.vstack(given_base.columns) ** 2, axis=0))
    return [0, *(column for column in range(1, len(rms)) if rms[column] > 1e-9 * rms[0])]


def _estimate_residual_variance(regression: Regression) -> float:
    """Estimate the residual sum of squares per equivalent degree of freedom (at least 1), with the base alone as
    regressors and the prior of `regression`. With the residual's power P on each spectral line, a motion has 2 (sum P)²
    / sum P² degrees of freedom."""
    residuals = regression.compute_residuals(regression.select_columns(()))
    sum_of_squares, degrees_of_freedom = 0.0, 0.0
    for residual, motion in zip(residuals, regression.motions, strict=True):
        known_residual = np.where(motion.mask_valid_samples(motion.fit), residual, 0.0)
        line_power = np.abs(np.fft.rfft(known_residual)) ** 2
        sum_of_squares += float(known_residual @ known_residual)
        degrees_of_freedom += 2 * float(line_power.sum()) ** 2 / max(float((line_power**2).sum()), 1e-300)
    return sum_of_squares / max(degrees_of_freedom, 1.0)
