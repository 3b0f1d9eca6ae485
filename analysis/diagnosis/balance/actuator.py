"""Laws of the actuator (such as dead band, saturation and curvature), found with the force balance inverted.

A law of the command would reproduce the command as a column of its regression. In the balance solved for the
acceleration, the command is a regressor without noise:

    a = (g(u) - B v - K x - sum of w phi) / M

with the command's rate of change as a further regressor, for a short lag. g(u) is tried in place of u, together with
the best sums of laws of the motion, and is named only where it explains most of their residual. Called by `balances`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import cast

import numpy as np

from analysis.diagnosis.balance.actuator_equivalents import ONE_BODY_REASON, halves_one_body_error
from analysis.diagnosis.balance.inverse_balance import InverseBalance
from analysis.diagnosis.balance.judge_laws import Balance, judge_laws
from analysis.diagnosis.balance.judged_law import NO_COLUMN, JudgedLaw
from analysis.diagnosis.balance.laws.command_laws import (
    IDEAL_ACTUATOR,
    CommandLaw,
    PiecewiseCommandLaw,
    make_command_laws,
    make_electromagnet_laws,
    make_piecewise_attraction,
    make_piecewise_curve,
    make_slew_laws,
    vary_parameters,
)
from analysis.diagnosis.balance.laws.law import Law
from analysis.diagnosis.balance.linear_part import search_with_linear_part
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.balance.regression import Regression
from analysis.diagnosis.balance.structures import SLIDING, StructureSearch
from analysis.diagnosis.data.correlated_residuals import bootstrap_gain, draw_bootstrap_blocks
from analysis.diagnosis.limits import (
    COMMAND_LAW_GAIN,
    COMMAND_RIVAL_MARGIN,
    FURTHER_LAW_SHARE,
    LARGEST_CLASS,
    SUMS_BESIDE_COMMAND_LAW,
)
from analysis.diagnosis.types import Mapper, TimeBudget
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME

MOST_PASSES = 8
"""Largest number of passes of the coordinate search over a law's parameters; chosen by hand."""
UNNECESSARY_REASON = "a law of the command reaches as small an error without it"
"""Objection to a law of the motion."""
CURVE_LIKE_LAW = "quadratic_damping"
"""Law of the motion that resembles an actuator's curve when the speed follows the command."""
HOLDING_LAWS = (*SLIDING, "presliding_hysteresis")
"""Laws with a friction that balances any small force at rest."""


@dataclass(frozen=True, slots=True, eq=False)
class ActuatorFit:
    """The law of the command that fits best, with its test and comparisons with laws of the motion."""

    law: CommandLaw
    judged_law: JudgedLaw
    needs_no_motion_law: bool
    """Whether there are laws of the motion, and its error is about as small without them."""
    replaces_motion_laws: bool = False
    """Whether its error alone is smaller than that of the laws of the motion named before."""
    suffices: bool = False
    """Whether its error alone is about as small as with laws of the motion, and not larger than that of these alone;
    not examined where it replaces them."""


@dataclass(frozen=True, slots=True)
class DrivenAxis:
    """An axis whose command is examined: its index, its kind, and what the command sets."""

    index: int
    rotational: bool
    target: int | None = None
    """Order of the position's time derivative that the command sets (target of a servo); None = it is a force."""


