"""Compiled simulation of one staircase run of a simulated participant, for power analyses.

Order: `pack_rule` converts the rule to numbers, `simulate_staircase` plays trials; in each, `simulate_answer` draws an
answer from the psychometric function. The rule is that of `protocols.procedure.staircase.step`; tests check that both
give identical runs. Levels are in dB re 1 N.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray
from protocols.definition.staircase_rule import StaircaseRule, StepChange
from protocols.procedure.staircase import to_db

MOST_TRIALS = 2000
"""Largest number of trials of a run, the length of its arrays. A participant who only guesses needs about 110 trials
under the published rule; the longest of 500 simulated runs took 262."""
LEVEL_TOLERANCE_DB = 1e-9
"""Tolerance (dB) within which two levels count as equal, for rounding errors."""
LARGEST_T_BY_FAMILY = (3.2, 25.0, 6.7)
"""Upper limit of t by family (Weibull, logistic, Gauss), where 1 - F is 1e-11 to 2e-11: above it, wrong answers occur
practically by lapses only."""
EMPTY_TABLE = np.empty((0, 4))
"""Table of delivered stimuli of an ideal device: the delivered stimulus is the commanded one."""
NO_DIRECTION_DB = -400.0
"""Change of the equivalent level (dB) for a motion with no preferred direction, off-axis at least as large as
on-axis."""
MAX_PRESENTATIONS = 5
"""Largest number of presentations of a trial, as `max_looks` of `study.participants.unsure_repeater.UnsureRepeater`."""


class PackedRule(NamedTuple):
    """A `StaircaseRule` as numbers for compiled code; levels in dB re 1 N."""

    start_db: float
    cap_db: float
    cap_n: float
    up_after_wrong: int
    """Number of successive wrong answers after which the level rises."""
    down_after_right: int
    """Number of successive right answers after which the level falls."""
    steps_db: FloatArray
    """Step size (dB) by the number of reversals that count towards the schedule; as long as the schedule's phases have
    reversals, plus 3."""
    step_change: int
    """Which reversals count towards the schedule at a step. 0: all, including one at this step. 1: all but the last. 2:
    those before this step."""
    reversals: int
    """Number of reversals at which the run ends."""
    averaged: int
    """Number of last reversals whose levels are averaged."""
    has_initial_phase: bool
    """Whether the level moves after every answer until the first reversal."""
    trial_limit: int
    """Number of trials at which the run ends without its reversals; 0 = `MOST_TRIALS`."""
    rove_db: float = 0.0
    """Width (dB) of the range from which the level of each trial is drawn uniformly; its centre is the staircase's
    level."""


def pack_rule(rule: StaircaseRule, rove_db: float = 0.0) -> PackedRule:
    """Convert a staircase rule for the compiled kernel, with levels in dB re 1 N."""
    steps_db = [phase.step_db for phase in rule.steps for _ in range(phase.reversals)]
    step_change_codes = {StepChange.AT_REVERSAL: 0, StepChange.AT_NEXT_REVERSAL: 1, StepChange.AFTER_REVERSAL: 2}
    return PackedRule(
        to_db(rule.start_n),
        to_db(rule.cap_n),
        rule.cap_n,
        rule.up_after_wrong,
        rule.down_after_right,
        np.array([*steps_db, *[rule.steps[-1].step_db] * 3]),
        step_change_codes[rule.step_change],
        rule.reversals,
        rule.averaged_reversals,
        rule.initial_one_up_one_down,
        rule.trial_limit,
        rove_db,
    )


class Participant(NamedTuple):
    """One simulated participant at one frequency."""

    t0: float
    """Value of t at the threshold: `T_AT_THRESHOLD` of the family."""
    slope_per_db: float
    """Slope of the psychometric function: change of t per dB."""
    threshold_db: float
    """True threshold, dB re 1 N."""
    lapse: float
    """Lapse rate: probability of a wrong answer at the highest levels."""
    criterion: float
    """Response criterion, in units of d'."""
    family: int
    """Family of psychometric functions by number, see `compute_evidence`."""
    criterion_per_trial: float = 0.0
    """Drift of the criterion per trial, in units of d'."""
    trials_before: int = 0
    """Number of trials of the session before this run; the drift of the criterion continues from it."""
    unsure: float = 0.0
    """The participant asks for the same trial again while the mean evidence of its presentations lies within this many
    standard errors of the criterion."""
    repeats: int = 0
    """Largest number of repeats in this run."""
    felt_1: FloatArray = EMPTY_TABLE
    """(n, 4): delivered stimulus by commanded level in direction 1, a `felt_delivery.DeliveryTable` whose harmonics are
    multiplied by their masking weight."""
    felt_2: FloatArray = EMPTY_TABLE
    """The same in direction 2."""
    adaptation_db: float = 0.0
    """Asymptotic rise of the threshold by adaptation within a run (dB)."""
    adaptation_trials: float = 1.0
    """Exponential time constant of that rise (trials)."""


