"""One staircase run of a simulated participant, compiled: no device, no session, no file.

The rule is that of `protocols.procedure.staircase.step`, number by number; tests hold the two equal.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray
from protocols.definition.staircase_rule import StaircaseRule, StepChange
from protocols.procedure.staircase import to_db

MOST_TRIALS = 2000
"""A run is cut here: a guesser needs about 110 trials under the published rule, and 262 at the most in 500 runs."""
SAME_DB = 1e-9
"""Difference below which two levels are the same, rounding apart."""
SUREST = (3.2, 25.0, 6.7)
"""t of each family where 1 - F is 1e-11 to 2e-11: beyond it no answer is wrong but by a lapse."""


class PackedRule(NamedTuple):
    """A `StaircaseRule` as numbers."""

    start_db: float
    cap_db: float
    cap_n: float
    up_after_wrong: int
    down_after_right: int
    steps_db: FloatArray
    """(reversals + 2,): size of the step by how many reversals count towards the schedule."""
    step_change: int
    """How many reversals are taken off the count that includes the one being made: 0 or 1; 2 = those before it."""
    reversals: int
    averaged: int
    initial: bool
    trial_limit: int
    rove_db: float = 0.0
    """Range from which the amplitude of each trial is drawn evenly, with the level of the staircase in its middle."""


def pack(rule: StaircaseRule, rove_db: float = 0.0) -> PackedRule:
    """The numbers of a staircase rule for the compiled kernel, with levels in dB re 1 N."""
    sizes = [phase.step_db for phase in rule.steps for _ in range(phase.reversals)]
    change = {StepChange.AT_REVERSAL: 0, StepChange.AT_NEXT_REVERSAL: 1, StepChange.AFTER_REVERSAL: 2}
    return PackedRule(
        to_db(rule.start_n),
        to_db(rule.cap_n),
        rule.cap_n,
        rule.up_after_wrong,
        rule.down_after_right,
        np.array([*sizes, *[rule.steps[-1].step_db] * 3]),
        change[rule.step_change],
        rule.reversals,
        rule.averaged_reversals,
        rule.initial_one_up_one_down,
        rule.trial_limit,
        rove_db,
    )


AS_COMMANDED = np.empty((0, 4))
NO_DIRECTION_DB = -400.0
"""Felt of a motion that is a circle."""


class Participant(NamedTuple):
    """One simulated participant at one frequency."""

    t0: float
    """`AT_THRESHOLD` of the family."""
    pace_per_db: float
    threshold_db: float
    lapse: float
    criterion: float
    family: int
    criterion_per_trial: float = 0.0
    trials_before: int = 0
    """Trials of the session before this run, from which a drifting criterion continues."""
    unsure: float = 0.0
    """Asks for the same trial again where the average of all presentations lies within this many standard errors of the
    criterion."""
    repeats: int = 0
    """Most repeats in this run."""
    felt_1: FloatArray = AS_COMMANDED
    """(n, 4): what is felt of direction 1, a `felt_delivery.Table` whose harmonics are weighted by how they mask."""
    felt_2: FloatArray = AS_COMMANDED
    adaptation_db: float = 0.0
    """Rise of the threshold in a long run."""
    adaptation_trials: float = 1.0


class Track(NamedTuple):
    """Arrays that a run fills in."""

    level_db: FloatArray
    """(MOST_TRIALS,), as the next two: levels as played."""
    side: FloatArray
    right: FloatArray
    reversal_db: FloatArray
    """(reversals,): levels of the staircase; not filled by Psi."""


@njit(cache=True)
def evidence(t: float, family: int) -> float:
    """q(t) with Phi(q) = 1/2 + F(t)/2. family: 0 Weibull, 1 logistic, 2 Gauss."""
    t = min(t, SUREST[family])
    if family == 0:
        rest = math.exp(-math.exp(t))
    elif family == 1:
        rest = 1.0 / (1.0 + math.exp(t))
    else:
        rest = 0.5 * math.erfc(t / math.sqrt(2.0))
    tail = 0.5 * rest
    # Abramowitz and Stegun 26.2.23, then three steps of Newton's method on the tail: right to the last digits.
    r = math.sqrt(-2.0 * math.log(tail))
    q = r - (2.515517 + r * (0.802853 + r * 0.010328)) / (1.0 + r * (1.432788 + r * (0.189269 + r * 0.001308)))
    for _ in range(3):
        excess = 0.5 * math.erfc(q / math.sqrt(2.0)) - tail
        q += excess * math.sqrt(2.0 * math.pi) * math.exp(q * q / 2.0)
    return q


@njit(cache=True)
def felt_db(person: Participant, level_db: float, first: bool, trial: int) -> float:
    """The commanded level (dB) that is felt as much without a flaw and before any adaptation. trial: of the run."""
    table = person.felt_1 if first else person.felt_2
    felt = level_db
    if len(table) > 0:
        place = min(max(int(np.searchsorted(table[:, 0], level_db)), 1), len(table) - 1)
        low, high = table[max(place - 1, 0)], table[place]
        share = (level_db - low[0]) / (high[0] - low[0]) if high[0] > low[0] else 0.0
        share = min(max(share, 0.0), 1.0)
        along, across, harmonics = low[1:] + share * (high[1:] - low[1:])
        directed = along**2 - across**2
        felt += 10.0 * math.log10(directed) if directed > 0.0 else NO_DIRECTION_DB
        felt -= 10.0 * math.log10(1.0 + harmonics**2 * 10.0 ** ((level_db - person.threshold_db) / 10.0))
    if person.adaptation_db > 0.0:
        felt += person.adaptation_db * math.expm1(-trial / person.adaptation_trials)
    return felt


MOST_LOOKS = 5
"""At one trial, as `study.participants.unsure`."""


@njit(cache=True)
def look_again(middle: float, lapse: float, unsure: float, left: int) -> tuple[bool, int]:
    """Whether the answer is right, and how many repeats are left. middle: mean of the evidence for what was shown."""
    if np.random.random() < 2.0 * lapse:
        return np.random.random() < 0.5, left
    looks, total = 1, middle + np.random.normal()
    while abs(total) < unsure * math.sqrt(looks) and left > 0 and looks < MOST_LOOKS:
        looks, total, left = looks + 1, total + middle + np.random.normal(), left - 1
    return total > 0.0, left


class RunFound(NamedTuple):
    """Result of a simulated run."""

    trials: int
    reversals: int
    mean_db: float = math.nan
    """Mean of the threshold's posterior (dB re 1 N), for a run by Psi only, as the next."""
    above_cap: float = math.nan
    """Probability that the threshold lies above the cap."""


