"""One run by Psi of a simulated participant, compiled: no device, no session, no file.

The rule is that of `protocols.procedure.psi`, with the same grid; tests hold the levels equal to those of
`protocols.procedure.staircase.step`. Two things make it some hundred times faster. The log of the posterior grows
answer by answer. And the entropy that a level leaves is written so that all logarithms of shares are known beforehand:
with p the probability of a cell and s the share of one answer there, the sum over cells and answers of s p log(s p) is
that of p (s log s), plus the sum of p log p, which is the same for all levels.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit

from analysis.psychophysics.power.staircase_kernel import MOST_TRIALS, Participant, RunFound, Track, give_answer
from equalizer.signals.signal import FloatArray
from protocols.definition.staircase_rule import StaircaseRule
from protocols.procedure.psi import SAME_BITS, SLOPES, levels_db, share_right, thresholds_db
from protocols.procedure.staircase import to_db


class PackedPsi(NamedTuple):
    """Psi's grid and tables as arrays. A cell is a threshold with a slope, a level 0 the start of a run."""

    levels_db: FloatArray
    """(1 + levels,): the start, then ascending to the cap."""
    cells_db: FloatArray
    """(cells,): threshold of each."""
    cap_db: float
    right: FloatArray
    """(1 + levels, cells): share of right answers."""
    log_shares: FloatArray
    """(2, 1 + levels, cells): logarithms of the shares of wrong and right answers."""
    known: FloatArray
    """(1 + levels, cells): sum over both answers of share times its logarithm."""
    trials: int
    spread_db: float


@cache
def pack_psi(rule: StaircaseRule) -> PackedPsi:
    """The grid and the tables of a rule whose levels Psi chooses."""
    cap_db = to_db(rule.cap_n)
    levels = np.array([to_db(rule.start_n), *levels_db(cap_db)])
    right = share_right(levels, cap_db).reshape(len(levels), -1)
    logs = np.log(np.array([1.0 - right, right]))
    known = right * logs[1] + (1.0 - right) * logs[0]
    cells_db = np.repeat(thresholds_db(cap_db), len(SLOPES))
    return PackedPsi(levels, cells_db, cap_db, right, logs, known, rule.bayesian.trials, rule.bayesian.spread_db)


@njit(cache=True)
def to_probability(log_p: FloatArray) -> FloatArray:
    """Posterior of every cell."""
    weight = np.exp(log_p - log_p.max())
    share: FloatArray = weight / weight.sum()
    return share


@njit(cache=True)
def best_level(psi: PackedPsi, probability: FloatArray) -> int:
    """The lowest of the levels that leave the least entropy."""
    chances, left = psi.right @ probability, -(psi.known @ probability)
    least = math.inf
    for level in range(1, len(left)):
        chance = chances[level]
        left[level] += chance * math.log(chance) + (1.0 - chance) * math.log(1.0 - chance)
        least = min(least, left[level])
    for level in range(1, len(left)):
        if left[level] <= least + SAME_BITS:
            return level
    return len(left) - 1


@njit(cache=True)
def play_psi(psi: PackedPsi, person: Participant, seed: int, track: Track) -> RunFound:
    """Plays until the run ends, and fills the track but for its reversals."""
    np.random.seed(seed)
    log_p = np.zeros(len(psi.cells_db))
    probability = to_probability(log_p)
    place, trials, repeats, spread_db, mean_db = 0, 0, person.repeats, math.inf, 0.0
    while trials < min(psi.trials, MOST_TRIALS) and not spread_db <= psi.spread_db:
        level = psi.levels_db[place]
        side, right, repeats = give_answer(person, level, trials, repeats)
        track.level_db[trials], track.side[trials], track.right[trials] = level, side, right
        trials += 1
        log_p += psi.log_shares[1 if right else 0, place]
        probability = to_probability(log_p)
        mean_db = (probability * psi.cells_db).sum()
        spread_db = math.sqrt((probability * (psi.cells_db - mean_db) ** 2).sum())
        place = best_level(psi, probability)
    above = probability[psi.cells_db > psi.cap_db].sum()
    return RunFound(trials, 0, mean_db, above)
