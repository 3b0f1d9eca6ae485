"""Withdraw the name of a law of motion where a law of the actuator explains the data equally well.

With the velocity v, acceleration a and command u of an axis, the force balance is m a + d v + F_c sgn v + c v |v| =
g(u). It does not identify its laws uniquely in three cases:

- v never changes its sign: dry friction F_c sgn v is then a constant and holds the axis at rest below u = F_c, as the
  dead band g(u) = u - F_c does; a quadratic drag c v |v| found together with it may be a nonlinearity of g.
- m a is negligible: v is then a function of u alone, so that drag that grows with v is equivalent to a gain that falls
  with u, and a dead band is equivalent to dry friction.
- The axis rests while its dead band passes no force: dry friction may hold it instead. The dead band keeps its name,
  and dry friction is listed as its equivalent.
"""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.balance.judged_law import JudgedLaw
from analysis.diagnosis.balance.regression import Regression, compute_signal_power
from analysis.diagnosis.balance.structures import SLIDING, Structure, improves_significantly
from analysis.diagnosis.limits import COMMAND_LAW_GAIN, MOVING_TIME_SHARE, STILL_SHARE

DEAD_BAND_EFFECT = "force_deadband"
"""Name of the actuator's dead band in the catalogue of effects."""
EQUIVALENT_LAWS = {"quadratic_damping": "force_nonlinearity", DEAD_BAND_EFFECT: "coulomb_friction"}
"""For each law, the effect with the same motion where inertia is negligible; for the dead band, also where the axis
rests in it."""
ONE_BODY_REASON = "with one body, and no mode or relaxation beside it, it explains less than half of the error"
"""Objection to a law of the command."""
NO_REVERSAL_REASON = "the motion never changes direction"
"""Reason, in a message, why a law cannot be distinguished from its equivalent."""


def withdraw_ambiguous_names(balance: Balance) -> Balance:
    """Withdraw the names of laws of a driven axis that its actuator explains equally well. Where laws of the command
    (those that are no column of the regression) were named and none of them keeps its name, all laws lose theirs: they
    were fitted to the force that such a law delivers."""
    judged_laws = tuple(_withdraw_ambiguous_name(judged_law, balance) for judged_law in balance.laws)
    command_law_names = [judged_law.law.effect for judged_law in balance.named if not judged_law.has_column]
    if command_law_names and not any(judged_law.named and not judged_law.has_column for judged_law in judged_laws):
        reason = f"it was found together with {command_law_names[0]}, which these data do not confirm"
        judged_laws = tuple(replace(judged_law, objection=judged_law.objection or reason) for judged_law in judged_laws)
    return replace(balance, laws=judged_laws)


def _withdraw_ambiguous_name(judged_law: JudgedLaw, balance: Balance) -> JudgedLaw:
    """Withdraw the law's name, or add its equivalent, by the three cases of the module's docstring; unchanged where
    none applies, for a law without a name, and in the first two cases for one that depends on no channel."""
    regression, effect = balance.search.regression, judged_law.law.effect
    if (
        judged_law.named
        and effect == DEAD_BAND_EFFECT
        and not judged_law.has_column
        and _is_at_rest_in_dead_band(regression)
    ):
        return replace(
            judged_law, equivalents=tuple(dict.fromkeys((*judged_law.equivalents, EQUIVALENT_LAWS[DEAD_BAND_EFFECT])))
        )
    if not judged_law.named or judged_law.law.channel < 0:
        return judged_law
    if effect in SLIDING and not _has_reversal(regression, judged_law.law.channel):
        return _add_equivalent(judged_law, DEAD_BAND_EFFECT, NO_REVERSAL_REASON)
    if effect == "quadratic_damping":
        has_named_friction = any(
            named_law.law.effect in SLIDING and named_law.law.channel == judged_law.law.channel
            for named_law in balance.named
        )
        if has_named_friction and not _has_reversal(regression, judged_law.law.channel):
            return _add_equivalent(judged_law, EQUIVALENT_LAWS[effect], NO_REVERSAL_REASON)
    if effect in EQUIVALENT_LAWS and not _has_inertia(regression, balance.chosen.laws):
        return _add_equivalent(judged_law, EQUIVALENT_LAWS[effect], "the inertia is negligible in this recording")
    return judged_law