class Track(NamedTuple):
    """Trials and reversals of a run: arrays that the run fills in."""

    level_db: FloatArray
    """(MOST_TRIALS,): levels played (dB re 1 N)."""
    side: FloatArray
    """(MOST_TRIALS,): direction shown, 1 for direction 1, -1 for direction 2."""
    correct: FloatArray
    """(MOST_TRIALS,): 1 for a correct answer, else 0."""
    reversal_db: FloatArray
    """(reversals,): levels of the staircase at its reversals (dB re 1 N); not filled by Psi."""


@njit(cache=True)
def compute_evidence(t: float, family: int) -> float:
    """Compute the evidence q(t), half of d' of an unbiased participant, with Phi(q) = 1/2 + F(t)/2. family: 0 Weibull,
    1 logistic, 2 Gauss."""
    t = min(t, LARGEST_T_BY_FAMILY[family])
    if family == 0:
        survival = math.exp(-math.exp(t))
    elif family == 1:
        survival = 1.0 / (1.0 + math.exp(t))
    else:
        survival = 0.5 * math.erfc(t / math.sqrt(2.0))
    upper_tail = 0.5 * survival
    # Abramowitz and Stegun 26.2.23, then three steps of Newton's method on the tail, to machine precision.
    r = math.sqrt(-2.0 * math.log(upper_tail))
    q = r - (2.515517 + r * (0.802853 + r * 0.010328)) / (1.0 + r * (1.432788 + r * (0.189269 + r * 0.001308)))
    for _ in range(3):
        excess = 0.5 * math.erfc(q / math.sqrt(2.0)) - upper_tail
        q += excess * math.sqrt(2.0 * math.pi) * math.exp(q * q / 2.0)
    return q


@njit(cache=True)
def compute_equivalent_level_db(person: Participant, level_db: float, is_direction_1: bool, trial: int) -> float:
    """Compute the equivalent level (dB re 1 N): the level that without adaptation on an ideal device gives the same
    evidence as this level on the given device. trial: index of the trial in the run."""
    table = person.felt_1 if is_direction_1 else person.felt_2
    equivalent_db = level_db
    if len(table) > 0:
        row = min(max(int(np.searchsorted(table[:, 0], level_db)), 1), len(table) - 1)
        low, high = table[max(row - 1, 0)], table[row]
        fraction = (level_db - low[0]) / (high[0] - low[0]) if high[0] > low[0] else 0.0
        fraction = min(max(fraction, 0.0), 1.0)
        on_axis, off_axis, harmonics = low[1:] + fraction * (high[1:] - low[1:])
        directed_square = on_axis**2 - off_axis**2
        equivalent_db += 10.0 * math.log10(directed_square) if directed_square > 0.0 else NO_DIRECTION_DB
        equivalent_db -= 10.0 * math.log10(1.0 + harmonics**2 * 10.0 ** ((level_db - person.threshold_db) / 10.0))
    if person.adaptation_db > 0.0:
        equivalent_db += person.adaptation_db * math.expm1(-trial / person.adaptation_trials)
    return equivalent_db


@njit(cache=True)
def simulate_repeated_answer(mean_evidence: float, lapse: float, unsure: float, repeats_left: int) -> tuple[bool, int]:
    """Simulate an answer with repeated presentations while the summed evidence is within `unsure` standard errors of
    the criterion. Returns whether it is right, and the number of repeats left. mean_evidence: mean of the evidence of
    one presentation for the direction shown, relative to the criterion, in units of d'. A lapse is a random answer with
    probability 2 lapse, of which half are wrong."""
    if np.random.random() < 2.0 * lapse:
        return np.random.random() < 0.5, repeats_left
    presentations, total = 1, mean_evidence + np.random.normal()
    while abs(total) < unsure * math.sqrt(presentations) and repeats_left > 0 and presentations < MAX_PRESENTATIONS:
        presentations, total, repeats_left = (
            presentations + 1,
            total + mean_evidence + np.random.normal(),
            repeats_left - 1,
        )
    return total > 0.0, repeats_left


