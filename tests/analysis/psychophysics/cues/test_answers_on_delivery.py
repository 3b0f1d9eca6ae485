"""Answers that follow the delivery within a direction are found; those that follow the direction are not accused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr

from analysis.psychophysics.cues.answers_on_delivery import CUE_ONLY_SLOPE, regress_answers_on_delivery
from analysis.psychophysics.cues.cue_findings import compute_cue_findings, make_cue_warnings
from analysis.psychophysics.cues.delivered_cues import Cue, select_delivered_trials

TRIALS = 60


def simulate_answers(template, seed, *, scatter_db, by_strength, noise_db=1.0, people=4):
    """Trials at 25 Hz on five levels. by_strength: weight of the cue in units of a participant who uses nothing else;
    direction is felt with d' of 1.6 at the middle level, and more where the stimulus is stronger."""
    random = np.random.default_rng(seed)
    trials = []
    for person in range(people):
        for number in range(TRIALS):
            level_db, side = random.integers(-2, 3) - 6.0, random.choice([1.0, -1.0])
            more_db = random.normal(0.0, scatter_db)
            felt = 0.8 * 10 ** ((level_db + 6.0 + more_db) / 20) * side if by_strength < 1 else 0.0
            first = random.random() < ndtr(felt + by_strength * (more_db + 1.5 * side) / noise_db)
            shown, answer = (1 if side > 0 else 2), (1 if first else 2)
            trials.append(
                replace(
                    template, subject=f"s{person}", trial=number, frequency_hz=25.0, level_n=10 ** (level_db / 20),
                    direction_shown=shown, answer=answer, correct=shown == answer,
                    delivered_mps2=10 ** ((level_db + more_db + 1.5 * side) / 20), off_axis_mps2=None,
                )
            )  # fmt: skip
    return trials


@pytest.fixture
def template(simulate):
    return simulate(0.5, np.random.default_rng(1))[0]


def strength_regression(trials):
    (group,) = select_delivered_trials(trials)
    (found,) = (each for each in regress_answers_on_delivery(group) if each.cue is Cue.INTENSITY)
    return found


@pytest.mark.parametrize("seed", range(5))
def test_a_participant_who_goes_by_strength_is_found_with_the_slope_of_his_noise(template, seed):
    trials = simulate_answers(template, seed, scatter_db=1.5, by_strength=1.0)
    found = strength_regression(trials)
    assert found.lower < CUE_ONLY_SLOPE < found.upper
    assert found.lower > 0.5
    assert found.is_conclusive
    said = make_cue_warnings(compute_cue_findings(trials))[-1]
    assert said.startswith("Within a direction, answers followed what was delivered")


@pytest.mark.slow
def test_feeling_directions_better_when_they_are_stronger_is_not_taken_for_the_cue(template):
    """The share of p below 5 % over 200 studies in which strength helps, but tells nothing: binomial, 4 errors."""
    p = [
        strength_regression(simulate_answers(template, seed, scatter_db=1.5, by_strength=0.0, people=2)).p
        for seed in range(200)
    ]
    assert np.mean(np.array(p) < 0.05) == pytest.approx(0.05, abs=4 * np.sqrt(0.05 * 0.95 / 200))


def test_a_device_that_repeats_itself_cannot_tell_and_says_so(template):
    still = strength_regression(simulate_answers(template, 3, scatter_db=0.0, by_strength=1.0))
    assert still.slope is None and not still.is_conclusive
    little = strength_regression(simulate_answers(template, 3, scatter_db=0.02, by_strength=1.0))
    assert not little.is_conclusive
    assert little.upper - little.lower > CUE_ONLY_SLOPE


def test_who_is_always_right_shows_nothing(template):
    trials = simulate_answers(template, 4, scatter_db=1.5, by_strength=0.0)
    sure = [replace(trial, answer=trial.direction_shown, correct=True) for trial in trials]
    assert not strength_regression(sure).is_conclusive
    assert strength_regression(sure).p > 0.9


def simulate_roved_answers(template, seed, by_strength):
    """Levels drawn from 6 dB; harmonics with a floor, which fall beside a stronger stimulus and tell nothing."""
    random = np.random.default_rng(seed)
    trials = []
    for number in range(4 * TRIALS):
        level_db, side, more_db = random.integers(-2, 3) - 6.0, random.choice([1.0, -1.0]), random.uniform(-3.0, 3.0)
        played_n = 10 ** ((level_db + more_db) / 20)
        first = random.random() < ndtr(more_db if by_strength else 1.6 * played_n * side)
        shown, answer = (1 if side > 0 else 2), (1 if first else 2)
        trials.append(
            replace(
                template, subject=f"s{number % 4}", trial=number, frequency_hz=25.0, level_n=played_n,
                nominal_n=10 ** (level_db / 20), direction_shown=shown, answer=answer, correct=shown == answer,
                delivered_mps2=4 * played_n * 10 ** (random.normal(0.0, 0.1) / 20), off_axis_mps2=None,
                harmonics_mps2=0.3 * 10 ** (random.normal(0.0, 0.3) / 20),
            )
        )  # fmt: skip
    return {found.cue: found.affects_answers for found in compute_cue_findings(trials)}


@pytest.mark.parametrize("seed", range(3))
def test_strength_of_a_roved_study_does_not_accuse_the_spectrum_that_follows_it(template, seed):
    assert simulate_roved_answers(template, seed, by_strength=True) == {Cue.INTENSITY: True, Cue.SPECTRUM: False}
    assert simulate_roved_answers(template, seed, by_strength=False) == {Cue.INTENSITY: False, Cue.SPECTRUM: False}