def _is_at_rest_in_dead_band(regression: Regression) -> bool:
    """Whether the axis moves in less than half of the samples in which its dead band passes no force; False without
    such samples. The forces of the regression are those behind the dead band, so that these are exactly 0."""
    motions, axis, driven_channel = regression.motions, regression.axis, regression.base_terms.driven_channel
    velocity = np.concatenate([motion.velocity[motion.fit, driven_channel] for motion in motions])
    force = np.concatenate([motion.force[motion.fit, axis] for motion in motions])
    is_moving = velocity**2 > STILL_SHARE * np.mean(velocity**2)
    return bool(np.mean(is_moving[force == 0.0]) < MOVING_TIME_SHARE) if np.any(force == 0.0) else False


def _add_equivalent(judged_law: JudgedLaw, equivalent: str, reason: str) -> JudgedLaw:
    """Add a reason not to name the law, and its equivalent in front of the other equivalent effects."""
    equivalents = tuple(dict.fromkeys((equivalent, *judged_law.equivalents)))
    return replace(
        judged_law,
        equivalents=equivalents,
        objection=f"these data cannot distinguish it from {equivalent}, because {reason}",
    )


def _has_reversal(regression: Regression, channel: int) -> bool:
    """Whether the motion changes direction: the sum of squared velocities of the weaker direction exceeds
    `STILL_SHARE` of that of the stronger."""
    velocity = np.concatenate([motion.velocity[motion.fit, channel] for motion in regression.motions])
    power_by_direction = [float(np.sum(np.maximum(sign * velocity, 0.0) ** 2)) for sign in (1.0, -1.0)]
    return min(power_by_direction) > STILL_SHARE * max(power_by_direction)


def _has_inertia(regression: Regression, laws: tuple[int, ...]) -> bool:
    """Whether a mass reduces the cross-validated error (`improves_significantly`) and its time constant m / d exceeds a
    sample. True without a test where the mass is given, or where the data have no time axis to determine it from."""
    columns, driven_channel = regression.select_columns(laws), regression.base_terms.driven_channel
    if regression.mass is not None or not np.isfinite(regression.motions[0].band_hz):
        return True
    columns_without_mass = [column for column in columns if column != driven_channel]
    massless_structure, structure_with_mass = (
        Structure(laws, regression.cross_validate(column_set)) for column_set in (columns_without_mass, columns)
    )
    weights = regression.fit_weights(columns)
    mass, damping = (
        float(weights[columns.index(k)]) for k in (driven_channel, len(regression.motions[0].channels) + driven_channel)
    )
    # A time constant m / d below a sample cannot be distinguished from the hold of the command.
    return mass * regression.motions[0].rate_hz > max(damping, 0.0) and improves_significantly(
        massless_structure, structure_with_mass
    )


def halves_one_body_error(balance: Balance, balance_with_law: Balance) -> bool:
    """Whether a law of the command lowers the error of one body by `COMMAND_LAW_GAIN`: without modes and relaxations,
    which a simulation of such a law cannot have. balance_with_law: of the force that the law gives."""
    return _compute_one_body_error(balance_with_law) <= (1 - COMMAND_LAW_GAIN) * _compute_one_body_error(balance)


def _compute_one_body_error(balance: Balance) -> float:
    """Compute the share of the force's power, cross-validated, that one body with the chosen laws of the motion
    leaves."""
    regression = balance.search.regression
    laws = [index for index in balance.chosen.laws if not regression.laws[index].is_linear]
    errors = regression.cross_validate(regression.select_one_body_columns(laws))
    return float(errors.sum()) / max(compute_signal_power(regression.fit), 1e-300)
