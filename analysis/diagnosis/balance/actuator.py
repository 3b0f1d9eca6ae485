"""Nonlinear laws of the actuator (dead band, saturation, curvature), found with the force balance inverted.

A law of the command cannot be a column beside the commanded force, for the command would stand on both sides and take
the noise of the motion on itself. Solved for the acceleration, the command is known exactly:

    a = g(u) / m - (c v + k x + sum of w phi) / m

with the command's rate of change beside it, for a short lag. g(u) is tried in place of u, with the best sums of laws
of the motion beside it, and is named where it takes most of what any of them leaves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import cast

import numpy as np

from analysis.diagnosis.balance.blocks import (
    RIDGE,
    Block,
    block_products,
    blocks_of,
    column_scale,
    solve_normal_equations,
    squared_error,
    summed_products,
)
from analysis.diagnosis.balance.command_laws import AS_COMMANDED, CommandLaw, coil_laws, command_laws, neighbours_of
from analysis.diagnosis.balance.judge_laws import MOST_ALIKE, Balance, blocks_to_judge, judge_laws
from analysis.diagnosis.balance.judged_law import JudgedLaw, bootstrap_draws, gain_with_bound
from analysis.diagnosis.balance.law import Law
from analysis.diagnosis.balance.linear_part import search_beside_linear
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.balance.plainest_structure import NOTABLE
from analysis.diagnosis.balance.regression import Regression
from analysis.diagnosis.balance.structures import SLIDING, StructureSearch
from analysis.diagnosis.settings import STILL_SHARE
from analysis.diagnosis.types import Mapper, Mask, TimeBudget
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.signals.signal import FloatArray

SUMS = 4
"""Best sums of laws of the motion that are tried beside a law of the command."""
MOST = 0.5
"""Share of the error that the best sum of laws of the motion leaves which a law of the command must take: what lag and
delay leave is smaller."""
TOLD = 0.3
"""Share of its own error by which a rival must leave more to be told from it."""
ROUNDS = 8
NEEDLESS = "a law of the command leaves as little without it"
HOLDS_AT_REST = (*SLIDING, "presliding_hysteresis")
NO_COLUMN = -1
"""Place in a regression of a law that changes the force itself."""


@dataclass(frozen=True, slots=True, eq=False)
class _InverseBalance:
    """A balance solved for the acceleration along its axis."""

    search: StructureSearch
    map_: Mapper
    rubs: bool
    """Whether a friction is among the laws of the motion: rest is no evidence then, for friction holds any force up to
    its level there, and a dead band gives none."""

    def total_errors(self, laws: Sequence[CommandLaw], beside: Sequence[int]) -> list[float]:
        """Of each law: its cross-validated sum of squares."""
        return cast(list[float], list(self.map_(partial(self.total_error, beside=beside), laws)))

    def total_error(self, law: CommandLaw, beside: Sequence[int]) -> float:
        return float(self.errors(law, beside, False).sum())

    def errors(self, law: CommandLaw, laws: Sequence[int], judged: bool) -> FloatArray:
        """(blocks,): sums of squares. judged: on what nothing was fitted to; else each fold's."""
        fit, test = self._blocks(self._rows(law, laws))
        columns = list(range(len(fit[0].pull)))
        whole = summed_products(fit, columns)
        if judged and blocks_to_judge(self.search.regression) is self.search.regression.test:
            weights = solve_normal_equations(whole, RIDGE)
            return np.array([squared_error(block_products(block, columns), weights, block.power) for block in test])
        found = []
        for block in fit:
            own = block_products(block, columns)
            found.append(
                squared_error(own, solve_normal_equations((whole[0] - own[0], whole[1] - own[1]), RIDGE), block.power)
            )
        return np.array(found)

    def _blocks(self, rows: Sequence[FloatArray]) -> tuple[tuple[Block, ...], tuple[Block, ...]]:
        regression = self.search.regression
        motions, own = regression.motions, regression.beside.own
        aims = [columns[:, own] for columns in regression.columns]
        fit, test = (
            [motion.valid_samples(mask & moves) for motion, mask, moves in zip(motions, masks, moving, strict=True)]
            for moving in [self._moving()]
            for masks in ([m.fit for m in motions], [m.test for m in motions])
        )
        mean = float(np.concatenate([aim[mask] for aim, mask in zip(aims, fit, strict=True)]).mean())
        units = column_scale(rows, fit), mean
        return blocks_of(rows, aims, fit, units), blocks_of(rows, aims, test, units)

    def _moving(self) -> list[Mask]:
        """(n,) per motion: samples that are evidence."""
        regression = self.search.regression
        speeds = [motion.velocity[:, regression.beside.own] for motion in regression.motions]
        used = np.concatenate([speed[motion.fit] for speed, motion in zip(speeds, regression.motions, strict=True)])
        least = STILL_SHARE * float(np.mean(used**2)) if self.rubs else -1.0
        return [speed**2 > least for speed in speeds]

    def _rows(self, law: CommandLaw, laws: Sequence[int]) -> list[FloatArray]:
        regression, found = self.search.regression, []
        # Filters of the acceleration would give it back.
        filters = {regression.beside.own, *range(regression.matrices, regression.base - 1)}
        beside = [column for column in regression.columns_of(laws) if column not in filters]
        for motion, columns in zip(regression.motions, regression.columns, strict=True):
            force = law.of(motion.force[:, regression.axis], motion.position[:, regression.beside.own])
            others = np.delete(motion.force, regression.axis, axis=1)
            entered = np.hstack([force, np.gradient(force[:, :1], 1 / motion.rate_hz, axis=0), others])
            found.append(np.hstack([motion.decimate(entered), columns[:, beside]]))
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Actuator:
    """The law of the command that fits best, and its test on held-out data."""

    law: CommandLaw
    judged: JudgedLaw
    alone: bool
    """Without laws of the motion, it leaves as little."""
    instead: bool = False
    """By itself it leaves less than the named laws of the motion."""


