"""Compare adaptive procedures (staircases, Psi) by the error of their threshold estimates, on simulated people.

Each person takes one run under every rule, with the same random numbers (trial 7 has the same draw under every rule),
so that differences between rules are paired.

Efficiency is measured by the sweat factor (M. M. Taylor, C. D. Creelman, J. Acoust. Soc. Am. 41 (1967), 782-787),
variance of the estimate times number of trials. `RuleResult.error_per_trial_db` is its square root, with the mean
square error in place of the variance.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from analysis.psychophysics.hierarchy.curve import NEPER_PER_DB, STARTING_SLOPE, T_AT_THRESHOLD, differentiate_evidence
from analysis.psychophysics.power.simulated_study import Crowd
from analysis.psychophysics.power.staircase_kernel import MOST_TRIALS
from equalizer.signals.signal import FloatArray
from protocols.definition.staircase_rule import BayesianPlacement, StaircaseRule, StepChange
from protocols.procedure.psi import compute_posterior, estimate_threshold
from protocols.procedure.staircase import (
    StaircaseState,
    begin_staircase,
    compute_level_n,
    is_complete,
    is_finished,
    step,
    to_db,
    to_newton,
)

_SEED_KEY = 0x9517
"""Part of the seed that makes these draws independent of those of simulated studies. Arbitrary."""


@dataclass(frozen=True, slots=True)
class RuleResult:
    """Error, bias and length of the runs of all simulated people under one rule."""

    rule: str
    runs: int
    """Number of runs that ended with a threshold. Errors are over these; None without such runs."""
    trials: float
    """Mean number of trials per run, over all runs."""
    bias_db: float | None
    """Mean error of one run's estimate, estimated minus true threshold."""
    sd_db: float | None
    """Standard deviation of that error."""
    error_db: float | None
    """Root mean square error of one run's estimate."""
    error_per_trial_db: float | None
    """`error_db` times the square root of `trials` (see the module): error of an equally efficient run of one trial."""
    highest_n: float
    """Highest amplitude played in any run, N."""


class SimulatedPerson(NamedTuple):
    """One simulated person at one frequency."""

    threshold_db: float
    """True threshold, in dB re 1 N."""
    slope: float
    """Slope of the psychometric function, in the units of `hierarchy.curve`."""
    criterion: float
    """Response criterion c, in units of d'."""


def list_compared_rules(rule: StaircaseRule) -> dict[str, StaircaseRule]:
    """List the rules to compare, by name: the protocol's up-down rule with each interpretation of its change of step
    (`StepChange`), and Psi with 30 and with 60 trials, to which the first step and the trial limit of the protocol's
    rule do not apply."""
    names = {
        StepChange.AFTER_REVERSAL: "staircase, new step after the reversal",
        StepChange.AT_REVERSAL: "staircase, new step at the reversal",
        StepChange.AT_NEXT_REVERSAL: "staircase, one reversal later",
    }
    up_down = replace(rule, bayesian=BayesianPlacement())
    rules = {name: replace(up_down, step_change=change) for change, name in names.items()}
    for trials in (30, 60):
        rules[f"Psi, {trials} trials"] = replace(
            rule, bayesian=BayesianPlacement(trials), initial_one_up_one_down=False, trial_limit=0
        )
    return rules


def compare_rules(crowd: Crowd, rules: Mapping[str, StaircaseRule], people: int, seed: int) -> tuple[RuleResult, ...]:
    """Simulate one run of each person under every rule. The thresholds of the people are those of the crowd at its
    first frequency."""
    return tuple(_evaluate_rule(name, rule, crowd, people, seed) for name, rule in rules.items())


def _evaluate_rule(name: str, rule: StaircaseRule, crowd: Crowd, people: int, seed: int) -> RuleResult:
    """Simulate a run of every person under one rule, and summarise their errors."""
    errors_db, trial_counts, highest_n = [], [], 0.0
    for person_index in range(people):
        true_db, state, run_highest_n = simulate_person(crowd, rule, (seed, _SEED_KEY, person_index))
        trial_counts.append(state.trials)
        highest_n = max(highest_n, run_highest_n)
        if is_complete(rule, state):
            errors_db.append(estimate_db(rule, state) - true_db)
    rms_error_db = float(np.sqrt(np.mean(np.square(errors_db)))) if errors_db else None
    return RuleResult(
        rule=name,
        runs=len(errors_db),
        trials=float(np.mean(trial_counts)),
        bias_db=float(np.mean(errors_db)) if errors_db else None,
        sd_db=float(np.std(errors_db)) if errors_db else None,
        error_db=rms_error_db,
        error_per_trial_db=None if rms_error_db is None else rms_error_db * math.sqrt(float(np.mean(trial_counts))),
        highest_n=highest_n,
    )


