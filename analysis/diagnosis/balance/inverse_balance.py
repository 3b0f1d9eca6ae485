"""The force balance solved for the acceleration: tests of laws of the actuator.

The force balance M a + D v + K x + (laws of the motion) = f(u) is a regression of the command u on the motion. A
nonlinear actuator f(u) cannot be a regressor there, because u is the predicted quantity. Therefore the balance is
solved for the acceleration, a = (f(u) - D v - K x - ...) / M: functions of the command then are regressors.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol, cast

import numpy as np

from analysis.diagnosis.balance.blocks import (
    RIDGE,
    Block,
    block_products,
    blocks_of,
    column_scale,
    compute_squared_error,
    solve_normal_equations,
    sum_products,
)
from analysis.diagnosis.balance.command_laws import CommandLaw
from analysis.diagnosis.balance.judge_laws import blocks_to_judge
from analysis.diagnosis.balance.structures import StructureSearch
from analysis.diagnosis.settings import STILL_SHARE
from analysis.diagnosis.types import Mapper, Mask
from equalizer.signals.signal import FloatArray


class ForceOfCommand(Protocol):
    """A law of the command, or a sum of functions that approximates all laws of a kind."""

    @property
    def sloped(self) -> int:
        """Number of leading columns whose rate of change is a further regressor: to first order, a short lag."""

    def of(self, command: FloatArray, position: FloatArray) -> FloatArray:
        """(n, weights): columns at command and position (n,) each, whose weighted sum is the force."""


@dataclass(frozen=True, slots=True, eq=False)
class InverseBalance:
    """A balance solved for the acceleration along its axis, or for the quantity that the command sets."""

    search: StructureSearch
    """The search for laws of the motion, whose regression and base are used here."""
    map_: Mapper
    has_friction: bool
    """Whether friction is among the laws of the motion: samples at rest are then no evidence, because friction balances
    any force up to its level, and a dead band gives none."""
    target: int | None = None
    """Order of the position's time derivative that the command sets; None = it is a force."""

    @property
    def solved(self) -> int:
        """Column that the balance is solved for: the quantity that the command sets, else the acceleration."""
        regression = self.search.regression
        own, places = regression.beside.own, len(regression.motions[0].channels)
        column = own if self.target is None else (2 - self.target) * places + own
        return column if column < regression.matrices else own

    def total_errors(self, laws: Sequence[CommandLaw], beside: Sequence[int]) -> list[float]:
        """Cross-validated sum of squares of each law. beside: indices of laws of the motion that are fitted with it."""
        return cast(list[float], list(self.map_(partial(self.total_error, beside=beside), laws)))

    def total_error(self, law: CommandLaw, beside: Sequence[int]) -> float:
        """Cross-validated sum of squares of one law of the command. beside: laws of the motion fitted with it."""
        return float(self.errors(law, beside, False).sum())

    def least_error(self, law: ForceOfCommand, beside: Sequence[int]) -> float:
        """Sum of squares on the fitted samples: a lower bound for each law that this sum approximates."""
        fit, _ = self._blocks(self._rows(law, beside), False)
        products = [block_products(block, range(len(fit[0].cross))) for block in fit]
        weights = solve_normal_equations(sum_products(fit, range(len(fit[0].cross))), RIDGE)
        return sum(compute_squared_error(own, weights, block.power) for own, block in zip(products, fit, strict=True))

    def errors(self, law: CommandLaw, laws: Sequence[int], judged: bool) -> FloatArray:
        """(blocks,): sums of squares of one law. judged: on the held-out blocks where there are any; else on each block
        to fit, with weights fitted to the others (cross-validation)."""
        tested = judged and blocks_to_judge(self.search.regression) is self.search.regression.test
        fit, test = self._blocks(self._rows(law, laws), tested)
        columns = list(range(len(fit[0].cross)))
        whole = sum_products(fit, columns)
        if tested:
            weights = solve_normal_equations(whole, RIDGE)
            return np.array(
                [compute_squared_error(block_products(block, columns), weights, block.power) for block in test]
            )
        found = []
        for block in fit:
            own = block_products(block, columns)
            found.append(
                compute_squared_error(
                    own, solve_normal_equations((whole[0] - own[0], whole[1] - own[1]), RIDGE), block.power
                )
            )
        return np.array(found)

    def _blocks(self, rows: Sequence[FloatArray], tested: bool) -> tuple[tuple[Block, ...], tuple[Block, ...]]:
        """Blocks of the samples to fit and, if `tested`, of the held-out samples. rows: regressors per motion."""
        regression = self.search.regression
        motions, solved = regression.motions, self.solved
        aims = [columns[:, solved] for columns in regression.columns]
        fit, test = (
            [motion.valid_samples(mask & moves) for motion, mask, moves in zip(motions, masks, moving, strict=True)]
            for moving in [self._find_moving_samples()]
            for masks in ([m.fit for m in motions], [m.test for m in motions])
        )
        mean = float(np.concatenate([aim[mask] for aim, mask in zip(aims, fit, strict=True)]).mean())
        units = column_scale(rows, fit), mean
        return blocks_of(rows, aims, fit, units), blocks_of(rows, aims, test, units) if tested else ()

    def _find_moving_samples(self) -> list[Mask]:
        """(n,) per motion: mask of the samples that are evidence; those at rest are not, where there is friction."""
        regression = self.search.regression
        speeds = [motion.velocity[:, regression.beside.own] for motion in regression.motions]
        used = np.concatenate([speed[motion.fit] for speed, motion in zip(speeds, regression.motions, strict=True)])
        least = STILL_SHARE * float(np.mean(used**2)) if self.has_friction else -1.0
        return [speed**2 > least for speed in speeds]

    def _rows(self, law: ForceOfCommand, laws: Sequence[int]) -> list[FloatArray]:
        """Per motion the regression's columns (n, columns): the law's, their rates of change, the other axes' commands,
        and the laws of the motion."""
        regression, found = self.search.regression, []
        # Columns of the base that are filtered copies of the predicted quantity would reproduce it.
        filters = {self.solved, *range(regression.matrices, regression.base - 1)}
        beside = [column for column in regression.columns_of(laws) if column not in filters]
        for motion, columns in zip(regression.motions, regression.columns, strict=True):
            force = law.of(motion.force[:, regression.axis], motion.position[:, regression.beside.own])
            others = np.delete(motion.force, regression.axis, axis=1)
            entered = np.hstack([force, np.gradient(force[:, : law.sloped], 1 / motion.rate_hz, axis=0), others])
            found.append(np.hstack([motion.decimate(entered), columns[:, beside]]))
        return found
