"""Force balance solved for the acceleration, in which nonlinear laws of the actuator are fitted and compared.

The force balance M a + B v + K x + (laws of the motion) = f(u) is a regression of the command u on the motion. A
nonlinear actuator f(u) cannot be a regressor there, because u is the predicted quantity. Therefore the balance is
solved for the acceleration, a = (f(u) - B v - K x - ...) / M: functions of the command then are regressors. Called by
`actuator`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol, cast

import numpy as np

from analysis.diagnosis.balance.blocks import (
    RIDGE,
    Block,
    build_blocks,
    compute_scale,
    compute_squared_error,
    select_products,
    solve_normal_equations,
    sum_products,
)
from analysis.diagnosis.balance.judged_law import select_test_blocks
from analysis.diagnosis.balance.laws.command_laws import CommandLaw
from analysis.diagnosis.balance.structures import StructureSearch
from analysis.diagnosis.limits import STILL_SHARE
from analysis.diagnosis.types import Mapper, Mask
from equalizer.signals.signal import FloatArray


class CommandForce(Protocol):
    """A law of the command, or a sum of functions that approximates all laws of a kind."""

    @property
    def lag_column_count(self) -> int:
        """Number of leading columns whose time derivative is a further regressor: a short lag, to first order."""

    def compute_columns(self, command: FloatArray, position: FloatArray) -> FloatArray:
        """Compute the columns (n, weights) at command and position (n,) each, whose weighted sum is the force."""


@dataclass(frozen=True, slots=True, eq=False)
class InverseBalance:
    """Force balance of an axis, solved for `solved_column`."""

    search: StructureSearch
    """The search for laws of the motion, whose regression is used."""
    map_: Mapper
    """Like `map`; may run in parallel."""
    has_friction: bool
    """Whether samples at rest are left out, because static friction balances any force up to its level there."""
    commanded_order: int | None = None
    """Order of the position's time derivative that a servo's command is a reference for; None = the command is a
    force."""

    @property
    def solved_column(self) -> int:
        """Column of the regression that the balance is solved for: the acceleration of the driven channel, or the
        quantity of a servo's command where the regression has its column."""
        regression = self.search.regression
        driven_channel, channel_count = regression.base_terms.driven_channel, len(regression.motions[0].channels)
        column = (
            driven_channel
            if self.commanded_order is None
            else (2 - self.commanded_order) * channel_count + driven_channel
        )
        return column if column < regression.matrix_column_count else driven_channel

    def sum_errors_per_law(self, laws: Sequence[CommandLaw], motion_laws: Sequence[int]) -> list[float]:
        """Sum the cross-validated squared errors of each law (`sum_errors`)."""
        return cast(list[float], list(self.map_(partial(self.sum_errors, motion_laws=motion_laws), laws)))

    def sum_errors(self, law: CommandLaw, motion_laws: Sequence[int]) -> float:
        """Sum the cross-validated squared errors of one law. motion_laws: indices of laws of the motion fitted with
        it."""
        return float(self.evaluate_law(law, motion_laws, False).sum())

    def fit_lower_bound(self, law: CommandForce, motion_laws: Sequence[int]) -> float:
        """Compute the sum of squared errors on the fitted samples: about a lower bound for the laws it approximates."""
        fit_blocks, _ = self._build_blocks(self._build_regressors(law, motion_laws), False)
        products = [select_products(block, range(len(fit_blocks[0].cross))) for block in fit_blocks]
        weights = solve_normal_equations(sum_products(fit_blocks, range(len(fit_blocks[0].cross))), RIDGE)
        return sum(
            compute_squared_error(block_sums, weights, block.power)
            for block_sums, block in zip(products, fit_blocks, strict=True)
        )

    def evaluate_law(self, law: CommandLaw, motion_laws: Sequence[int], on_held_out: bool) -> FloatArray:
        """Compute (blocks,): sums of squared errors with one law. motion_laws: indices of laws of the motion.
        on_held_out: on the held-out blocks if they are a valid test (`select_test_blocks`); else on each block to fit,
        with weights fitted to the others (cross-validation)."""
        uses_held_out = on_held_out and select_test_blocks(self.search.regression) is self.search.regression.test
        fit_blocks, test_blocks = self._build_blocks(self._build_regressors(law, motion_laws), uses_held_out)
        columns = list(range(len(fit_blocks[0].cross)))
        total_products = sum_products(fit_blocks, columns)
        if uses_held_out:
            weights = solve_normal_equations(total_products, RIDGE)
            return np.array(
                [compute_squared_error(select_products(block, columns), weights, block.power) for block in test_blocks]
            )
        block_errors = []
        for block in fit_blocks:
            products = select_products(block, columns)
            block_errors.append(
                compute_squared_error(
                    products,
                    solve_normal_equations((total_products[0] - products[0], total_products[1] - products[1]), RIDGE),
                    block.power,
                )
            )
        return np.array(block_errors)

    def _build_blocks(
        self, regressors: Sequence[FloatArray], uses_held_out: bool
    ) -> tuple[tuple[Block, ...], tuple[Block, ...]]:
        """Build the blocks of samples to fit and those of held-out samples, which are none unless `uses_held_out`.
        regressors: (n, k) per motion."""
        regression, solved_column = self.search.regression, self.solved_column
        predicted = [columns[:, solved_column] for columns in regression.columns]
        moving_samples = list(zip(regression.motions, self._find_moving_samples(), strict=True))
        fit_masks = [motion.mask_valid_samples(motion.fit & is_moving) for motion, is_moving in moving_samples]
        mean = float(np.concatenate([target[mask] for target, mask in zip(predicted, fit_masks, strict=True)]).mean())
        scale_and_mean = compute_scale(regressors, fit_masks), mean
        fit_blocks = build_blocks(regressors, predicted, fit_masks, scale_and_mean)
        if not uses_held_out:
            return fit_blocks, ()
        test_masks = [motion.mask_valid_samples(motion.test & is_moving) for motion, is_moving in moving_samples]
        return fit_blocks, build_blocks(regressors, predicted, test_masks, scale_and_mean)

    def _find_moving_samples(self) -> list[Mask]:
        """Find the samples whose squared speed exceeds `STILL_SHARE` of its mean: masks (n,) per motion; all samples
        without friction."""
        regression = self.search.regression
        speeds = [motion.velocity[:, regression.base_terms.driven_channel] for motion in regression.motions]
        fit_velocity = np.concatenate(
            [speed[motion.fit] for speed, motion in zip(speeds, regression.motions, strict=True)]
        )
        least_squared_speed = STILL_SHARE * float(np.mean(fit_velocity**2)) if self.has_friction else -1.0
        return [speed**2 > least_squared_speed for speed in speeds]

    def _build_regressors(self, law: CommandForce, motion_laws: Sequence[int]) -> list[FloatArray]:
        """Build the regressors (n, columns) of each motion: the columns of the law, the time derivatives of its first
        `lag_column_count` columns, the other axes' commands, and the remaining columns of the base and of the laws of
        the motion."""
        regression, regressors = self.search.regression, []
        # Columns of the base that are filtered copies of the predicted quantity would reproduce it.
        excluded_columns = {
            self.solved_column,
            *range(regression.matrix_column_count, regression.base_column_count - 1),
        }
        law_columns = [column for column in regression.select_columns(motion_laws) if column not in excluded_columns]
        for motion, columns in zip(regression.motions, regression.columns, strict=True):
            force = law.compute_columns(
                motion.force[:, regression.axis], motion.position[:, regression.base_terms.driven_channel]
            )
            other_commands = np.delete(motion.force, regression.axis, axis=1)
            command_columns = np.hstack(
                [force, np.gradient(force[:, : law.lag_column_count], 1 / motion.rate_hz, axis=0), other_commands]
            )
            regressors.append(np.hstack([motion.decimate(command_columns), columns[:, law_columns]]))
        return regressors