class SimulatedRun(NamedTuple):
    """Result of a simulated run."""

    trials: int
    reversals: int
    mean_db: float = math.nan
    """Posterior mean of the threshold (dB re 1 N); NaN unless the Psi method chooses the levels."""
    above_cap: float = math.nan
    """Posterior probability that the threshold lies above the cap; NaN unless the Psi method chooses the levels."""


@njit(cache=True)
def simulate_answer(person: Participant, level_db: float, trial: int, repeats_left: int) -> tuple[float, bool, int]:
    """Simulate the answer at a trial. Returns the direction shown (1 or -1), whether the answer is right, and the
    number of repeats that are left."""
    side = 1.0 if np.random.random() < 0.5 else -1.0
    equivalent_db = compute_equivalent_level_db(person, level_db, side > 0.0, trial)
    mean_evidence = compute_evidence(
        person.t0 + person.slope_per_db * (equivalent_db - person.threshold_db), person.family
    ) - side * (person.criterion + person.criterion_per_trial * (person.trials_before + trial))
    if person.unsure > 0.0:
        is_correct, repeats_left = simulate_repeated_answer(mean_evidence, person.lapse, person.unsure, repeats_left)
        return side, is_correct, repeats_left
    correct_probability = person.lapse + (1.0 - 2.0 * person.lapse) * 0.5 * math.erfc(-mean_evidence / math.sqrt(2.0))
    return side, np.random.random() < correct_probability, repeats_left


@njit(cache=True)
def draw_roved_level(level_db: float, rove_db: float) -> float:
    """Draw the level that is played (dB re 1 N), uniform in a range of width rove_db centred at the staircase's level;
    unchanged where rove_db is 0."""
    return level_db + rove_db * (np.random.random() - 0.5) if rove_db > 0.0 else level_db


@njit(cache=True)
def simulate_staircase(rule: PackedRule, person: Participant, seed: int, track: Track) -> SimulatedRun:
    """Simulate trials until the run has its reversals or reaches its limit of trials, and fill the track. At the cap, a
    step up is left out and counts as no reversal. seed: of the random draws."""
    np.random.seed(seed)
    level_db, previous_direction, right_in_row, wrong_in_row, trials, reversals = rule.start_db, 0, 0, 0, 0, 0
    repeats_left = person.repeats
    trial_limit = min(rule.trial_limit, MOST_TRIALS) if rule.trial_limit > 0 else MOST_TRIALS
    while reversals < rule.reversals and trials < trial_limit:
        played_db = draw_roved_level(level_db, rule.rove_db)
        side, is_correct, repeats_left = simulate_answer(person, played_db, trials, repeats_left)
        track.level_db[trials], track.side[trials], track.correct[trials] = played_db, side, is_correct
        trials += 1
        right_in_row, wrong_in_row = (right_in_row + 1, 0) if is_correct else (0, wrong_in_row + 1)
        in_initial_phase = rule.has_initial_phase and reversals == 0
        if wrong_in_row >= (1 if in_initial_phase else rule.up_after_wrong):
            direction = 1
        elif right_in_row >= (1 if in_initial_phase else rule.down_after_right):
            direction = -1
        else:
            continue
        right_in_row = wrong_in_row = 0
        if direction == 1 and level_db >= rule.cap_db - LEVEL_TOLERANCE_DB:
            continue
        is_reversal = previous_direction != 0 and direction != previous_direction
        reversal_count = reversals if rule.step_change == 2 else reversals + int(is_reversal) - rule.step_change
        step_db = rule.steps_db[max(0, reversal_count)]
        if is_reversal:
            track.reversal_db[reversals] = level_db
            reversals += 1
        previous_direction = direction
        level_db = min(level_db + direction * step_db, rule.cap_db)
    return SimulatedRun(trials, reversals, math.nan, math.nan)
