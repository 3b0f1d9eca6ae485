"""From laws that a force balance weighed to effects that are fitted by output error, and what may be said of them.

Used where the model itself was fitted to the recordings: then no calibration says how large its errors may be, and
evidence is the gain on held-out data instead of a remainder in units of noise.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.balance.motion import NoMotionError, motions_of
from analysis.diagnosis.balance.structures import search_structures, values_of
from analysis.diagnosis.balance.weigh import Balance, Weighed, weigh
from analysis.diagnosis.data.observed_parts import observed_parts
from analysis.diagnosis.errors.hypothesis import NOTHING, Claim, Hypothesis, claimed, together
from analysis.diagnosis.errors.output_error import evaluated
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.search.determined import number_errors
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.rivalry import Arena, Contender, refine
from analysis.diagnosis.search.search import Searched
from analysis.diagnosis.search.verdict import Judgement, as_good_as_noise
from analysis.diagnosis.settings import HELD_OUT_ERROR, INTERVAL_FACTOR
from analysis.diagnosis.types import Patience
from equalizer.effects.catalogue import EFFECTS
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

CONSTANT = "constant_force"
VAGUE = 1.96 * INTERVAL_FACTOR
"""Standard errors of a logarithm from which an interval reaches a number that is none."""
HELD_BY_SIMULATION = 0.9
"""Times the re-tuned model's held-out error that the completed one may leave at most, in the measure that suits."""


def balances_of(recordings: Sequence[Recording], without: frozenset[str], patient: Patience) -> tuple[Balance, ...]:
    """One per command; none where no motion was measured, or too little of it."""
    try:
        motions = motions_of(observed_parts(recordings, len(recordings[0].response.channels)))
        turning = any(unit.startswith("rad") for signal in (recordings[0].response,) for unit in signal.units)
        turning |= any(unit.startswith("N m") for unit in recordings[0].command.units)
        axes = range(len(recordings[0].command.channels))
        return tuple(weigh(search_structures(motions, axis, turning, without, patient)) for axis in axes)
    except (NoMotionError, np.linalg.LinAlgError):
        return ()


def searched_by_balance(arena: Arena, balances: Sequence[Balance], repeats: bool) -> Searched | None:
    """repeats: the noise is known from what repeats; else nothing counts as explained. None where nothing is named, or
    where simulations do not bear it out."""
    named = [
        (axis, law)
        for axis, balance in enumerate(balances)
        for law in balance.named
        if law.law.effect != CONSTANT and _plays(axis, law)
    ]
    if not named:
        return None
    constant = _constants(balances)
    given = evaluated(arena.measure, arena.tuning, np.zeros(len(arena.tuning.names)), constant)
    before, retuned = arena.confirmed(arena.contender(given)), arena.contender(refine(arena, given))
    confirmed = arena.confirmed(retuned)
    named = _refitted(balances, named)
    while named:
        steps = _steps(arena, retuned, named, _released(arena.tuning, balances, [law.place for _, law in named]))
        ends = (before, confirmed, arena.confirmed(steps[-1]))
        explained = Explanation(*ends, tuple((step,) for step in steps), tuple(steps))
        vague = _vague(arena, explained, len(constant.claims)) if _borne_out(confirmed, ends[2]) else len(named) - 1
        if vague is None:
            sealed = float(np.nanmax(ends[2].standing.test, initial=0.0))
            whole = repeats and as_good_as_noise(explained) and sealed <= HELD_OUT_ERROR
            return Searched(arena, explained, Judgement("explained" if whole else "partly_explained", True))
        named = _refitted(balances, [law for number, law in enumerate(named) if number != vague])
    return None


def _refitted(balances: Sequence[Balance], named: Sequence[tuple[int, Weighed]]) -> list[tuple[int, Weighed]]:
    """With the numbers that the balances give these laws alone."""
    found = []
    for axis, law in named:
        regression = balances[axis].searched.regression
        places = [other.place for of, other in named if of == axis]
        values = values_of(regression, places)[places.index(law.place)]
        found.append((axis, law if values is None else replace(law, values=values)))
    return found


def _steps(
    arena: Arena, retuned: Contender, named: Sequence[tuple[int, Weighed]], deviations: FloatArray
) -> list[Contender]:
    """The laws one after the other beside the constants, each fitted with those before it."""
    whole = retuned.fitted.hypothesis
    steps = [retuned for _ in whole.claims]
    for axis, law in named:
        start = evaluated(arena.measure, arena.tuning, deviations, together(whole, _claimed(axis, law)))
        found = refine(arena, start)
        steps.append(arena.contender(found))
        whole, deviations = found.hypothesis, found.deviations
    return steps


def _vague(arena: Arena, explained: Explanation, constants: int) -> int | None:
    """The place among the named laws of one whose main number's interval holds zero; None where none does."""
    errors, begin = number_errors(arena, explained), 0
    for place, claim in enumerate(explained.steps[-1].fitted.hypothesis.claims):
        free = [parameter for parameter in claim.effect.parameters if not parameter.fixed]
        if place >= constants and free[0].scale == "log" and VAGUE * errors[begin] >= 1:
            return place - constants
        begin += len(free)
    return None


def _constants(balances: Sequence[Balance]) -> Hypothesis:
    """A constant force along each axis: a weight, or the offset of an amplifier or sensor, which no model's matrices
    hold."""
    whole = NOTHING
    for axis, balance in enumerate(balances):
        regression = balance.searched.regression
        force = -float(regression.weights(regression.chosen(()))[-1])
        if force:
            claim = Claim(EFFECTS[CONSTANT], "one", (axis,))
            whole = together(whole, claimed(claim, [{"force": force}]))
    return whole


def _plays(axis: int, weighed: Weighed) -> bool:
    effect = EFFECTS.get(weighed.law.effect)
    if effect is None or weighed.law.channel != axis:
        return False
    return all(
        parameter.name in weighed.values and parameter.lower <= weighed.values[parameter.name] <= parameter.upper
        for parameter in effect.parameters
    )


def _claimed(axis: int, weighed: Weighed) -> Hypothesis:
    return claimed(Claim(EFFECTS[weighed.law.effect], "one", (axis,)), [weighed.values])


def _released(tuning: Tuning, balances: Sequence[Balance], laws: Sequence[int]) -> FloatArray:
    """Mass, damping and stiffness as they are beside laws of the only balance, not as they were fitted without them."""
    start = np.zeros(len(tuning.names))
    model = tuning.model
    if len(balances) != 1 or model.coordinates != 1:
        return start
    regression = balances[0].searched.regression
    weights = regression.weights(regression.chosen(laws))[: regression.base - 1]
    given = (model.mass, model.damping, model.stiffness)
    for place, (weight, matrix) in enumerate(zip(weights, given, strict=False)):
        if place == 0:
            weight = max(weight, matrix[0, 0] / 10)
        start[place] = np.clip((weight - matrix[0, 0]) / tuning.deviation[place], -3.9, 3.9)
    return start


def _borne_out(retuned: Contender, after: Contender) -> bool:
    left, right = (float(np.mean(np.log(each.standing.test))) for each in (retuned, after))
    return not np.isfinite(left) or right <= left + np.log(HELD_BY_SIMULATION)
