"""Comparison of rules that choose levels (staircases, Psi) by the error of a threshold, on simulated people.

Each person takes one run under every rule, with the same random numbers: trial 7 has the same draw under every rule, so
that differences between rules are paired.

Measure of efficiency: the sweat factor of M. M. Taylor, C. D. Creelman, J. Acoust. Soc. Am. 41 (1967), 782-787, is the
variance of the estimate times the number of trials. Here: its square root with the mean square error in place of the
variance, in dB.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from analysis.psychophysics.hierarchy.curve import AT_THRESHOLD, NEPER_PER_DB, USUAL_SLOPE, sensitivity
from analysis.psychophysics.power.simulated_study import Crowd
from analysis.psychophysics.power.staircase_kernel import MOST_TRIALS
from equalizer.signals.signal import FloatArray
from protocols.definition.staircase_rule import BayesianPlacement, StaircaseRule, StepChange
from protocols.procedure.psi import compute_posterior, estimate_threshold
from protocols.procedure.staircase import (
    StaircaseState,
    begin_staircase,
    is_complete,
    is_finished,
    level_n,
    step,
    to_db,
    to_newton,
)

_KEY = 0x9517
"""Word of the seed that separates these draws from those of whole studies."""


@dataclass(frozen=True, slots=True)
class RuleResult:
    """Error, bias and length of the runs of simulated people under a rule."""

    rule: str
    runs: int
    """Number of runs that ended with a threshold; the errors are over these. NaN without any."""
    trials: float
    """Mean number of trials per run, over all runs."""
    bias_db: float
    sd_db: float
    """Mean and standard deviation of the error of one run's estimate, estimated minus true threshold."""
    error_db: float
    """Root mean square error of one run's estimate."""
    error_per_trial_db: float
    """`error_db` times the square root of `trials`."""
    highest_n: float
    """Highest level played in any run, N."""


class ComparedPerson(NamedTuple):
    """One simulated person at one frequency."""

    threshold_db: float
    """True threshold, in dB re 1 N."""
    slope: float
    """Slope of the psychometric function, in the units of `hierarchy.curve`."""
    criterion: float
    """Response criterion c, in units of d'."""


def list_compared_rules(rule: StaircaseRule) -> dict[str, StaircaseRule]:
    """Rules by name: the protocol's up-down rule with each interpretation of its change of step (`StepChange`), and Psi
    with 30 and 60 trials."""
    names = {
        StepChange.AFTER_REVERSAL: "staircase, new step after the reversal",
        StepChange.AT_REVERSAL: "staircase, new step at the reversal",
        StepChange.AT_NEXT_REVERSAL: "staircase, one reversal later",
    }
    up_down = replace(rule, bayesian=BayesianPlacement())
    rules = {name: replace(up_down, step_change=change) for change, name in names.items()}
    for trials in (30, 60):
        rules[f"Psi, {trials} trials"] = replace(rule, bayesian=BayesianPlacement(trials))
    return rules


def compare_rules(crowd: Crowd, rules: Mapping[str, StaircaseRule], people: int, seed: int) -> tuple[RuleResult, ...]:
    """One run of each person under every rule; the people are drawn from the crowd's first frequency."""
    return tuple(_rule_result(name, rule, crowd, people, seed) for name, rule in rules.items())


def _rule_result(name: str, rule: StaircaseRule, crowd: Crowd, people: int, seed: int) -> RuleResult:
    """Result of one rule over all people."""
    errors, trials, highest = [], [], 0.0
    for number in range(people):
        true_db, state, top_n = simulate_person(crowd, rule, (seed, _KEY, number))
        trials.append(state.trials)
        highest = max(highest, top_n)
        if is_complete(rule, state):
            errors.append(estimate_db(rule, state) - true_db)
    error_array = np.array(errors) if errors else np.array([math.nan])
    error = float(np.sqrt((error_array**2).mean()))
    return RuleResult(
        rule=name,
        runs=len(errors),
        trials=float(np.mean(trials)),
        bias_db=float(error_array.mean()),
        sd_db=float(error_array.std()),
        error_db=error,
        error_per_trial_db=error * math.sqrt(float(np.mean(trials))),
        highest_n=highest,
    )


def simulate_person(crowd: Crowd, rule: StaircaseRule, key: tuple[int, ...]) -> tuple[float, StaircaseState, float]:
    """Simulate a run of a person drawn from the crowd. key: seeds the draws. Returns the true threshold (dB re 1 N),
    the last state, and the highest level played (N)."""
    random = np.random.default_rng(key)
    spread = crowd.frequency_sd_db[0] if isinstance(crowd.frequency_sd_db, tuple) else crowd.frequency_sd_db
    true_db = to_db(crowd.medians_n[0]) + math.hypot(crowd.person_sd_db, spread) * random.standard_normal()
    slope = (crowd.slope or USUAL_SLOPE[crowd.family]) * math.exp(crowd.slope_log_sd * random.standard_normal())
    person = ComparedPerson(float(true_db), slope, crowd.criterion_sd * random.standard_normal())
    draws = random.random((MOST_TRIALS, 2))
    # The draws of roving come last, so that all others are the same with roving and without it.
    state, played_n = answer_trials(crowd, rule, person, np.column_stack([draws, random.random(MOST_TRIALS)]))
    return person.threshold_db, state, max(played_n)


def answer_trials(
    crowd: Crowd, rule: StaircaseRule, person: ComparedPerson, draws: FloatArray
) -> tuple[StaircaseState, list[float]]:
    """The run's last state, and the level of each trial as played (N). draws: (trials, 3) in [0, 1), for the
    direction, the answer, and the amplitude where levels are roved; Psi plays its levels as they are."""
    state, played_n = begin_staircase(rule), list[float]()
    rove_db = 0.0 if rule.is_bayesian else crowd.rove_db
    while not is_finished(rule, state) and state.trials < len(draws):
        draw = draws[state.trials]
        staircase_n = level_n(rule, state)
        played_n.append(to_newton(to_db(staircase_n) + rove_db * (float(draw[2]) - 0.5)) if rove_db else staircase_n)
        scaled_db = person.slope * (to_db(played_n[-1]) - person.threshold_db)
        state = step(rule, state, _is_correct(crowd, scaled_db, person.criterion, draw))
    return state, played_n


def _is_correct(crowd: Crowd, scaled_db: float, criterion: float, draw: FloatArray) -> bool:
    """Whether a trial is answered right. scaled_db: slope times dB above the threshold; draw: (3,), of
    `answer_trials`."""
    q = float(sensitivity(np.array([AT_THRESHOLD[crowd.family] + NEPER_PER_DB * scaled_db]), crowd.family)[0][0])
    side = 1.0 if draw[0] < 0.5 else -1.0
    p_correct = crowd.lapse + (1.0 - 2.0 * crowd.lapse) * NormalDist().cdf(q - side * criterion)
    return bool(draw[1] < p_correct)


def estimate_db(rule: StaircaseRule, state: StaircaseState) -> float:
    """Threshold of a complete run, in dB re 1 N, estimated as in the analysis of a session."""
    if rule.is_bayesian:
        cap_db = to_db(rule.cap_n)
        return min(estimate_threshold(compute_posterior(state.answered, cap_db), cap_db).mean_db, cap_db)
    return float(np.mean(state.reversal_levels_db[-rule.averaged_reversals :]))