def find_balance(
    motions: Sequence[Motion], driven: DrivenAxis, excluded: frozenset[str], time_left: TimeBudget, map_: Mapper = map
) -> Balance:
    """Find the balance of one axis: laws of the motion and, where significant, a law of the command. With a named one,
    the laws of the motion are searched again for the force that it gives; that must halve the error of one body."""
    axis, rotational = driven.index, driven.rotational
    balance = judge_laws(search_with_linear_part(motions, axis, rotational, excluded, time_left))
    actuator = find_command_law(balance, driven, excluded, map_) if balance.tested and time_left() else None
    if actuator is None:
        return balance
    judged_law = actuator.judged_law
    if judged_law.named:
        driven_channel = balance.search.regression.base_terms.driven_channel
        passed_motions = [_pass_through_law(motion, axis, driven_channel, actuator.law) for motion in motions]
        second_balance = judge_laws(search_with_linear_part(passed_motions, axis, rotational, excluded, time_left))
        if driven.target is not None or halves_one_body_error(balance, second_balance):
            return replace(second_balance, laws=(judged_law, *second_balance.laws), linear_error=balance.linear_error)
        judged_law = replace(judged_law, objection=ONE_BODY_REASON)
    if judged_law.gain_low <= 0 or judged_law.gain < FURTHER_LAW_SHARE:
        return balance
    if judged_law.gain < COMMAND_LAW_GAIN and not actuator.replaces_motion_laws:
        judged_motion_laws = tuple(_withdraw_if_curved(law, actuator) for law in balance.laws)
        further_laws = tuple(sorted((*balance.further_laws, judged_law), key=lambda item: -item.gain))
        return replace(balance, laws=judged_motion_laws, further_laws=further_laws)
    reason = UNNECESSARY_REASON if actuator.needs_no_motion_law else ""
    motion_laws = tuple(replace(law, objection=law.objection or reason) for law in balance.laws)
    return replace(balance, laws=(judged_law, *motion_laws))


def _withdraw_if_curved(law: JudgedLaw, actuator: ActuatorFit) -> JudgedLaw:
    """Object to a named law that resembles an actuator's curve, where the law of the command suffices without it."""
    is_unnecessary = law.named and law.law.effect == CURVE_LIKE_LAW and actuator.suffices
    return replace(law, objection=UNNECESSARY_REASON) if is_unnecessary else law


def _pass_through_law(motion: Motion, axis: int, driven_channel: int, law: CommandLaw) -> Motion:
    """Replace the command of an axis by the force that the law gives."""
    force = motion.force.copy()
    force[:, [axis]] = law.compute_columns(force[:, axis], motion.position[:, driven_channel])
    return replace(motion, force=force)


def find_command_law(
    balance: Balance, driven: DrivenAxis, excluded: frozenset[str], map_: Mapper = map
) -> ActuatorFit | None:
    """Find the law of the command with the smallest error; None where the balance has no time axis, the command is
    zero, no law of the command is allowed, or none can explain enough."""
    search, target = balance.search, driven.target
    # A limited rate is tried for servo targets only: for forces, hardening springs and friction resemble it.
    excluded_effects = excluded if target is not None else excluded | {"slew_limit"}
    kinds = _list_law_kinds(search.regression, driven.rotational, excluded_effects)
    if not np.isfinite(search.regression.motions[0].band_hz) or not kinds:
        return None
    inverse = InverseBalance(
        search, map_, any(judged.law.effect in HOLDING_LAWS and judged.gain_low > 0 for judged in balance.laws), target
    )
    replacement = _replace_motion_laws(inverse, kinds, tuple(named_law.law_index for named_law in balance.named))
    if replacement is not None:
        return replacement
    # For a servo no laws of the motion are tried: those of the quantity that is solved for would reproduce it.
    sums = _list_sums(search) if target is None else [()]
    unchanged_error, motion_laws = min((inverse.sum_errors(IDEAL_ACTUATOR, law_sum), law_sum) for law_sum in sums)
    laws = _select_promising(inverse, kinds, (1 - FURTHER_LAW_SHARE / 2) * unchanged_error, motion_laws)
    if not laws:
        return None
    best_laws = _refine_best_per_effect(inverse, laws, motion_laws)
    law, *rivals = (candidate_law for _, candidate_law in sorted(best_laws, key=lambda candidate: candidate[0]))
    error_alone, error_with_laws = (inverse.sum_errors(law, law_sum) for law_sum in ((), motion_laws))
    law = _scale_to_command(law, search.regression)
    judged_law = _judge_law(inverse, law, rivals, (motion_laws, motion_laws))
    is_as_small = error_alone <= error_with_laws / (1 - COMMAND_RIVAL_MARGIN)
    return ActuatorFit(
        law, judged_law, bool(motion_laws) and is_as_small, suffices=is_as_small and error_alone <= unchanged_error
    )


LawKinds = Sequence[tuple[PiecewiseCommandLaw | None, Sequence[CommandLaw]]]
"""By kind: a sum of functions that approximates each law of the kind (None without one), and the laws."""


