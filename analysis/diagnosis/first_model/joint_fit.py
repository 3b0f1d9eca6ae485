"""Fit symmetric mass, damping and stiffness matrices of all axes together, by least squares on forces.

For the forces f of d axes and the motion q along them,

    f = M q'' + D q' + K q + f0 + e,        M, D, K symmetric,

the sum over axes of |e_i|² / |f_i - mean f_i|² is minimised, so that every axis has the same weight. Standard errors
are sandwich estimates (White, Econometrica 48:817, 1980), clustered by blocks of samples, because residuals within a
block are correlated."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import stdtrit

from analysis.diagnosis.balance.blocks import Block, compute_squared_error, select_products
from analysis.diagnosis.balance.judged_law import has_held_out_motion
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.balance.regression import Regression, build_regression, compute_signal_power
from analysis.diagnosis.limits import ACCELERATION_NOISE_SHARE, LEAST_TEST_BLOCKS
from equalizer.signals.signal import FloatArray

Part = Literal["mass", "damping", "stiffness"]
"""Name of a matrix of the model."""
PARTS: tuple[Part, ...] = ("mass", "damping", "stiffness")
"""Matrices in the order of their columns in a regression without laws."""


@dataclass(frozen=True, slots=True, eq=False)
class JointFit:
    """Symmetric mass, damping and stiffness matrices fitted together, with their intervals and held-out errors."""

    matrices: dict[Part, FloatArray]
    """(d, d) each, in the recordings' units; zero where a part was not fitted."""
    half_widths: dict[Part, FloatArray]
    """(d, d) each, in the same units: half-widths of the 95 % intervals (Student's t over blocks), with the possible
    bias by noise of the motion, `ACCELERATION_NOISE_SHARE` of each entry, added in quadrature."""
    largest_standard_errors: dict[Part, float]
    """By matrix: the largest standard error on its diagonal, in the same units."""
    fold_errors: FloatArray
    """(blocks,): cross-validated sum of squares of each block over the power of all blocks, mean over the axes."""
    cross_validated_error: float
    """Square root of the sum of `fold_errors`."""
    held_out: FloatArray
    """(d,): rms of each axis's held-out error over that of its force about the mean; that of cross-validation where
    too little was held out (`fit_jointly`)."""
    residual_forces: tuple[FloatArray, ...]
    """Per motion, (decimated samples, d): residual force, in the commands' unit."""


@dataclass(frozen=True, slots=True, eq=False)
class _Parametrisation:
    """The linear map from the fitted parameters to the weights of each axis's regression."""

    columns: list[int]
    """Columns of the regression that are used."""
    axis_maps: tuple[FloatArray, ...]
    """Per axis, (columns, parameters): map from the parameters to the weights of the scaled columns."""
    entries: tuple[tuple[Part, int, int], ...]
    """Matrix, row and column of each parameter; the constant forces follow them."""


def build_regressions(motions: Sequence[Motion], turns_freely: bool) -> tuple[Regression, ...]:
    """Build the regression of the force of each axis on mass, damping, stiffness and a constant, without laws.
    turns_freely: whether a shaft turns freely and has no stiffness (`build_regression`)."""
    return tuple(build_regression(motions, axis, (), turns_freely) for axis in range(motions[0].force.shape[1]))


def fit_jointly(regressions: Sequence[Regression], parts: Sequence[Part]) -> JointFit:
    """Fit the matrices jointly. parts: those to fit, without the stiffness where the shaft turns freely; a constant
    force per axis is always fitted, too. Held-out errors are those of cross-validation with fewer than
    `LEAST_TEST_BLOCKS` test blocks, or where they hold no motion on any axis (`has_held_out_motion`). A force without
    power is given the power 1e-300, against division by zero. Raises numpy.linalg.LinAlgError where the motion, or that
    without one of the blocks, does not determine the parameters."""
    parametrisation = _build_parametrisation(regressions[0], parts)
    powers = [max(compute_signal_power(regression.fit), 1e-300) for regression in regressions]
    block_equations = _build_block_equations([regression.fit for regression in regressions], parametrisation, powers)
    normal_equations = (
        np.sum([equations[0] for equations in block_equations], axis=0),
        np.sum([equations[1] for equations in block_equations], axis=0),
    )
    parameters, parameter_errors = (
        _solve_normal_equations(normal_equations),
        _compute_standard_errors(block_equations, normal_equations),
    )
    fit_blocks = [regression.fit for regression in regressions]
    fold_parameters = [
        _solve_normal_equations((normal_equations[0] - gram, normal_equations[1] - cross))
        for gram, cross in block_equations
    ]
    fold_squares = _compute_squared_errors(fit_blocks, parametrisation, fold_parameters)
    test_blocks = [regression.test for regression in regressions]
    has_test = len(test_blocks[0]) >= LEAST_TEST_BLOCKS and any(map(has_held_out_motion, regressions))
    test_errors = (
        _compute_squared_errors(test_blocks, parametrisation, [parameters] * len(test_blocks[0]))
        if has_test
        else fold_squares
    )
    force_powers = np.array(
        [max(compute_signal_power(blocks), 1e-300) for blocks in (test_blocks if has_test else fit_blocks)]
    )
    fold_errors = (fold_squares / np.array(powers)).mean(axis=1)
    matrices, error_matrices = (
        _assemble_matrices(regressions[0], parametrisation, values) for values in (parameters, parameter_errors)
    )
    t_factor = float(stdtrit(max(len(block_equations) - 1, 1), 0.975))  # two-sided 95 %
    bias_limits = {part: ACCELERATION_NOISE_SHARE * np.abs(matrices[part]) for part in PARTS}
    half_widths = {part: np.hypot(t_factor * error_matrices[part], bias_limits[part]) for part in PARTS}
    return JointFit(
        matrices, half_widths, {part: float(np.diagonal(error_matrices[part]).max()) for part in PARTS}, fold_errors,
        float(np.sqrt(fold_errors.sum())), np.sqrt(test_errors.sum(axis=0) / force_powers),
        _compute_residual_forces(regressions, parametrisation, parameters),
    )  # fmt: skip


