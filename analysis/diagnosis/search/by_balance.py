"""From laws that a force balance weighed to effects that are fitted by output error, and what may be said of them.

Used where the model itself was fitted to the recordings: then no calibration says how large its errors may be, and
evidence is the gain on held-out data instead of a remainder in units of noise.
"""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.balance.motion import NoMotionError, motions_of
from analysis.diagnosis.balance.structures import search_structures
from analysis.diagnosis.balance.weigh import Balance, Weighed, weigh
from analysis.diagnosis.data.observed_parts import observed_parts
from analysis.diagnosis.errors.hypothesis import NOTHING, Claim, Hypothesis, claimed, together
from analysis.diagnosis.errors.output_error import evaluated
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.rivalry import Arena, Contender, refine
from analysis.diagnosis.search.search import Searched
from analysis.diagnosis.search.verdict import Judgement, as_good_as_noise
from analysis.diagnosis.settings import HELD_OUT_ERROR
from analysis.diagnosis.types import Patience
from equalizer.effects.catalogue import EFFECTS
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

CONSTANT = "constant_force"
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
    constant, start = _constants(balances), _zeros(arena)
    given = evaluated(arena.measure, arena.tuning, start, constant)
    before = arena.confirmed(arena.contender(given))
    retuned = arena.contender(refine(arena, given))
    steps: list[Contender] = [retuned for _ in constant.claims]
    whole, deviations = retuned.fitted.hypothesis, _released(arena.tuning, balances)
    for axis, law in named:
        whole = together(whole, _claimed(axis, law))
        found = refine(arena, evaluated(arena.measure, arena.tuning, deviations, whole))
        steps.append(arena.contender(found))
        whole, deviations = found.hypothesis, found.deviations
    ends = (before, arena.confirmed(retuned), arena.confirmed(steps[-1]))
    if not _borne_out(arena, ends[1], ends[2]):
        return None
    explained = Explanation(*ends, tuple((step,) for step in steps), tuple(steps))
    whole_story = repeats and as_good_as_noise(explained)
    whole_story = whole_story and not np.nanmax(ends[2].standing.test, initial=0.0) > HELD_OUT_ERROR
    return Searched(arena, explained, Judgement("explained" if whole_story else "partly_explained", True))


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
    return {parameter.name for parameter in effect.parameters} <= set(weighed.values)


def _claimed(axis: int, weighed: Weighed) -> Hypothesis:
    return claimed(Claim(EFFECTS[weighed.law.effect], "one", (axis,)), [weighed.values])


def _zeros(arena: Arena) -> FloatArray:
    return np.zeros(len(arena.tuning.names))


def _released(tuning: Tuning, balances: Sequence[Balance]) -> FloatArray:
    """Mass, damping and stiffness as they are beside the laws, not as they were fitted without them."""
    start = np.zeros(len(tuning.names))
    model = tuning.model
    if len(balances) != 1 or model.coordinates != 1:
        return start
    regression = balances[0].searched.regression
    weights = regression.weights(regression.chosen([law.place for law in balances[0].named]))[: regression.base - 1]
    given = (model.mass, model.damping, model.stiffness)
    for place, (weight, matrix) in enumerate(zip(weights, given, strict=False)):
        if place == 0:
            weight = max(weight, matrix[0, 0] / 10)
        start[place] = np.clip((weight - matrix[0, 0]) / tuning.deviation[place], -3.9, 3.9)
    return start


def _borne_out(arena: Arena, retuned: Contender, after: Contender) -> bool:
    left, right = (float(np.mean(np.log(each.standing.test))) for each in (retuned, after))
    return not np.isfinite(left) or right <= left + np.log(HELD_BY_SIMULATION)