def _list_law_kinds(regression: Regression, rotational: bool, excluded: frozenset[str]) -> LawKinds:
    """List the kinds of laws to try: magnets only with measured translational positions; none for a zero command."""
    motions, driven_channel = regression.motions, regression.base_terms.driven_channel
    command = np.concatenate([motion.force[motion.fit, regression.axis] for motion in motions])
    if not np.any(command):
        return ()
    commands = [motion.force[:, regression.axis] for motion in motions]
    kinds: list[tuple[PiecewiseCommandLaw | None, list[CommandLaw]]] = [
        (make_piecewise_curve(command), list(make_command_laws(command))),
        (None, list(make_slew_laws(commands, motions[0].rate_hz))),
    ]
    if motions[0].order == 0 and not rotational:
        position = np.concatenate([motion.position[motion.fit, driven_channel] for motion in motions])
        kinds.append((make_piecewise_attraction(position), list(make_electromagnet_laws(position))))
    allowed = [(approximation, [law for law in laws if law.effect not in excluded]) for approximation, laws in kinds]
    return [kind for kind in allowed if kind[1]]


def _select_promising(
    inverse: InverseBalance, kinds: LawKinds, limit: float, motion_laws: tuple[int, ...]
) -> list[CommandLaw]:
    """Select the laws of those kinds whose approximating sum has an error of at most `limit` on the samples that it is
    fitted to, and of kinds without such a sum: other laws need not be tried one by one."""
    return [
        law
        for approximation, laws in kinds
        if approximation is None or inverse.fit_lower_bound(approximation, motion_laws) <= limit
        for law in laws
    ]


def _replace_motion_laws(inverse: InverseBalance, kinds: LawKinds, named_laws: tuple[int, ...]) -> ActuatorFit | None:
    """Find a law of the command that alone explains most of the residual of the named law of the motion, or has a
    smaller error than several, which had compensated for it, as a drag does for a falling gain; else None."""
    if not named_laws:
        return None
    # For one law half of the gain required below, because the sums only approximate the laws.
    error_share = 1 - COMMAND_LAW_GAIN / 2 if len(named_laws) == 1 else 1 / (1 - COMMAND_RIVAL_MARGIN)
    largest_error = error_share * inverse.sum_errors(IDEAL_ACTUATOR, named_laws)
    laws = _select_promising(inverse, kinds, largest_error, ())
    if not laws:
        return None
    best_laws = _refine_best_per_effect(inverse, laws, ())
    law, *rivals = (candidate_law for _, candidate_law in sorted(best_laws, key=lambda candidate: candidate[0]))
    law = _scale_to_command(law, inverse.search.regression)
    judged_law = _judge_law(inverse, law, rivals, (named_laws, ()))
    explains_more = judged_law.gain >= COMMAND_LAW_GAIN or len(named_laws) > 1
    return ActuatorFit(law, judged_law, True, True) if explains_more and judged_law.gain_low > 0 else None


def _scale_to_command(law: CommandLaw, regression: Regression) -> CommandLaw:
    """Scale the force of a law with a formula to the command (`CommandLaw.scale_to`), on the samples to fit."""
    motions, driven_channel = regression.motions, regression.base_terms.driven_channel
    command = np.concatenate([motion.force[motion.fit, regression.axis] for motion in motions])
    return law.scale_to(command, np.concatenate([motion.position[motion.fit, driven_channel] for motion in motions]))


def _list_sums(search: StructureSearch) -> list[tuple[int, ...]]:
    """List the best sums of laws of the motion, first none. Sums with a linear law are left out: as a filter of the
    acceleration it would reproduce it."""
    laws = search.regression.laws
    sums = [s.laws for s in search.ranked if s.laws and not any(laws[k].is_linear for k in s.laws)]
    return [(), *sums[:SUMS_BESIDE_COMMAND_LAW]]


