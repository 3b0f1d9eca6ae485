"""Nonlinear laws of the actuator (dead band, saturation, curvature), found with the force balance inverted.

A law of the command cannot be a column of a regression of the commanded force, because the command would then be on
both sides and absorb the noise of the motion. In the balance solved for the acceleration, the command is a regressor
without noise:

    a = g(u) / m - (c v + k x + sum of w phi) / m

with the command's rate of change beside it, for a short lag. g(u) is tried in place of u, together with the best sums
of laws of the motion, and is named where it explains most of their residual.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import cast

import numpy as np

from analysis.diagnosis.balance.command_laws import (
    AS_COMMANDED,
    CommandLaw,
    PiecewiseCommandLaw,
    coil_laws,
    command_laws,
    neighbours_of,
    piecewise_curve,
    piecewise_pull,
    slew_laws,
)
from analysis.diagnosis.balance.inverse_balance import InverseBalance
from analysis.diagnosis.balance.judge_laws import Balance, judge_laws
from analysis.diagnosis.balance.judged_law import NO_COLUMN, JudgedLaw
from analysis.diagnosis.balance.law import Law
from analysis.diagnosis.balance.linear_part import search_beside_linear
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.balance.regression import Regression
from analysis.diagnosis.balance.structures import SLIDING, StructureSearch
from analysis.diagnosis.data.correlated_residuals import bootstrap_draws, gain_with_bound
from analysis.diagnosis.settings import (
    COMMAND_LAW_LEAVES,
    COMMAND_RIVAL_LEAVES_MORE,
    FURTHER_LAW_OF_ALL,
    LARGEST_CLASS,
    SUMS_BESIDE_COMMAND_LAW,
)
from analysis.diagnosis.types import Mapper, TimeBudget
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME

ROUNDS = 8
"""Most passes of the coordinate search over a law's nonlinear parameters."""
NEEDLESS = "a law of the command reaches as small an error without it"
CURVED = "quadratic_damping"
"""Law of the motion that resembles an actuator's curve when the speed follows the command."""
HOLDS_AT_REST = (*SLIDING, "presliding_hysteresis")


@dataclass(frozen=True, slots=True, eq=False)
class Actuator:
    """The law of the command that fits best, and its test on held-out data."""

    law: CommandLaw
    judged: JudgedLaw
    alone: bool
    """Whether its error is as small without laws of the motion."""
    instead: bool = False
    """Whether its error alone is smaller than that of the named laws of the motion."""
    suffices: bool = False
    """Whether its error alone is no larger than that of the best sum of laws of the motion with the unchanged
    command."""


@dataclass(frozen=True, slots=True)
class DrivenAxis:
    """An axis whose command is examined: its number, its kind, and what the command sets."""

    number: int
    rotational: bool
    target: int | None = None
    """Order of the position's time derivative that the command sets (target of a servo); None = it is a force."""


def find_balance(
    motions: Sequence[Motion],
    driven: DrivenAxis,
    without: frozenset[str],
    time_left: TimeBudget,
    map_: Mapper = map,
) -> Balance:
    """The balance of one axis: laws of the motion and, where it is significant, a law of the command, through which the
    commanded force is then passed before the laws of the motion are searched again."""
    axis, rotational = driven.number, driven.rotational
    balance = judge_laws(search_beside_linear(motions, axis, rotational, without, time_left))
    actuator = find_actuator(balance, driven, without, map_) if balance.tested else None
    if actuator is None:
        return balance
    judged = actuator.judged
    if judged.named:
        own = balance.search.regression.beside.own
        through = [_pass_through_law(motion, axis, own, actuator.law) for motion in motions]
        again = judge_laws(search_beside_linear(through, axis, rotational, without, time_left))
        return replace(again, laws=(judged, *again.laws), linear=balance.linear)
    if judged.gain_low <= 0 or judged.gain < FURTHER_LAW_OF_ALL:
        return balance
    if judged.gain < COMMAND_LAW_LEAVES and not actuator.instead:
        kept = tuple(_unless_curved(law, actuator) for law in balance.laws)
        others = tuple(sorted((*balance.others, judged), key=lambda each: -each.gain))
        return replace(balance, laws=kept, others=others)
    laws = (
        [replace(each, why_not=each.why_not or NEEDLESS) for each in balance.laws] if actuator.alone else balance.laws
    )
    return replace(balance, laws=(judged, *laws))


def _unless_curved(law: JudgedLaw, actuator: Actuator) -> JudgedLaw:
    needless = law.named and law.law.effect == CURVED and actuator.suffices
    return replace(law, why_not=NEEDLESS) if needless else law


