"""The primary analysis finds what was planted, near the cap too, and finds nothing where nothing is."""

import re

import numpy as np
import pytest

from analysis.psychophysics.hierarchy.answers import count_answers, count_cells
from analysis.psychophysics.hierarchy.curve import Family
from analysis.psychophysics.hierarchy.fit import fit_hierarchy
from analysis.psychophysics.hierarchy.inference import (
    compute_pseudo_thresholds,
    estimate_direction_limit,
    estimate_medians,
)
from analysis.psychophysics.hierarchy.objective import LOG_SLOPE_BOUNDS
from analysis.psychophysics.hierarchy.primary import FAR_ABOVE_NOTE, compute_primary_analysis
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from tests.analysis.conftest import PUBLISHED, simulate_run
from tests.slow_instances import slow_after, slow_rows

HZ = (5.0, 15.0, 25.0, 35.0, 45.0)
NEAR_CAP = Crowd(HZ, (0.35, 0.6, 0.85, 3.0, 4.0))


def simulate_studies(crowd, count, people=10):
    return [simulate_study(crowd, PUBLISHED, people, (77, number)) for number in range(count)]


@pytest.mark.slow
def test_a_contrast_towards_the_cap_is_not_lost():
    """Where reversal means come out 5 dB too small (3 N at 35 Hz, 4 N at 45 Hz)."""
    true = 20 * np.log10(4.0 / 0.35)
    fitted, means = [], []
    for study in simulate_studies(NEAR_CAP, 8):
        fit = fit_hierarchy(study.answers)
        fitted.append(fit.means_db[4] - fit.means_db[0])
        means.append(np.mean(study.threshold_db[:, 4] - study.threshold_db[:, 0]))
    assert np.mean(means) - true < -3.5
    assert np.mean(fitted) - true == pytest.approx(0.0, abs=1.6)  # standard error 0.5 dB


@pytest.mark.parametrize("family", slow_after(1, list(Family)))
def test_medians_are_recovered_for_each_shape_of_the_curves(family):
    crowd = Crowd((5.0, 35.0), (0.5, 1.6), family=family, lapse=0.03)
    errors = [fit_hierarchy(s.answers).means_db - s.true_db.mean(axis=0) for s in simulate_studies(crowd, 5)]
    assert np.abs(np.mean(errors, axis=0)).max() < 0.8


@pytest.mark.slow
def test_spreads_slope_and_criterion_are_recovered():
    crowd = Crowd((5.0, 15.0, 25.0), (0.5, 0.7, 0.9), person_sd_db=3.0, frequency_sd_db=1.5, criterion_sd=0.4)
    (study,) = simulate_studies(crowd, 1, people=40)
    found = compute_primary_analysis(study.answers, 3.0)
    assert found.person_sd_db == pytest.approx(3.0, rel=0.4)
    assert found.frequency_sd_db == pytest.approx(1.5, rel=0.4)
    assert found.slope == pytest.approx(2.0, rel=0.25)
    assert found.criterion_sd == pytest.approx(0.4, rel=0.4)
    assert 0.0 < found.lapse < 0.05
    assert max(abs(b.observed - b.predicted) for b in found.goodness.bins) < 0.08
    assert sum(b.trials for b in found.goodness.bins) == found.trials


def test_pseudo_thresholds_average_to_the_estimate():
    (study,) = simulate_studies(NEAR_CAP, 1)
    fit = fit_hierarchy(study.answers)
    np.testing.assert_allclose(compute_pseudo_thresholds(fit).mean(axis=0), fit.means_db, atol=1e-9)


