"""The Psi method (Kontsevich and Tyler 1999) for one run of a simulated participant, compiled for power analyses.

The rule and its grid are those of `protocols.procedure.psi`; tests verify that the levels equal those of
`protocols.procedure.staircase.step`. It is some hundred times faster for two reasons. The logarithm of the posterior is
updated after each answer instead of recomputed. And with p the posterior of a cell and s the share of an answer there,
the expected entropy uses tables of s log s that do not depend on the run, because sum over answers of s = 1:

    sum over cells and answers of  s p log(s p)  =  sum of p (s log s)  +  sum over cells of p log p;

the last sum is the same for all levels and is left out.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit

from analysis.psychophysics.power.staircase_kernel import MOST_TRIALS, Participant, SimulatedRun, Track, give_answer
from equalizer.signals.signal import FloatArray
from protocols.definition.staircase_rule import StaircaseRule
from protocols.procedure.psi import SAME_BITS, SLOPES, levels_db, share_right, thresholds_db
from protocols.procedure.staircase import to_db


class PackedPsi(NamedTuple):
    """The grid of the Psi method and its tables as arrays. A cell is a pair of threshold and slope; level index 0 is
    the start of a run."""

    levels_db: FloatArray
    """(1 + levels,): dB re 1 N: the start, then ascending to the force cap."""
    cells_db: FloatArray
    """(cells,): threshold of each cell, dB re 1 N."""
    cap_db: float
    """Force cap, dB re 1 N."""
    right: FloatArray
    """(1 + levels, cells): probability of a right answer."""
    log_shares: FloatArray
    """(2, 1 + levels, cells): natural logarithms of the probabilities of a wrong and of a right answer."""
    negative_entropy: FloatArray
    """(1 + levels, cells): sum over both answers of s log s, with s the probability of the answer."""
    trials: int
    """Most trials of a run."""
    spread_db: float
    """A run ends when the standard deviation of the threshold's posterior is at most this, dB."""


@cache
def pack_psi(rule: StaircaseRule) -> PackedPsi:
    """The grid and the tables of a rule whose levels the Psi method chooses."""
    cap_db = to_db(rule.cap_n)
    levels = np.array([to_db(rule.start_n), *levels_db(cap_db)])
    p_correct = share_right(levels, cap_db).reshape(len(levels), -1)
    logs = np.log(np.array([1.0 - p_correct, p_correct]))
    negative_entropy = p_correct * logs[1] + (1.0 - p_correct) * logs[0]
    cells_db = np.repeat(thresholds_db(cap_db), len(SLOPES))
    return PackedPsi(
        levels, cells_db, cap_db, p_correct, logs, negative_entropy, rule.bayesian.trials, rule.bayesian.spread_db
    )


@njit(cache=True)
def to_probability(log_p: FloatArray) -> FloatArray:
    """(cells,): posterior probability of every cell from its logarithm, which need not be normalised."""
    weight = np.exp(log_p - log_p.max())
    share: FloatArray = weight / weight.sum()
    return share


@njit(cache=True)
def choose_level(psi: PackedPsi, probability: FloatArray) -> int:
    """Index of the level with the least expected posterior entropy (nats), the lowest of those within `SAME_BITS` of
    it. probability: (cells,)."""
    correct_chances, expected_entropy = psi.right @ probability, -(psi.negative_entropy @ probability)
    lowest_entropy = math.inf
    for level in range(1, len(expected_entropy)):
        chance = correct_chances[level]
        expected_entropy[level] += chance * math.log(chance) + (1.0 - chance) * math.log(1.0 - chance)
        lowest_entropy = min(lowest_entropy, expected_entropy[level])
    for level in range(1, len(expected_entropy)):
        if expected_entropy[level] <= lowest_entropy + SAME_BITS:
            return level
    return len(expected_entropy) - 1


@njit(cache=True)
def play_psi(psi: PackedPsi, person: Participant, seed: int, track: Track) -> SimulatedRun:
    """Simulate a run until it ends, and fill the track except its reversals. The result has the mean of the threshold's
    posterior, and the probability that the threshold lies above the cap."""
    np.random.seed(seed)
    log_p = np.zeros(len(psi.cells_db))
    probability = to_probability(log_p)
    level_index, trials, repeats, spread_db, mean_db = 0, 0, person.repeats, math.inf, 0.0
    while trials < min(psi.trials, MOST_TRIALS) and not spread_db <= psi.spread_db:
        level = psi.levels_db[level_index]
        side, is_correct, repeats = give_answer(person, level, trials, repeats)
        track.level_db[trials], track.side[trials], track.right[trials] = level, side, is_correct
        trials += 1
        log_p += psi.log_shares[1 if is_correct else 0, level_index]
        probability = to_probability(log_p)
        mean_db = (probability * psi.cells_db).sum()
        spread_db = math.sqrt((probability * (psi.cells_db - mean_db) ** 2).sum())
        level_index = choose_level(psi, probability)
    p_above_cap = probability[psi.cells_db > psi.cap_db].sum()
    return SimulatedRun(trials, 0, mean_db, p_above_cap)
