"""Withdraws the name of a law of motion where a law of the actuator explains the data equally well.

With the velocity v, acceleration a and command u of an axis, the force balance is
m a + d v + F_c sgn v + c v |v| = g(u). It does not identify its laws uniquely in three cases:

- v never changes its sign: dry friction F_c sgn v is then a constant and holds the axis at rest below u = F_c, as the
  dead band g(u) = u - F_c does; a quadratic drag c v |v| found together with it may be a nonlinearity of g.
- m a is negligible: v is then a function of u alone, so that drag that grows with v is equivalent to a gain that falls
  with u, and a dead band is equivalent to dry friction.
- The axis rests while its dead band passes no force: dry friction may hold it instead; both are named, as a class.
"""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.balance.judged_law import JudgedLaw
from analysis.diagnosis.balance.regression import Regression
from analysis.diagnosis.balance.structures import SLIDING, Structure, is_better
from analysis.diagnosis.settings import MOVES_MOST_OF_THE_TIME, STILL_SHARE

DEAD_BAND = "force_deadband"
EQUIVALENT_LAWS = {"quadratic_damping": "force_nonlinearity", DEAD_BAND: "coulomb_friction"}
"""For each law, the law that explains the same motion where inertia is negligible."""
BACKWARDS = "the motion never changes direction"
"""Reason, in a message, for a law that is not named."""


def doubt_laws_of_actuator(balance: Balance) -> Balance:
    """The balance of a driven axis without the names of laws that its actuator explains equally well. Where this leaves
    no law of the command with a name, the other laws lose theirs too: they were fitted to the force behind that law."""
    laws = tuple(_doubt_law(each, balance) for each in balance.laws)
    through = [each.law.effect for each in balance.named if not each.has_column]
    if through and not any(each.named and not each.has_column for each in laws):
        why = f"it was found together with {through[0]}, which these data do not confirm"
        laws = tuple(replace(each, why_not=each.why_not or why) for each in laws)
    return replace(balance, laws=laws)


def _doubt_law(judged: JudgedLaw, balance: Balance) -> JudgedLaw:
    """The law, with its name withdrawn or with its equivalent added, by the three cases of the module's docstring."""
    regression, effect = balance.search.regression, judged.law.effect
    if judged.named and effect == DEAD_BAND and not judged.has_column and _rests_within(regression):
        return replace(judged, alike=tuple(dict.fromkeys((*judged.alike, EQUIVALENT_LAWS[DEAD_BAND]))))
    if not judged.named or judged.law.channel < 0:
        return judged
    if effect in SLIDING and not _reverses(regression, judged.law.channel):
        return _mark_alike(judged, DEAD_BAND, BACKWARDS)
    if effect == "quadratic_damping":
        has_friction = any(
            each.law.effect in SLIDING and each.law.channel == judged.law.channel for each in balance.named
        )
        if has_friction and not _reverses(regression, judged.law.channel):
            return _mark_alike(judged, "force_nonlinearity", BACKWARDS)
    if effect in EQUIVALENT_LAWS and not _has_inertia(regression, balance.chosen.laws):
        return _mark_alike(judged, EQUIVALENT_LAWS[effect], "the inertia is negligible in this recording")
    return judged


def _rests_within(regression: Regression) -> bool:
    """Whether the axis rests in most samples in which its dead band passes no force. The forces of the regression are
    those behind the dead band, so that such samples have a force of exactly 0."""
    motions, axis, own = regression.motions, regression.axis, regression.beside.own
    speed = np.concatenate([motion.velocity[motion.fit, own] for motion in motions])
    force = np.concatenate([motion.force[motion.fit, axis] for motion in motions])
    moves = speed**2 > STILL_SHARE * np.mean(speed**2)
    return bool(np.mean(moves[force == 0.0]) < MOVES_MOST_OF_THE_TIME) if np.any(force == 0.0) else False


def _mark_alike(judged: JudgedLaw, twin: str, why: str) -> JudgedLaw:
    """The law with a reason not to name it, and with its equivalent (`twin`) added to its class."""
    alike = tuple(dict.fromkeys((twin, *judged.alike)))
    return replace(judged, alike=alike, why_not=f"these data cannot distinguish it from {twin}, because {why}")


def _reverses(regression: Regression, channel: int) -> bool:
    """Whether the motion changes direction: the sum of squared velocities of the weaker direction exceeds
    `STILL_SHARE` of that of the stronger."""
    velocity = np.concatenate([motion.velocity[motion.fit, channel] for motion in regression.motions])
    power = [float(np.sum(np.maximum(sign * velocity, 0.0) ** 2)) for sign in (1.0, -1.0)]
    return min(power) > STILL_SHARE * max(power)


def _has_inertia(regression: Regression, laws: tuple[int, ...]) -> bool:
    """Whether a mass reduces the cross-validated error significantly (`is_better`) and its time constant m / d exceeds
    a sample. True without a test where the mass is given, or where the data have no time axis to determine it from."""
    columns, own = regression.columns_of(laws), regression.beside.own
    if regression.mass is not None or not np.isfinite(regression.motions[0].band_hz):
        return True
    massless = [column for column in columns if column != own]
    without, with_mass = (Structure(laws, regression.cross_validated_errors(each)) for each in (massless, columns))
    weights = regression.weights(columns)
    mass, damping = (float(weights[columns.index(k)]) for k in (own, len(regression.motions[0].channels) + own))
    # A time constant m / d below a sample cannot be distinguished from the hold of the command.
    return mass * regression.motions[0].rate_hz > max(damping, 0.0) and is_better(without, with_mass)