def test_the_same_answers_at_all_frequencies_are_no_difference_to_test():
    """Their pseudo-thresholds differ by the tolerance of the fit, 1e-8 dB, which a t test would take for an effect."""
    level_db, run, is_correct, side = np.tile(np.linspace(-15, 8, 40), 9), np.repeat(np.arange(9), 40), [], []
    for person in range(3):
        random = np.random.default_rng([0, person])
        share = 1 - 0.5 * np.exp(-(10 ** ((level_db[:40] + 6 - person) / 10)))
        is_correct += 3 * [random.random(40) < share]
        side += 3 * [np.where(random.random(40) < 0.5, 1.0, -1.0)]
    answers = count_cells(
        ("p0", "p1", "p2"), (10.0, 20.0, 30.0), run, level_db, np.concatenate(side), np.concatenate(is_correct)
    )
    assert 0 < np.abs(np.diff(compute_pseudo_thresholds(fit_hierarchy(answers)), axis=1)).max() < 1e-6
    found = compute_primary_analysis(answers, 3.0, declared_hz=(20.0, 10.0))
    assert (found.contrasts, found.declared_contrast, found.overall.p) == ((), None, None)
    assert "change alike" in found.overall.notes[-1]


@pytest.mark.slow
def test_above_the_cap_there_is_a_bound_and_no_size():
    (study,) = simulate_studies(Crowd((5.0, 45.0), (0.5, 8.0)), 1)
    low, high = compute_primary_analysis(study.answers, 3.0).medians
    assert low.upper_db is not None and low.lower_db < low.db < low.upper_db
    assert high.above_cap and high.upper_db is None and high.upper_n is None
    assert high.lower_db < 20 * np.log10(8.0)
    assert high.lower_n > 2.0


@pytest.mark.slow
def test_answers_that_contradict_nothing_give_no_lower_bound():
    """Two people with one wrong answer each at 45 Hz: even a median of 0.05 N may have given them."""
    level = np.concatenate([np.tile([0.0, -3.0, -6.0, -9.0], 6), [9.0, 9.0]])
    right = np.concatenate([np.tile([True, True, True, False], 6), [False, False]])
    run = np.concatenate([np.repeat([0, 2], 12), [1, 3]])
    fit = fit_hierarchy(count_cells(("a", "b"), (5.0, 45.0), run, level, np.tile([1.0, -1.0], 13), right))
    median = estimate_medians(fit, fit.means_db[1] - 0.1, 0.95)[1]
    assert median.above_cap and median.lower_db is None and median.lower_n is None


@pytest.mark.slow
def test_guessers_leave_everything_finite():
    (study,) = simulate_studies(Crowd((5.0, 45.0), (0.5, 1e4)), 1, people=5)
    found = compute_primary_analysis(study.answers, 3.0)
    assert found.converged
    assert np.isfinite([m.db for m in found.medians]).all()
    assert found.medians[1].above_cap