def find_balance(
    motions: Sequence[Motion],
    axis: int,
    rotational: bool,
    without: frozenset[str],
    time_left: TimeBudget,
    map_: Mapper = map,
) -> Balance:
    """The balance of one axis: laws of the motion and, where one earns it, a law of the command, through which the
    commanded force is then passed before the laws of the motion are searched again."""
    balance = judge_laws(search_beside_linear(motions, axis, rotational, without, time_left))
    actuator = find_actuator(balance, rotational, without, map_) if balance.tested else None
    if actuator is None:
        return balance
    judged = actuator.judged
    if judged.named:
        own = balance.search.regression.beside.own
        through = [_pass_through_law(motion, axis, own, actuator.law) for motion in motions]
        again = judge_laws(search_beside_linear(through, axis, rotational, without, time_left))
        return replace(again, laws=(judged, *again.laws), linear=balance.linear)
    if judged.gain_low <= 0 or judged.gain < NOTABLE:
        return balance
    if judged.gain < MOST and not actuator.instead:
        return replace(balance, others=tuple(sorted((*balance.others, judged), key=lambda each: -each.gain)))
    laws = (
        [replace(each, why_not=each.why_not or NEEDLESS) for each in balance.laws] if actuator.alone else balance.laws
    )
    return replace(balance, laws=(judged, *laws))


def _pass_through_law(motion: Motion, axis: int, own: int, law: CommandLaw) -> Motion:
    force = motion.force.copy()
    force[:, [axis]] = law.of(force[:, axis], motion.position[:, own])
    return replace(motion, force=force)


def find_actuator(balance: Balance, rotational: bool, without: frozenset[str], map_: Mapper = map) -> Actuator | None:
    """The law of the command that leaves the smallest error; None where the balance has no clock, no command varies,
    or no law of the command is allowed."""
    search = balance.search
    regression = search.regression
    commands = np.concatenate([motion.force[motion.fit, regression.axis] for motion in regression.motions])
    known = [*command_laws(commands), *(() if rotational else _laws_of_coils(regression))]
    laws = [law for law in known if law.effect not in without]
    if not np.isfinite(regression.motions[0].band_hz) or not laws or not np.any(commands):
        return None
    turned = _InverseBalance(
        search, map_, any(each.law.effect in HOLDS_AT_REST and each.gain_low > 0 for each in balance.laws)
    )
    instead = _in_place_of_motion(turned, laws, tuple(each.place for each in balance.named))
    if instead is not None:
        return instead
    beside = min(_sums_to_try(search), key=lambda each: turned.total_error(AS_COMMANDED, each))
    best = _best_of_each(turned, laws, beside)
    law = min(best, key=lambda each: each[0])[1]
    alone, held = (turned.total_error(law, each) for each in ((), beside))
    rivals = [other for _, other in best if other is not law]
    law = _scaled_to_command(law, search.regression)
    judged = _judge_law(turned, law, rivals, (beside, beside))
    return Actuator(law, judged, bool(beside) and alone <= held / (1 - TOLD))


def _laws_of_coils(regression: Regression) -> tuple[CommandLaw, ...]:
    """Empty where no position was measured."""
    if regression.motions[0].order > 0:
        return ()
    own = regression.beside.own
    return tuple(coil_laws(np.concatenate([motion.position[motion.fit, own] for motion in regression.motions])))


