"""The Psi method (Kontsevich and Tyler 1999) for one run of a simulated participant, compiled for power analyses
(`simulated_study`).

The rule and its grid are those of `protocols.procedure.psi`; tests verify that the levels equal those of
`protocols.procedure.staircase.step`. The next level is the one whose answer is expected to leave the least entropy of
the posterior over the cells of the grid (a cell: a pair of threshold and slope). With

    p_i    posterior probability of cell i
    s_ia   probability of answer a (wrong, correct) at the level in cell i; sum over a of s_ia = 1
    c_a    probability of answer a at the level, sum over i of p_i s_ia

the expected entropy after the answer, in nats, is by Bayes' rule

    H = - sum over i, a of p_i s_ia log s_ia  -  sum over i of p_i log p_i  +  sum over a of c_a log c_a

It is faster than `protocols.procedure.psi`: it is compiled, the sum over a of s_ia log s_ia is tabulated, the second
term is the same for all levels and is left out, and the logarithm of the posterior is updated after each answer instead
of recomputed.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit

from analysis.psychophysics.power.staircase_kernel import MOST_TRIALS, Participant, SimulatedRun, Track, simulate_answer
from equalizer.signals.signal import FloatArray
from protocols.definition.staircase_rule import StaircaseRule
from protocols.procedure.psi import (
    ENTROPY_TOLERANCE_NATS,
    SLOPES,
    compute_share_right,
    list_levels_db,
    list_thresholds_db,
)
from protocols.procedure.staircase import to_db


class PackedPsi(NamedTuple):
    """The grid of the Psi method and its tables as arrays. A cell is a pair of threshold and slope; level index 0 is
    the starting level of a run."""

    levels_db: FloatArray
    """(1 + levels,), dB re 1 N: the starting level, then the levels of the grid, ascending to the force cap."""
    cells_db: FloatArray
    """(cells,): threshold of each cell, dB re 1 N."""
    cap_db: float
    """Force cap, dB re 1 N."""
    p_correct: FloatArray
    """(1 + levels, cells): probability of a correct answer."""
    log_p_answer: FloatArray
    """(2, 1 + levels, cells): natural logarithms of the probabilities of a wrong and of a correct answer."""
    negative_entropy: FloatArray
    """(1 + levels, cells): sum over a of s_ia log s_ia of the module's equation, nats."""
    trial_limit: int
    stop_sd_db: float
    """A run ends when the standard deviation of the threshold's posterior is at most this, dB."""


@cache
def pack_psi(rule: StaircaseRule) -> PackedPsi:
    """Compute the grid and the tables of a rule whose levels the Psi method chooses. Cached by rule."""
    cap_db = to_db(rule.cap_n)
    all_levels_db = np.array([to_db(rule.start_n), *list_levels_db(cap_db)])
    p_correct = compute_share_right(all_levels_db, cap_db).reshape(len(all_levels_db), -1)
    log_p_answer = np.log(np.array([1.0 - p_correct, p_correct]))
    negative_entropy = p_correct * log_p_answer[1] + (1.0 - p_correct) * log_p_answer[0]
    cells_db = np.repeat(list_thresholds_db(cap_db), len(SLOPES))
    return PackedPsi(
        all_levels_db,
        cells_db,
        cap_db,
        p_correct,
        log_p_answer,
        negative_entropy,
        rule.bayesian.trials,
        rule.bayesian.spread_db,
    )


@njit(cache=True)
def normalise_posterior(log_p: FloatArray) -> FloatArray:
    """Normalise a posterior: probability of every cell (cells,) from log_p (cells,), its natural logarithm up to a
    constant."""
    weight = np.exp(log_p - log_p.max())
    probability: FloatArray = weight / weight.sum()
    return probability


@njit(cache=True)
def choose_level(psi: PackedPsi, probability: FloatArray) -> int:
    """Choose the lowest level whose expected posterior entropy is within `ENTROPY_TOLERANCE_NATS` of the least; returns
    its index, at least 1, because the starting level is not one of the grid. probability: (cells,), posterior."""
    p_correct, expected_entropy = psi.p_correct @ probability, -(psi.negative_entropy @ probability)
    lowest_entropy = math.inf
    for level in range(1, len(expected_entropy)):
        level_p_correct = p_correct[level]
        expected_entropy[level] += level_p_correct * math.log(level_p_correct) + (1.0 - level_p_correct) * math.log(
            1.0 - level_p_correct
        )
        lowest_entropy = min(lowest_entropy, expected_entropy[level])
    for level in range(1, len(expected_entropy)):
        if expected_entropy[level] <= lowest_entropy + ENTROPY_TOLERANCE_NATS:
            return level
    return len(expected_entropy) - 1


@njit(cache=True)
def play_psi(psi: PackedPsi, person: Participant, seed: int, track: Track) -> SimulatedRun:
    """Simulate a run until it ends, and fill the track except its reversals. The result has the number of trials, no
    reversals, the mean of the threshold's posterior (dB re 1 N), and the probability that the threshold lies above the
    cap. seed: of the random answers. At most `MOST_TRIALS` trials, the size of the track, are simulated."""
    np.random.seed(seed)
    log_p = np.zeros(len(psi.cells_db))
    probability = normalise_posterior(log_p)
    level_index, trials, repeats, sd_db, mean_db = 0, 0, person.repeats, math.inf, 0.0
    while trials < min(psi.trial_limit, MOST_TRIALS) and not sd_db <= psi.stop_sd_db:
        level = psi.levels_db[level_index]
        side, is_correct, repeats = simulate_answer(person, level, trials, repeats)
        track.level_db[trials], track.side[trials], track.correct[trials] = level, side, is_correct
        trials += 1
        log_p += psi.log_p_answer[1 if is_correct else 0, level_index]
        probability = normalise_posterior(log_p)
        mean_db = (probability * psi.cells_db).sum()
        sd_db = math.sqrt((probability * (psi.cells_db - mean_db) ** 2).sum())
        level_index = choose_level(psi, probability)
    p_above_cap = probability[psi.cells_db > psi.cap_db].sum()
    return SimulatedRun(trials, 0, mean_db, p_above_cap)