def simulate_person(crowd: Crowd, rule: StaircaseRule, key: tuple[int, ...]) -> tuple[float, StaircaseState, float]:
    """Simulate a run of a person drawn from the crowd. key: seeds the draws. Returns the true threshold (dB re 1 N),
    the last state, and the highest level played (N)."""
    generator = np.random.default_rng(key)
    frequency_sd_db = crowd.frequency_sd_db[0] if isinstance(crowd.frequency_sd_db, tuple) else crowd.frequency_sd_db
    true_db = to_db(crowd.medians_n[0]) + math.hypot(crowd.person_sd_db, frequency_sd_db) * generator.standard_normal()
    slope = (crowd.slope or STARTING_SLOPE[crowd.family]) * math.exp(crowd.slope_log_sd * generator.standard_normal())
    person = SimulatedPerson(float(true_db), slope, crowd.criterion_sd * generator.standard_normal())
    draws = generator.random((MOST_TRIALS, 2))
    # The draws of roving come last, so that all others are the same with roving and without it.
    state, played_n = answer_trials(crowd, rule, person, np.column_stack([draws, generator.random(MOST_TRIALS)]))
    return person.threshold_db, state, max(played_n)


def answer_trials(
    crowd: Crowd, rule: StaircaseRule, person: SimulatedPerson, draws: FloatArray
) -> tuple[StaircaseState, list[float]]:
    """Simulate the trials of a run until it is finished or there are no more draws. Returns the last state, and the
    amplitude (N) that each trial played. draws: (trials, 3) in [0, 1), for the direction, the answer, and the roving of
    the amplitude; levels of Psi are not roved."""
    state, played_n = begin_staircase(rule), list[float]()
    rove_db = 0.0 if rule.is_bayesian else crowd.rove_db
    while not is_finished(rule, state) and state.trials < len(draws):
        trial_draws = draws[state.trials]
        staircase_n = compute_level_n(rule, state)
        played_n.append(
            to_newton(to_db(staircase_n) + rove_db * (float(trial_draws[2]) - 0.5)) if rove_db else staircase_n
        )
        scaled_db = person.slope * (to_db(played_n[-1]) - person.threshold_db)
        state = step(rule, state, _is_correct(crowd, scaled_db, person.criterion, trial_draws))
    return state, played_n


def _is_correct(crowd: Crowd, scaled_db: float, criterion: float, draw: FloatArray) -> bool:
    """Whether a trial is answered right: Phi(d'/2 - c) or Phi(d'/2 + c) by direction, mixed with lapses. scaled_db:
    slope times dB above the threshold. criterion: c. draw: (3,), see `answer_trials`."""
    half_d_prime = float(
        differentiate_evidence(np.array([T_AT_THRESHOLD[crowd.family] + NEPER_PER_DB * scaled_db]), crowd.family)[0][0]
    )
    direction_sign = 1.0 if draw[0] < 0.5 else -1.0
    p_correct = crowd.lapse + (1.0 - 2.0 * crowd.lapse) * NormalDist().cdf(half_d_prime - direction_sign * criterion)
    return bool(draw[1] < p_correct)


def estimate_db(rule: StaircaseRule, state: StaircaseState) -> float:
    """Estimate the threshold of a complete run, in dB re 1 N, as in the analysis of a session: the mean of the averaged
    reversals, or for Psi the posterior mean, at most the cap."""
    if rule.is_bayesian:
        cap_db = to_db(rule.cap_n)
        return min(estimate_threshold(compute_posterior(state.answered, cap_db), cap_db).mean_db, cap_db)
    return float(np.mean(state.reversal_levels_db[-rule.averaged_reversals :]))