def _build_parametrisation(regression: Regression, parts: Sequence[Part]) -> _Parametrisation:
    """Build the map for these symmetric matrices. The parameters are the entries on and above the diagonals, then one
    constant force per axis."""
    axis_count = len(regression.motions[0].channels)
    columns = [PARTS.index(part) * axis_count + k for part in parts for k in range(axis_count)] + [
        regression.base_column_count - 1
    ]
    entries = tuple((part, i, k) for part in parts for i in range(axis_count) for k in range(i, axis_count))
    axis_maps = []
    for axis in range(axis_count):
        axis_map = np.zeros((len(columns), len(entries) + axis_count))
        for parameter_index, (part, i, k) in enumerate(entries):
            first_row = list(parts).index(part) * axis_count
            if axis in (i, k):
                axis_map[first_row + (k if axis == i else i), parameter_index] = 1.0
        axis_map[-1, len(entries) + axis] = 1.0
        axis_maps.append(regression.scale[columns][:, None] * axis_map)
    return _Parametrisation(columns, tuple(axis_maps), entries)


def _build_block_equations(
    blocks: Sequence[Sequence[Block]], parametrisation: _Parametrisation, powers: Sequence[float]
) -> list[tuple[FloatArray, FloatArray]]:
    """Build the normal equations of the joint parameters, (parameters, parameters) and (parameters,), per block.
    blocks: by axis; powers: sum of squares of each axis's force, which divides its equations."""
    equations = []
    for axis_blocks in zip(*blocks, strict=True):
        parameter_count = parametrisation.axis_maps[0].shape[1]
        gram, cross = np.zeros((parameter_count, parameter_count)), np.zeros(parameter_count)
        for block, axis_map, power in zip(axis_blocks, parametrisation.axis_maps, powers, strict=True):
            products = select_products(block, parametrisation.columns)
            gram, cross = gram + axis_map.T @ products[0] @ axis_map / power, cross + axis_map.T @ products[1] / power
        equations.append((gram, cross))
    return equations


def _solve_normal_equations(equations: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Solve the normal equations, scaled to a unit diagonal (zeros count as 1e-300), for (parameters,). Raises
    numpy.linalg.LinAlgError where they are singular."""
    column_norms = np.sqrt(np.maximum(np.diagonal(equations[0]), 1e-300))
    return np.asarray(
        np.linalg.solve(equations[0] / np.outer(column_norms, column_norms), equations[1] / column_norms) / column_norms
    )


def _compute_standard_errors(
    block_equations: Sequence[tuple[FloatArray, FloatArray]], normal_equations: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Compute (parameters,): sandwich standard errors, the root of the diagonal of G^-1 (sum of s s') G^-1 b / (b - 1),
    with the normal matrix G, and the gradient s of each of the b blocks; for a single block the factor is 1."""
    parameters = _solve_normal_equations(normal_equations)
    column_norms = np.sqrt(np.maximum(np.diagonal(normal_equations[0]), 1e-300))
    inverse = np.linalg.inv(normal_equations[0] / np.outer(column_norms, column_norms)) / np.outer(
        column_norms, column_norms
    )
    scores = np.array([cross - gram @ parameters for gram, cross in block_equations])
    correction = len(block_equations) / max(len(block_equations) - 1, 1)
    return np.asarray(np.sqrt(np.maximum(np.diagonal(inverse @ (correction * scores.T @ scores) @ inverse), 0.0)))


def _compute_squared_errors(
    blocks: Sequence[Sequence[Block]], parametrisation: _Parametrisation, block_parameters: Sequence[FloatArray]
) -> FloatArray:
    """Compute (blocks, axes): sums of squared force errors. blocks: by axis; block_parameters: parameters for each
    block."""
    return np.array(
        [
            [
                compute_squared_error(
                    select_products(block, parametrisation.columns), axis_map @ parameters, block.power
                )
                for block, axis_map in zip(axis_blocks, parametrisation.axis_maps, strict=True)
            ]
            for axis_blocks, parameters in zip(zip(*blocks, strict=True), block_parameters, strict=True)
        ]
    )


def _assemble_matrices(
    regression: Regression, parametrisation: _Parametrisation, parameters: FloatArray
) -> dict[Part, FloatArray]:
    """Assemble the symmetric matrices (d, d) from the parameters (or their standard errors); the constant forces, which
    come last, are not used."""
    axis_count = len(regression.motions[0].channels)
    matrices = {part: np.zeros((axis_count, axis_count)) for part in PARTS}
    for (part, i, k), value in zip(parametrisation.entries, parameters, strict=False):
        matrices[part][i, k] = matrices[part][k, i] = value
    return matrices


def _compute_residual_forces(
    regressions: Sequence[Regression], parametrisation: _Parametrisation, parameters: FloatArray
) -> tuple[FloatArray, ...]:
    """Compute the residual forces (`JointFit.residual_forces`)."""
    regression_weights = [
        axis_map @ parameters / regressions[0].scale[parametrisation.columns] for axis_map in parametrisation.axis_maps
    ]
    return tuple(
        np.column_stack(
            [
                regression.force[motion_index]
                - regression.columns[motion_index][:, parametrisation.columns] @ axis_weights
                for regression, axis_weights in zip(regressions, regression_weights, strict=True)
            ]
        )
        for motion_index in range(len(regressions[0].motions))
    )
