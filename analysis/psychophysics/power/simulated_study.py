"""Simulation of whole studies: people drawn from a population answer all their runs under a staircase rule or Psi.

True thresholds are normal in dB: median of the frequency + deviation of the person + deviation of person x frequency,
the model that `hierarchy.marginal` fits. Slopes are log-normal, criteria normal. The result has the form that the
analyses take: counted answers, and the threshold of each run.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.psychophysics.hierarchy.answers import Answers, count_cells
from analysis.psychophysics.hierarchy.curve import NEPER_PER_DB, STARTING_SLOPE, T_AT_THRESHOLD, Family
from analysis.psychophysics.power.felt_delivery import FeltDelivery
from analysis.psychophysics.power.psi_kernel import pack_psi, play_psi
from analysis.psychophysics.power.staircase_kernel import (
    LEVEL_TOLERANCE_DB,
    MOST_TRIALS,
    Participant,
    SimulatedRun,
    Track,
    pack_rule,
    simulate_staircase,
)
from analysis.psychophysics.thresholds import CUT_PROBABILITY
from equalizer.signals.signal import FloatArray
from protocols.definition.staircase_rule import StaircaseRule
from protocols.procedure.staircase import to_db

_HABIT_SEED = 0x4AB1
"""Last number of the seed from which habits (guessing, drift, order of runs) are drawn: all other draws are then the
same as in a study without habits."""
FAMILIES = (Family.WEIBULL, Family.LOGISTIC, Family.GAUSS)
"""Families of curves in the order of the kernel's numbers (`staircase_kernel.compute_evidence`)."""


@dataclass(frozen=True, slots=True)
class Crowd:
    """Population from which the people of a study are drawn. A threshold is the level at which an attentive, unbiased
    participant answers right with probability 79.37 %; thresholds are normal in dB."""

    frequencies_hz: tuple[float, ...]
    """Frequencies in ascending order."""
    medians_n: tuple[float, ...]
    """Median threshold at each frequency, N."""
    person_sd_db: float = 2.5
    """Standard deviation between people of the deviation common to all frequencies."""
    frequency_sd_db: tuple[float, ...] | float = 1.7
    """Standard deviation of the further deviation at each frequency: one value for all frequencies, or one each."""
    slope: float | None = None
    """Median slope; None: `STARTING_SLOPE` of the family, as steep as a Weibull slope of 2 over newtons."""
    slope_log_sd: float = 0.25
    """Standard deviation between people of the slope's natural logarithm."""
    lapse: float = 0.02
    """Lapse rate: probability of a wrong answer at the highest levels."""
    criterion_sd: float = 0.15
    """Standard deviation between people of the criterion, in units of d'."""
    family: Family = Family.WEIBULL
    guessers: float = 0.0
    """Share of people who guess in every trial."""
    criterion_drift_sd: float = 0.0
    """Standard deviation between people of the criterion's drift per 100 trials, in units of d'."""
    unsure: float = 0.0
    """Distance from the criterion, in standard errors, within which people ask for the same trial again; see
    `Participant`."""
    repeats: int = 0
    """Largest number of such repeats in a run."""
    delivery: FeltDelivery | None = None
    """Delivery of the commands by a device; None: people feel the commands. Thresholds are those on an ideal device."""
    rove_db: float = 0.0
    """Width of the range around the staircase's level from which each amplitude is drawn, as `stimulus.rove_db` of a
    protocol. Levels of Psi are not roved."""


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedStudy:
    """Answers, thresholds of runs, and true thresholds of a simulated study."""

    answers: Answers
    threshold_n: FloatArray
    """(people, frequencies): arithmetic mean of the averaged reversal levels, N; NaN for a run without all reversals.
    For Psi: posterior mean, at most the cap."""
    threshold_db: FloatArray
    """(people, frequencies): mean of the same levels in dB; for Psi, the same posterior mean."""
    cap_reversals: FloatArray
    """(people, frequencies): number of averaged reversals at the cap; for Psi, 1 where the threshold is cut by the cap,
    else 0."""
    trials: int
    """Number of trials of all runs together."""
    true_db: FloatArray
    """(people, frequencies): true thresholds in dB re 1 N."""


@dataclass(frozen=True, slots=True, eq=False)
class _RunThresholds:
    """Thresholds of all simulated runs, (runs,) each, as the fields of `SimulatedStudy`."""

    newton: FloatArray
    db: FloatArray
    cap_reversals: FloatArray


def simulate_study(crowd: Crowd, rule: StaircaseRule, people: int, seed: tuple[int, ...]) -> SimulatedStudy:
    """Draw people from the crowd and simulate all their runs under this rule. The same seed gives the same study, in
    any order of simulations."""
    rng, k = np.random.default_rng(seed), len(crowd.frequencies_hz)
    true_db, participants = _draw_people(crowd, people, rng)
    seeds = rng.integers(0, 2**32, size=(people, k), dtype=np.uint64)
    tracks = _allocate_tracks(people * k, rule.reversals)
    run_results = _simulate_sessions(crowd, rule, participants, seeds.ravel(), tracks, (*seed, _HABIT_SEED))
    trial_counts = np.array([run.trials for run in run_results])
    is_within_run = np.arange(MOST_TRIALS) < trial_counts[:, None]
    answers = count_cells(
        tuple(f"S{number + 1:03d}" for number in range(people)),
        crowd.frequencies_hz,
        np.repeat(np.arange(people * k), trial_counts),
        tracks.level_db[is_within_run],
        tracks.side[is_within_run],
        tracks.correct[is_within_run].astype(np.bool_),
    )
    run_thresholds = (_compute_posterior_means if rule.is_bayesian else _compute_reversal_means)(
        rule, tracks, run_results
    )
    return SimulatedStudy(
        answers=answers,
        threshold_n=run_thresholds.newton.reshape(people, k),
        threshold_db=run_thresholds.db.reshape(people, k),
        cap_reversals=run_thresholds.cap_reversals.reshape(people, k),
        trials=int(trial_counts.sum()),
        true_db=true_db,
    )