def _pass_through_law(motion: Motion, axis: int, own: int, law: CommandLaw) -> Motion:
    force = motion.force.copy()
    force[:, [axis]] = law.of(force[:, axis], motion.position[:, own])
    return replace(motion, force=force)


def find_actuator(balance: Balance, driven: DrivenAxis, without: frozenset[str], map_: Mapper = map) -> Actuator | None:
    """The law of the command with the smallest error; None where the balance has no time axis, no command varies, no
    law of the command is allowed, or none can explain enough."""
    search, target = balance.search, driven.target
    # A limited rate is tried for servo targets only: for forces, hardening springs and friction resemble it.
    barred = without if target is not None else without | {"slew_limit"}
    kinds = _kinds_of_laws(search.regression, driven.rotational, barred)
    if not np.isfinite(search.regression.motions[0].band_hz) or not kinds:
        return None
    turned = InverseBalance(
        search, map_, any(each.law.effect in HOLDS_AT_REST and each.gain_low > 0 for each in balance.laws), target
    )
    instead = _replace_motion_laws(turned, kinds, tuple(each.place for each in balance.named))
    if instead is not None:
        return instead
    # Laws of the position are left out where the balance is solved for it: they would reproduce it.
    sums = _sums_to_try(search) if target is None else [()]
    plain, beside = min((turned.total_error(AS_COMMANDED, each), each) for each in sums)
    laws = _worth_trying(turned, kinds, (1 - FURTHER_LAW_OF_ALL / 2) * plain, beside)
    if not laws:
        return None
    best = _best_of_each(turned, laws, beside)
    law = min(best, key=lambda each: each[0])[1]
    alone, held = (turned.total_error(law, each) for each in ((), beside))
    rivals = [other for _, other in best if other is not law]
    law = _scale_to_command(law, search.regression)
    judged = _judge_law(turned, law, rivals, (beside, beside))
    as_little = alone <= held / (1 - COMMAND_RIVAL_LEAVES_MORE)
    return Actuator(law, judged, bool(beside) and as_little, suffices=as_little and alone <= plain)


Kinds = Sequence[tuple[PiecewiseCommandLaw | None, Sequence[CommandLaw]]]
"""Laws of the command of one kind, and a sum of functions that approximates each of them; None = there is none."""


def _kinds_of_laws(regression: Regression, rotational: bool, without: frozenset[str]) -> Kinds:
    """Kinds of laws to try. Those of coils need the measured position of a translation. Empty where no command
    varies."""
    motions, own = regression.motions, regression.beside.own
    command = np.concatenate([motion.force[motion.fit, regression.axis] for motion in motions])
    if not np.any(command):
        return ()
    whole = [motion.force[:, regression.axis] for motion in motions]
    kinds: list[tuple[PiecewiseCommandLaw | None, list[CommandLaw]]] = [
        (piecewise_curve(command), list(command_laws(command))),
        (None, list(slew_laws(whole, motions[0].rate_hz))),
    ]
    if motions[0].order == 0 and not rotational:
        position = np.concatenate([motion.position[motion.fit, own] for motion in motions])
        kinds.append((piecewise_pull(position), list(coil_laws(position))))
    allowed = [(near, [law for law in laws if law.effect not in without]) for near, laws in kinds]
    return [kind for kind in allowed if kind[1]]


def _worth_trying(turned: InverseBalance, kinds: Kinds, most: float, beside: tuple[int, ...]) -> list[CommandLaw]:
    """Laws of those kinds whose approximating sum has an error of at most `most` on the samples that it is fitted to:
    the laws of other kinds need not be tried one by one."""
    return [law for near, laws in kinds if near is None or turned.least_error(near, beside) <= most for law in laws]


def _replace_motion_laws(turned: InverseBalance, kinds: Kinds, named: tuple[int, ...]) -> Actuator | None:
    """Whether a law of the command alone explains most of the residual of the named laws of the motion, or has a
    smaller error than several of them: they had compensated for it, as a drag does for an actuator whose gain falls."""
    if not named:
        return None
    # Half of the gain required below, because the sums only approximate the laws.
    share = 1 - COMMAND_LAW_LEAVES / 2 if len(named) == 1 else 1 / (1 - COMMAND_RIVAL_LEAVES_MORE)
    most = share * turned.total_error(AS_COMMANDED, named)
    laws = _worth_trying(turned, kinds, most, ())
    if not laws:
        return None
    best = _best_of_each(turned, laws, ())
    law = min(best, key=lambda each: each[0])[1]
    rivals = [other for _, other in best if other is not law]
    law = _scale_to_command(law, turned.search.regression)
    judged = _judge_law(turned, law, rivals, (named, ()))
    less = judged.gain >= COMMAND_LAW_LEAVES or len(named) > 1
    return Actuator(law, judged, True, True) if less and judged.gain_low > 0 else None