def _refine_best_per_effect(
    inverse: InverseBalance, laws: Sequence[CommandLaw], motion_laws: tuple[int, ...]
) -> list[tuple[float, CommandLaw]]:
    """Refine the best law of each effect: errors and laws. Flexible ones are kept only with a clearly smaller error."""
    best: dict[str, tuple[float, CommandLaw]] = {}
    for law, error in zip(laws, inverse.sum_errors_per_law(laws, motion_laws), strict=True):
        if law.effect not in best or error < best[law.effect][0]:
            best[law.effect] = error, law
    results = cast(
        list[tuple[float, dict[str, float]]],
        list(inverse.map_(partial(_refine_values, inverse, motion_laws), best.values())),
    )
    refined = [
        (error, replace(law, values=values)) for (_, law), (error, values) in zip(best.values(), results, strict=True)
    ]
    limit = min((error for error, law in refined if not law.flexible), default=np.inf)
    return [(error, law) for error, law in refined if not law.flexible or error < (1 - COMMAND_RIVAL_MARGIN) * limit]


def _refine_values(
    inverse: InverseBalance, motion_laws: tuple[int, ...], start: tuple[float, CommandLaw]
) -> tuple[float, dict[str, float]]:
    """Search a law's values along coordinates, in `MOST_PASSES` passes or until one gains at most 0.1 %."""
    error, law = start
    for _ in range(MOST_PASSES):
        neighbours = [(inverse.sum_errors(neighbour, motion_laws), neighbour) for neighbour in vary_parameters(law)]
        if not neighbours or min(neighbours, key=lambda candidate: candidate[0])[0] >= error * (1 - 1e-3):
            break
        error, law = min(neighbours, key=lambda candidate: candidate[0])
    return error, law.values


def _judge_law(
    inverse: InverseBalance,
    law: CommandLaw,
    rivals: Sequence[CommandLaw],
    sums: tuple[tuple[int, ...], tuple[int, ...]],
) -> JudgedLaw:
    """Test the law against its rivals, on held-out blocks or by cross-validation. sums: laws of the motion fitted
    without and with the law of the command."""
    laws_without, laws_with = sums
    reduced, full = inverse.evaluate_law(IDEAL_ACTUATOR, laws_without, True), inverse.evaluate_law(law, laws_with, True)
    linear_error = float(inverse.evaluate_law(IDEAL_ACTUATOR, (), True).sum())
    draws = draw_bootstrap_blocks(len(full))
    rival_errors = [(inverse.evaluate_law(rival, laws_with, True), rival.effect) for rival in rivals]
    largest_error = float(full.sum()) / (1 - COMMAND_RIVAL_MARGIN)
    equivalents = tuple(effect for errors, effect in rival_errors if float(errors.sum()) <= largest_error)
    is_best = [errors[draws].sum(axis=1) >= full[draws].sum(axis=1) for errors, _ in rival_errors]
    gain, gain_low = bootstrap_gain(reduced, full)
    # A law of the command has no column in the regression: the functions of this `Law` are not used.
    placeholder_law = Law(law.effect, inverse.search.regression.axis, (), lambda m, _: m.force, lambda w, n, mass: None)
    return JudgedLaw(
        NO_COLUMN, placeholder_law, dict(law.values), gain, gain_low,
        float((reduced - full).sum()) / max(linear_error, 1e-300), equivalents,
        float(np.mean(np.all(is_best, axis=0))) if is_best else 1.0, _find_objection(law, gain, gain_low, equivalents),
        formula=law.as_formula(),
    )  # fmt: skip


def _find_objection(law: CommandLaw, gain: float, gain_low: float, equivalents: tuple[str, ...]) -> str:
    """Find the reason not to name the law, as a clause; empty where it is to be named."""
    if gain < COMMAND_LAW_GAIN or gain_low <= 0:
        return (
            f"in place of the command it explains {100 * max(gain, 0.0):.0f} % of the error that laws of the motion "
            "leave: too little, or not in all stretches of the recording"
        )
    # A curve of the command and a force that changes with the distance are different physics.
    unlike = [effect for effect in equivalents if effect not in EFFECTS_BY_NAME or law.position_factor is not None]
    if unlike or len(equivalents) >= LARGEST_CLASS:
        return f"these data cannot distinguish it from {', '.join(equivalents)}"
    return "" if law.effect in EFFECTS_BY_NAME or law.formula else "hapteq cannot simulate it yet"