def _in_place_of_motion(turned: _InverseBalance, laws: Sequence[CommandLaw], named: tuple[int, ...]) -> Actuator | None:
    """A law of the command that by itself takes most of what the named laws of the motion leave, or leaves less than
    several of them: they took its part, as a drag does that of an actuator whose gain falls."""
    if not named:
        return None
    best = _best_of_each(turned, laws, ())
    law = min(best, key=lambda each: each[0])[1]
    rivals = [other for _, other in best if other is not law]
    law = _scaled_to_command(law, turned.search.regression)
    judged = _judge_law(turned, law, rivals, (named, ()))
    less = judged.gain >= MOST or len(named) > 1
    return Actuator(law, judged, True, True) if less and judged.gain_low > 0 else None


def _scaled_to_command(law: CommandLaw, regression: Regression) -> CommandLaw:
    motions, own = regression.motions, regression.beside.own
    command = np.concatenate([motion.force[motion.fit, regression.axis] for motion in motions])
    return law.scaled_to(command, np.concatenate([motion.position[motion.fit, own] for motion in motions]))


def _sums_to_try(search: StructureSearch) -> list[tuple[int, ...]]:
    """No law that is linear in the motion: such a filter of the acceleration would give it back."""
    laws = search.regression.laws
    plain = [each.laws for each in search.ranked if each.laws and not any(laws[k].linear for k in each.laws)]
    return [(), *plain[:SUMS]]


def _best_of_each(
    turned: _InverseBalance, laws: Sequence[CommandLaw], beside: tuple[int, ...]
) -> list[tuple[float, CommandLaw]]:
    best: dict[str, tuple[float, CommandLaw]] = {}
    for law, error in zip(laws, turned.total_errors(laws, beside), strict=True):
        if law.effect not in best or error < best[law.effect][0]:
            best[law.effect] = error, law
    moved = cast(
        list[tuple[float, dict[str, float]]], list(turned.map_(partial(_refined_values, turned, beside), best.values()))
    )
    refined = [
        (error, replace(law, values=values)) for (_, law), (error, values) in zip(best.values(), moved, strict=True)
    ]
    plain = min((error for error, law in refined if not law.rich), default=np.inf)
    return [(error, law) for error, law in refined if not law.rich or error < (1 - TOLD) * plain]


def _refined_values(
    turned: _InverseBalance, beside: tuple[int, ...], found: tuple[float, CommandLaw]
) -> tuple[float, dict[str, float]]:
    """Error and numbers of a law after moving each number for as long as that helps."""
    error, law = found
    for _ in range(ROUNDS):
        tried = [(turned.total_error(other, beside), other) for other in neighbours_of(law)]
        if not tried or min(tried, key=lambda each: each[0])[0] >= error * (1 - 1e-3):
            break
        error, law = min(tried, key=lambda each: each[0])
    return error, law.values


def _judge_law(
    turned: _InverseBalance,
    law: CommandLaw,
    rivals: Sequence[CommandLaw],
    sums: tuple[tuple[int, ...], tuple[int, ...]],
) -> JudgedLaw:
    """sums: laws of the motion beside the command as it is, and beside what the law makes of it."""
    plain, beside = sums
    without, held = turned.errors(AS_COMMANDED, plain, True), turned.errors(law, beside, True)
    linear = float(turned.errors(AS_COMMANDED, (), True).sum())
    drawn = bootstrap_draws(len(held))
    behind = [(turned.errors(rival, beside, True), rival.effect) for rival in rivals]
    alike = tuple(effect for errors, effect in behind if float(errors.sum()) <= float(held.sum()) / (1 - TOLD))
    first = [errors[drawn].sum(axis=1) >= held[drawn].sum(axis=1) for errors, _ in behind]
    gain, low = gain_with_bound(without, held)
    known = Law(law.effect, turned.search.regression.axis, (), lambda m, _: m.force, lambda w, n, mass: None)
    return JudgedLaw(
        NO_COLUMN, known, dict(law.values), gain, low, float((without - held).sum()) / max(linear, 1e-300), alike,
        float(np.mean(np.all(first, axis=0))) if first else 1.0, _why_not(law, gain, low, alike),
        formula=law.as_formula(),
    )  # fmt: skip


def _why_not(law: CommandLaw, gain: float, low: float, alike: tuple[str, ...]) -> str:
    """A sentence; empty where it is to be named."""
    if gain < MOST or low <= 0:
        return (
            f"in the command's place it takes {100 * max(gain, 0.0):.0f} % of what laws of the motion leave, not most"
        )
    # A curve of the command and a pull that changes with the distance are different physics.
    strange = [effect for effect in alike if effect not in EFFECTS_BY_NAME or law.pull is not None]
    if strange or len(alike) >= MOST_ALIKE:
        return f"these data cannot tell it from {', '.join(alike)}"
    return "" if law.effect in EFFECTS_BY_NAME or law.formula else "no simulation of ours plays it yet"
