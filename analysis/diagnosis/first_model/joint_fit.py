"""Fits symmetric mass, damping and stiffness matrices of all axes at once, by least squares on forces.

Axes count alike: each axis's error is divided by the power of its force. Standard errors are sandwich estimates over
blocks, because residuals are correlated (White, Econometrica 48:817, 1980).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import stdtrit

from analysis.diagnosis.balance.blocks import Block, block_products, compute_squared_error
from analysis.diagnosis.balance.judge_laws import held_out_moves
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.balance.regression import Regression, regression_of, signal_power
from analysis.diagnosis.settings import ACCELERATION_NOISE_SHARE, LEAST_TEST_BLOCKS
from equalizer.signals.signal import FloatArray

Part = Literal["mass", "damping", "stiffness"]
PARTS: tuple[Part, ...] = ("mass", "damping", "stiffness")


@dataclass(frozen=True, slots=True, eq=False)
class JointFit:
    """Symmetric mass, damping and stiffness matrices fitted together, with their intervals and held-out errors."""

    matrices: dict[Part, FloatArray]
    """(d, d) each; zero where a part was not asked for."""
    halves: dict[Part, FloatArray]
    """Half-widths of the 95 % intervals, including the bias due to the noise of the motion."""
    deviations: dict[Part, float]
    """The largest standard error on the diagonal."""
    folds: FloatArray
    """(blocks,): cross-validated sum of squares of each block, relative to the power of all, in the mean over the
    axes."""
    folds_error: float
    """Root of their sum."""
    held_out: FloatArray
    """(d,): rms of each axis's held-out error over that of its force."""
    remainders: tuple[FloatArray, ...]
    """Per motion, (kept samples, d): the force that is not explained."""


@dataclass(frozen=True, slots=True, eq=False)
class _Parametrisation:
    """Which parameters are fitted, and their places in each axis's row of weights."""

    columns: list[int]
    rows: tuple[FloatArray, ...]
    """Per axis (columns, parameters)"""
    entries: tuple[tuple[Part, int, int], ...]


def regressions_of(motions: Sequence[Motion], turns: bool) -> tuple[Regression, ...]:
    """Regression of the force of each axis on mass, damping and stiffness alone, without laws. turns: see `Scales`."""
    return tuple(regression_of(motions, axis, (), turns) for axis in range(motions[0].force.shape[1]))


def joint_fit(regressions: Sequence[Regression], parts: Sequence[Part]) -> JointFit:
    """The joint fit. parts: matrices of the model; a constant force is always fitted, too. Raises
    numpy.linalg.LinAlgError where the motion does not determine them."""
    shape = _parametrisation(regressions[0], parts)
    powers = [max(signal_power(regression.fit), 1e-300) for regression in regressions]
    own = _products([regression.fit for regression in regressions], shape, powers)
    whole = np.sum([each[0] for each in own], axis=0), np.sum([each[1] for each in own], axis=0)
    found, spread = _solve(whole), _standard_errors(own, whole)
    fit = [regression.fit for regression in regressions]
    crossed = [_solve((whole[0] - gram, whole[1] - cross)) for gram, cross in own]
    folds = _errors(fit, shape, crossed)
    test = [regression.test for regression in regressions]
    tested = len(test[0]) >= LEAST_TEST_BLOCKS and any(map(held_out_moves, regressions))
    held = _errors(test, shape, [found] * len(test[0])) if tested else folds
    sizes = np.array([max(signal_power(blocks), 1e-300) for blocks in (test if tested else fit)])
    folded = (folds / np.array(powers)).mean(axis=1)
    matrices, deviations = (_matrices(regressions[0], shape, values) for values in (found, spread))
    reach = float(stdtrit(max(len(own) - 1, 1), 0.975))
    biases = {part: ACCELERATION_NOISE_SHARE * np.abs(matrices[part]) for part in PARTS}
    halves = {part: np.hypot(reach * deviations[part], biases[part]) for part in PARTS}
    return JointFit(
        matrices, halves, {part: float(np.diagonal(deviations[part]).max()) for part in PARTS}, folded,
        float(np.sqrt(folded.sum())), np.sqrt(held.sum(axis=0) / sizes), _remainders(regressions, shape, found),
    )  # fmt: skip