@pytest.mark.parametrize(("people", "hz", "trials"), [(2, (5.0, 45.0), 8), *slow_rows((3, (5.0, 25.0, 45.0), 10))])
def test_answers_that_bound_no_slope_leave_everything_finite(people, hz, trials):
    """All right down to the lowest level at 5 Hz, all wrong at the cap elsewhere: the search went on to slopes of 1e100
    and more, and ended in matrices of NaN."""
    run, trial = (index.ravel() for index in np.indices((people * len(hz), trials)))
    is_right = run % len(hz) == 0
    level_db = np.where(is_right, 9.54 - trial * 30.0 / trials, 9.54 - trial % 2)
    side = np.where((trial + run // len(hz)) % 2, 1.0, -1.0)
    found = compute_primary_analysis(count_cells(tuple("abc"[:people]), hz, run, level_db, side, is_right), 3.0)
    assert np.log(found.slope) <= LOG_SLOPE_BOUNDS[1] + 1e-9
    assert np.isfinite([median.db for median in found.medians]).all()


@pytest.mark.slow
def test_nothing_is_known_of_differences_between_frequencies_that_no_one_tells():
    """Two medians of 30 dB above the cap have no difference: of guessers, half of such contrasts had p below 0.05."""
    (study,) = simulate_studies(Crowd((5.0, 35.0, 45.0), (0.5, 1e4, 1e4)), 1, people=6)
    found = compute_primary_analysis(study.answers, 3.0, declared_hz=(45.0, 35.0))
    assert found.far_above_hz == (35.0, 45.0)
    assert found.declared_contrast is None
    assert [c.frequency_hz for c in found.contrasts] == [35.0, 45.0]  # to 5 Hz, which is known
    assert all(c.lower_db > 6.0 for c in found.contrasts)
    assert found.overall.f is None and found.overall.notes == (FAR_ABOVE_NOTE,)  # it would test 45 against 35 Hz, too
    (nothing,) = simulate_studies(Crowd((5.0, 45.0), (1e4, 1e4)), 1, people=6)
    found = compute_primary_analysis(nothing.answers, 3.0)
    assert found.far_above_hz == (5.0, 45.0)
    assert found.contrasts == () and found.overall.f is None and found.overall.p_huynh_feldt is None
    assert found.overall.notes == (FAR_ABOVE_NOTE,)


@pytest.mark.slow
def test_a_contrast_that_is_not_told_stays_in_holms_family():
    """The data choose which contrasts are told; the family that they are corrected for was planned."""
    (study,) = simulate_studies(Crowd((5.0, 35.0, 45.0), (1e4, 2.5, 1e4)), 1, people=6)
    found = compute_primary_analysis(study.answers, 3.0)
    assert found.far_above_hz == (5.0, 45.0)
    (told,) = found.contrasts
    assert told.frequency_hz == 35.0 and told.p > 0.0
    assert told.p_holm == pytest.approx(min(1.0, 2.0 * told.p))


def test_people_with_the_same_answers_have_no_spread_and_no_error_is_raised():
    level = np.tile([0.0, -3.0, -6.0, -9.0], 36)
    right = np.tile([True, True, True, False], 36)
    answers = count_cells(
        ("a", "b", "c"), (5.0, 45.0), np.repeat(np.arange(6), 24), level, np.tile([1.0, -1.0], 72), right
    )
    found = compute_primary_analysis(answers, 3.0)
    assert found.contrasts == ()
    for median in found.medians:
        assert median.lower_db == pytest.approx(median.db) == pytest.approx(median.upper_db)


@pytest.mark.slow
def test_flat_thresholds_are_equal_and_equivalent():
    crowd = Crowd((5.0, 15.0, 25.0), (0.5, 0.5, 0.5), frequency_sd_db=0.5)
    (study,) = simulate_studies(crowd, 1, people=24)
    found = compute_primary_analysis(study.answers, 3.0)
    assert found.overall.p_huynh_feldt > 0.01
    assert all(c.p_equivalence < 0.05 for c in found.contrasts)


@pytest.mark.slow
def test_answers_at_the_cap_count_and_unfinished_runs_too():
    rng = np.random.default_rng(1)
    trials = [
        trial
        for subject in ("a", "b", "c")
        for place, true in enumerate((0.6, 9.0))
        for trial in simulate_run(true, rng, subject=subject, run=place, frequency_hz=5.0 + 40 * place)[:50]
    ]
    answers = count_answers(trials, (5.0, 45.0))
    assert answers.trials == len(trials)
    assert (answers.level_db > 20 * np.log10(2.999)).any()
    assert compute_primary_analysis(answers, 3.0).medians[1].above_cap


def test_one_person_or_no_answer_gives_no_group():
    trials = simulate_run(1.0, np.random.default_rng(0), frequency_hz=5.0)
    assert compute_primary_analysis(count_answers(trials, (5.0,)), 3.0) is None
    assert count_answers([], (5.0,)) is None
    assert compute_primary_analysis(None, 3.0) is None


def test_the_direction_limit_lies_where_the_line_meets_the_cap():
    rng = np.random.default_rng(4)
    pseudo = np.array([-8.0, -4.0, 0.0, 8.0, 12.0]) + 0.3 * rng.standard_normal((10, 5))
    found = estimate_direction_limit(HZ, pseudo, 10.0, 0.95)
    assert found.frequency_hz == pytest.approx((35 * 45) ** 0.5, rel=0.02)
    assert 35.0 < found.lower_hz < found.frequency_hz < found.upper_hz < 45.0


def test_a_median_that_falls_below_the_cap_again_is_told_beside_the_limit():
    rng = np.random.default_rng(4)
    pseudo = np.array([-8.0, -4.0, 0.0, 14.0, 6.0]) + 0.3 * rng.standard_normal((10, 5))
    found = estimate_direction_limit(HZ, pseudo, 10.0, 0.95)
    assert found.frequency_hz == pytest.approx(25 * (35 / 25) ** (10 / 14), rel=0.02)
    again = re.search(r"From (\d+\.\d) Hz the median threshold is below the cap again", found.words)
    assert float(again[1]) == pytest.approx((35 * 45) ** 0.5, rel=0.02)
    rising = np.array([-8.0, -4.0, 0.0, 8.0, 12.0]) + 0.3 * rng.standard_normal((10, 5))
    assert "again" not in estimate_direction_limit(HZ, rising, 10.0, 0.95).words


@pytest.mark.slow
def test_the_limit_is_below_a_frequency_whose_median_is_shown_to_be_above_the_cap():
    """Far above the cap the influence functions are as wide as the extrapolation: 14 ± 4.5 dB at 45 Hz."""
    rng = np.random.default_rng(4)
    pseudo = np.array([-8.0, -4.0, 0.0, 8.0, 14.0]) + np.array([0.3, 0.3, 0.3, 0.3, 8.0]) * rng.standard_normal((10, 5))
    assert estimate_direction_limit(HZ, pseudo, 10.0, 0.95).upper_hz is None
    found = estimate_direction_limit(HZ, pseudo, 10.0, 0.95, above_cap_hz=(45.0,))
    assert 40.0 < found.upper_hz < 45.0
    (study,) = simulate_studies(Crowd((5.0, 25.0, 45.0), (0.3, 0.5, 8.0)), 1)
    analysis = compute_primary_analysis(study.answers, 3.0)
    assert analysis.medians[2].lower_n > 3.0 and analysis.limit.upper_hz < 45.0


@pytest.mark.parametrize("shown_above", [(25.0,), (25.0, 45.0)])
def test_the_interval_ends_below_the_first_frequency_shown_to_be_above_the_cap(shown_above):
    rng, hz = np.random.default_rng(1), (5.0, 15.0, 25.0, 45.0)
    noise = rng.standard_normal((10, 4))
    pseudo = np.array([-6.0, 3.0, 14.0, 25.0]) + np.array([1.0, 1.0, 12.0, 30.0]) * (noise - noise.mean(axis=0))
    assert estimate_direction_limit(hz, pseudo, 9.5, 0.95).upper_hz is None
    found = estimate_direction_limit(hz, pseudo, 9.5, 0.95, above_cap_hz=shown_above)
    assert 15.0 < found.lower_hz < found.frequency_hz < found.upper_hz < 25.0


def test_the_interval_goes_on_where_the_median_is_below_the_cap_again():
    noise = np.random.default_rng(1).standard_normal((10, 4))
    pseudo = np.array([-6.0, 14.0, 9.0, 14.0]) + noise - noise.mean(axis=0)
    found = estimate_direction_limit((5.0, 15.0, 25.0, 45.0), pseudo, 9.5, 0.95, above_cap_hz=(15.0, 45.0))
    assert 25.0 < found.upper_hz < 45.0


def test_an_interval_narrower_than_the_grid_still_holds_the_limit():
    pseudo = np.array([-8.0, -4.0, 0.0, 8.0, 12.0]) + 1e-9 * np.arange(10)[:, None]
    found = estimate_direction_limit(HZ, pseudo, 10.0, 0.95)
    assert found.lower_hz <= found.frequency_hz <= found.upper_hz
    assert found.lower_hz == pytest.approx(found.frequency_hz, rel=0.002)
    assert found.upper_hz == pytest.approx(found.frequency_hz, rel=0.002)


def test_no_limit_is_said_beyond_what_was_played():
    low = estimate_direction_limit(HZ, np.full((10, 5), 2.0) + np.arange(10)[:, None], 30.0, 0.95)
    high = estimate_direction_limit(HZ, np.full((10, 5), 20.0) + np.arange(10)[:, None], 9.0, 0.95)
    assert low.frequency_hz is None and "stays below the cap" in low.words
    assert high.frequency_hz is None and "already at 5 Hz" in high.words