@njit(cache=True)
def give_answer(person: Participant, level_db: float, trial: int, left: int) -> tuple[float, bool, int]:
    """Simulate the answer at a trial. Returns the direction shown (1 or -1), whether the answer is right, and the
    number of repeats that are left."""
    s = 1.0 if np.random.random() < 0.5 else -1.0
    felt = felt_db(person, level_db, s > 0.0, trial)
    a = evidence(person.t0 + person.pace_per_db * (felt - person.threshold_db), person.family) - s * (
        person.criterion + person.criterion_per_trial * (person.trials_before + trial)
    )
    if person.unsure > 0.0:
        answer, left = look_again(a, person.lapse, person.unsure, left)
        return s, answer, left
    p = person.lapse + (1.0 - 2.0 * person.lapse) * 0.5 * math.erfc(-a / math.sqrt(2.0))
    return s, np.random.random() < p, left


@njit(cache=True)
def play_around(level_db: float, rove_db: float) -> float:
    """The level that is played (dB), drawn around that of the staircase where the protocol roves."""
    return level_db + rove_db * (np.random.random() - 0.5) if rove_db > 0.0 else level_db


@njit(cache=True)
def play_run(rule: PackedRule, person: Participant, seed: int, track: Track) -> RunFound:
    """Plays until the run ends, and fills the track."""
    np.random.seed(seed)
    level, heading, right_in_row, wrong_in_row, trials, reversals = rule.start_db, 0, 0, 0, 0, 0
    left = person.repeats
    limit = min(rule.trial_limit, MOST_TRIALS) if rule.trial_limit > 0 else MOST_TRIALS
    while reversals < rule.reversals and trials < limit:
        played = play_around(level, rule.rove_db)
        s, answer, left = give_answer(person, played, trials, left)
        track.level_db[trials], track.side[trials], track.right[trials] = played, s, answer
        trials += 1
        right_in_row, wrong_in_row = (right_in_row + 1, 0) if answer else (0, wrong_in_row + 1)
        early = rule.initial and reversals == 0
        if wrong_in_row >= (1 if early else rule.up_after_wrong):
            turn = 1
        elif right_in_row >= (1 if early else rule.down_after_right):
            turn = -1
        else:
            continue
        right_in_row = wrong_in_row = 0
        if turn == 1 and level >= rule.cap_db - SAME_DB:
            continue
        turned = heading != 0 and turn != heading
        counted = reversals if rule.step_change == 2 else reversals + int(turned) - rule.step_change
        size = rule.steps_db[max(0, counted)]
        if turned:
            track.reversal_db[reversals] = level
            reversals += 1
        heading = turn
        level = min(level + turn * size, rule.cap_db)
    return RunFound(trials, reversals, math.nan, math.nan)