def _parametrisation(regression: Regression, parts: Sequence[Part]) -> _Parametrisation:
    axes = len(regression.motions[0].channels)
    columns = [PARTS.index(part) * axes + k for part in parts for k in range(axes)] + [regression.base - 1]
    entries = tuple((part, i, k) for part in parts for i in range(axes) for k in range(i, axes))
    rows = []
    for axis in range(axes):
        row = np.zeros((len(columns), len(entries) + axes))
        for number, (part, i, k) in enumerate(entries):
            begin = list(parts).index(part) * axes
            if axis in (i, k):
                row[begin + (k if axis == i else i), number] = 1.0
        row[-1, len(entries) + axis] = 1.0
        rows.append(regression.scale[columns][:, None] * row)
    return _Parametrisation(columns, tuple(rows), entries)


def _products(
    blocks: Sequence[Sequence[Block]], shape: _Parametrisation, powers: Sequence[float]
) -> list[tuple[FloatArray, FloatArray]]:
    """Normal equations of the joint parameters, per block."""
    found = []
    for each in zip(*blocks, strict=True):
        count = shape.rows[0].shape[1]
        gram, cross = np.zeros((count, count)), np.zeros(count)
        for block, row, power in zip(each, shape.rows, powers, strict=True):
            own = block_products(block, shape.columns)
            gram, cross = gram + row.T @ own[0] @ row / power, cross + row.T @ own[1] / power
        found.append((gram, cross))
    return found


def _solve(products: tuple[FloatArray, FloatArray]) -> FloatArray:
    size = np.sqrt(np.maximum(np.diagonal(products[0]), 1e-300))
    return np.asarray(np.linalg.solve(products[0] / np.outer(size, size), products[1] / size) / size)


def _standard_errors(own: Sequence[tuple[FloatArray, FloatArray]], whole: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Standard errors of the parameters."""
    found = _solve(whole)
    size = np.sqrt(np.maximum(np.diagonal(whole[0]), 1e-300))
    inverse = np.linalg.inv(whole[0] / np.outer(size, size)) / np.outer(size, size)
    scores = np.array([cross - gram @ found for gram, cross in own])
    wide = len(own) / max(len(own) - 1, 1)
    return np.asarray(np.sqrt(np.maximum(np.diagonal(inverse @ (wide * scores.T @ scores) @ inverse), 0.0)))


def _errors(blocks: Sequence[Sequence[Block]], shape: _Parametrisation, numbers: Sequence[FloatArray]) -> FloatArray:
    """(blocks, axes): sums of squares."""
    return np.array(
        [
            [
                compute_squared_error(block_products(block, shape.columns), row @ weights, block.power)
                for block, row in zip(each, shape.rows, strict=True)
            ]
            for each, weights in zip(zip(*blocks, strict=True), numbers, strict=True)
        ]
    )


def _matrices(regression: Regression, shape: _Parametrisation, values: FloatArray) -> dict[Part, FloatArray]:
    axes = len(regression.motions[0].channels)
    found = {part: np.zeros((axes, axes)) for part in PARTS}
    for (part, i, k), value in zip(shape.entries, values, strict=False):
        found[part][i, k] = found[part][k, i] = value
    return found


def _remainders(
    regressions: Sequence[Regression], shape: _Parametrisation, found: FloatArray
) -> tuple[FloatArray, ...]:
    weights = [row @ found / regressions[0].scale[shape.columns] for row in shape.rows]
    return tuple(
        np.column_stack(
            [
                regression.force[number] - regression.columns[number][:, shape.columns] @ own
                for regression, own in zip(regressions, weights, strict=True)
            ]
        )
        for number in range(len(regressions[0].motions))
    )