def _draw_people(crowd: Crowd, people: int, rng: np.random.Generator) -> tuple[FloatArray, list[Participant]]:
    """Draw people from the crowd. Returns true thresholds (people, frequencies) in dB re 1 N, and a participant for
    each run, person by person."""
    k = len(crowd.frequencies_hz)
    interaction_sd_db = np.broadcast_to(np.asarray(crowd.frequency_sd_db, dtype=np.float64), (k,))
    true_db = 20.0 * np.log10(np.asarray(crowd.medians_n)) + crowd.person_sd_db * rng.standard_normal((people, 1))
    true_db = true_db + interaction_sd_db * rng.standard_normal((people, k))
    slopes = (crowd.slope or STARTING_SLOPE[crowd.family]) * np.exp(crowd.slope_log_sd * rng.standard_normal(people))
    criteria = crowd.criterion_sd * rng.standard_normal(people)
    t0, family = T_AT_THRESHOLD[crowd.family], FAMILIES.index(crowd.family)
    return true_db, [
        Participant(
            t0, slopes[person] * NEPER_PER_DB, true_db[person, frequency_index], crowd.lapse, criteria[person], family
        )
        for person in range(people)
        for frequency_index in range(k)
    ]


def _compute_reversal_means(rule: StaircaseRule, tracks: Track, run_results: Sequence[SimulatedRun]) -> _RunThresholds:
    """Compute the means of the averaged reversals of each run; NaN where a run did not reach all its reversals."""
    averaged_db = tracks.reversal_db[:, -rule.averaged_reversals :]
    completeness_factor = np.where(np.array([run.reversals for run in run_results]) == rule.reversals, 1.0, math.nan)
    averaged_n = np.minimum(10.0 ** (averaged_db / 20.0), rule.cap_n)
    is_at_cap = averaged_db >= to_db(rule.cap_n) - LEVEL_TOLERANCE_DB
    return _RunThresholds(
        averaged_n.mean(axis=1) * completeness_factor,
        averaged_db.mean(axis=1) * completeness_factor,
        is_at_cap.sum(axis=1).astype(np.float64),
    )


def _compute_posterior_means(rule: StaircaseRule, tracks: Track, run_results: Sequence[SimulatedRun]) -> _RunThresholds:
    """Collect the posterior means of Psi, limited by the cap; cut by it, as in `thresholds.compute_run_threshold`,
    where the probability of a threshold above the cap exceeds `CUT_PROBABILITY`."""
    mean_db = np.minimum([run.mean_db for run in run_results], to_db(rule.cap_n))
    is_cut = np.array([run.above_cap for run in run_results]) > CUT_PROBABILITY
    return _RunThresholds(np.minimum(10.0 ** (mean_db / 20.0), rule.cap_n), mean_db, is_cut.astype(np.float64))


def _apply_delivery(participant: Participant, delivery: FeltDelivery | None, frequency_index: int) -> Participant:
    """Return the participant with the stimuli that the device delivers at the frequency of index `frequency_index`;
    unchanged without a delivery: the commanded amplitudes are then felt."""
    if delivery is None:
        return participant
    felt_1, felt_2 = (np.array(table) * (1.0, 1.0, 1.0, delivery.masking) for table in delivery.tables[frequency_index])
    return participant._replace(
        felt_1=felt_1,
        felt_2=felt_2,
        adaptation_db=delivery.adaptation_db,
        adaptation_trials=delivery.adaptation_trials,
    )


def _allocate_tracks(run_count: int, reversal_count: int) -> Track:
    """Allocate the tracks of all runs together: arrays as in `Track` with a leading axis (runs,), reversals NaN."""
    levels, sides, correct = (np.empty((run_count, MOST_TRIALS)) for _ in range(3))
    return Track(levels, sides, correct, np.full((run_count, reversal_count), np.nan))


def _simulate_sessions(
    crowd: Crowd,
    rule: StaircaseRule,
    participants: list[Participant],
    seeds: NDArray[np.uint64],
    tracks: Track,
    habit_seed: tuple[int, ...],
) -> list[SimulatedRun]:
    """Fill the tracks, person by person, with the runs of each person in random order. Returns the result of each run,
    in the order of the tracks. seeds: (runs,); habit_seed: seed of the habits."""
    habit_rng, k = np.random.default_rng(habit_seed), len(crowd.frequencies_hz)
    simulate_run = (
        partial(play_psi, pack_psi(rule))
        if rule.is_bayesian
        else partial(simulate_staircase, pack_rule(rule, crowd.rove_db))
    )
    run_results = [SimulatedRun(0, 0)] * len(participants)
    for first_run in range(0, len(participants), k):
        is_guesser, drift = (
            habit_rng.random() < crowd.guessers,
            0.01 * crowd.criterion_drift_sd * habit_rng.standard_normal(),
        )
        trials_before = 0
        for frequency_index in habit_rng.permutation(k):
            run = first_run + int(frequency_index)
            participant = _apply_delivery(participants[run], crowd.delivery, int(frequency_index))._replace(
                criterion_per_trial=drift, trials_before=trials_before, unsure=crowd.unsure, repeats=crowd.repeats
            )
            if is_guesser:
                participant = participant._replace(lapse=0.5)
            track = Track(*(rows[run] for rows in tracks))
            run_results[run] = SimulatedRun(*simulate_run(participant, int(seeds[run]), track))
            trials_before += run_results[run].trials
    return run_results