def _scale_to_command(law: CommandLaw, regression: Regression) -> CommandLaw:
    motions, own = regression.motions, regression.beside.own
    command = np.concatenate([motion.force[motion.fit, regression.axis] for motion in motions])
    return law.scale_to(command, np.concatenate([motion.position[motion.fit, own] for motion in motions]))


def _sums_to_try(search: StructureSearch) -> list[tuple[int, ...]]:
    """Laws that are linear in the motion are left out: filters of the acceleration would reproduce it."""
    laws = search.regression.laws
    plain = [each.laws for each in search.ranked if each.laws and not any(laws[k].linear for k in each.laws)]
    return [(), *plain[:SUMS_BESIDE_COMMAND_LAW]]


def _best_of_each(
    turned: InverseBalance, laws: Sequence[CommandLaw], beside: tuple[int, ...]
) -> list[tuple[float, CommandLaw]]:
    best: dict[str, tuple[float, CommandLaw]] = {}
    for law, error in zip(laws, turned.total_errors(laws, beside), strict=True):
        if law.effect not in best or error < best[law.effect][0]:
            best[law.effect] = error, law
    moved = cast(
        list[tuple[float, dict[str, float]]], list(turned.map_(partial(_refine_values, turned, beside), best.values()))
    )
    refined = [
        (error, replace(law, values=values)) for (_, law), (error, values) in zip(best.values(), moved, strict=True)
    ]
    plain = min((error for error, law in refined if not law.flexible), default=np.inf)
    return [
        (error, law) for error, law in refined if not law.flexible or error < (1 - COMMAND_RIVAL_LEAVES_MORE) * plain
    ]


def _refine_values(
    turned: InverseBalance, beside: tuple[int, ...], found: tuple[float, CommandLaw]
) -> tuple[float, dict[str, float]]:
    """Error and parameters of a law after a coordinate search over its parameters."""
    error, law = found
    for _ in range(ROUNDS):
        tried = [(turned.total_error(other, beside), other) for other in neighbours_of(law)]
        if not tried or min(tried, key=lambda each: each[0])[0] >= error * (1 - 1e-3):
            break
        error, law = min(tried, key=lambda each: each[0])
    return error, law.values


def _judge_law(
    turned: InverseBalance,
    law: CommandLaw,
    rivals: Sequence[CommandLaw],
    sums: tuple[tuple[int, ...], tuple[int, ...]],
) -> JudgedLaw:
    """sums: laws of the motion beside the unchanged command, and beside the command after the law."""
    plain, beside = sums
    without, held = turned.errors(AS_COMMANDED, plain, True), turned.errors(law, beside, True)
    linear = float(turned.errors(AS_COMMANDED, (), True).sum())
    drawn = bootstrap_draws(len(held))
    behind = [(turned.errors(rival, beside, True), rival.effect) for rival in rivals]
    most = float(held.sum()) / (1 - COMMAND_RIVAL_LEAVES_MORE)
    alike = tuple(effect for errors, effect in behind if float(errors.sum()) <= most)
    first = [errors[drawn].sum(axis=1) >= held[drawn].sum(axis=1) for errors, _ in behind]
    gain, low = gain_with_bound(without, held)
    known = Law(law.effect, turned.search.regression.axis, (), lambda m, _: m.force, lambda w, n, mass: None)
    return JudgedLaw(
        NO_COLUMN, known, dict(law.values), gain, low, float((without - held).sum()) / max(linear, 1e-300), alike,
        float(np.mean(np.all(first, axis=0))) if first else 1.0, _why_not(law, gain, low, alike),
        formula=law.as_formula(),
    )  # fmt: skip


def _why_not(law: CommandLaw, gain: float, low: float, alike: tuple[str, ...]) -> str:
    """Reason not to name the law, as a sentence; empty where it is to be named."""
    if gain < COMMAND_LAW_LEAVES or low <= 0:
        return (
            f"in place of the command it explains {100 * max(gain, 0.0):.0f} % of the error that laws of the motion "
            "leave, and not most of it"
        )
    # A curve of the command and a force that changes with the distance are different physics.
    different = [effect for effect in alike if effect not in EFFECTS_BY_NAME or law.factor_at is not None]
    if different or len(alike) >= LARGEST_CLASS:
        return f"these data cannot distinguish it from {', '.join(alike)}"
    return "" if law.effect in EFFECTS_BY_NAME or law.formula else "hapteq cannot simulate it yet"
