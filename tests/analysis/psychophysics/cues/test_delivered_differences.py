"""A planted difference between the directions is named, a small one is not; labels and friction do not confuse it."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.cues.cue_findings import compute_cue_findings, make_cue_warnings
from analysis.psychophysics.cues.cue_sensitivity import INTERNAL_NOISE_DB, fit_same_level_difference
from analysis.psychophysics.cues.delivered_cues import Cue, _convert_to_db, find_cue_gaps, select_delivered_trials
from analysis.psychophysics.study_analysis import analyse_study, make_anova_document
from analysis.reports.cue_section import make_cue_sections
from analysis.reports.study_report import render_study_report
from tests.analysis.conftest import PUBLISHED
from tests.slow_instances import slow

SCATTER_DB = 0.3
ABLE_N = (0.4, 0.4, 0.4, 0.4, 0.4)


def deliver(trials, planted_db, cue=Cue.INTENSITY, at_hz=25.0, seed=5, per_newton=4.0):
    """As a device delivers them: scattered from trial to trial, direction 1 by `planted_db` more at one frequency."""
    random = np.random.default_rng(seed)
    found = []
    for trial in trials:
        more = planted_db if trial.frequency_hz == at_hz and trial.direction_shown == 1 else 0.0
        parts = {each: random.normal(0.0, SCATTER_DB) + (more if each is cue else 0.0) for each in Cue}
        along = per_newton * trial.level_n * 10 ** (parts[Cue.INTENSITY] / 20)
        beside = {each: abs(10 ** ((1.0 + parts[each]) / 20) - 1) * along for each in (Cue.COUPLING, Cue.SPECTRUM)}
        found.append(
            replace(
                trial, delivered_mps2=along, off_axis_mps2=beside[Cue.COUPLING], harmonics_mps2=beside[Cue.SPECTRUM]
            )
        )
    return found


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("cue", list(Cue))
def test_a_planted_mismatch_of_3_db_is_named_where_it_is_and_nowhere_else(simulate_study, seed, cue):
    found = compute_cue_findings(deliver(simulate_study(4, ABLE_N, seed), 3.0, cue, seed=seed))
    assert [(each.cue, each.frequency_hz) for each in found if each.noticed_by] == [(cue, 25.0)]
    (named,) = (each for each in found if each.noticed_by)
    assert named.difference_db == pytest.approx(3.0, abs=0.2)
    assert named.spread_db == pytest.approx(SCATTER_DB, abs=0.05)
    assert named.abilities == pytest.approx([3.0 / np.hypot(noise, SCATTER_DB) for noise in INTERNAL_NOISE_DB], rel=0.1)
    assert len(named.noticed_by) == 4
    (sentence,) = make_cue_warnings(found)
    assert f"{cue.value} at 25 Hz (+" in sentence


@pytest.mark.parametrize("seed", [1, 5, *slow(2, 3, 4)])
def test_a_tenth_of_a_decibel_is_not_named_though_it_is_told_from_none(simulate_study, seed):
    trials = deliver(simulate_study(4, ABLE_N, seed), 0.1, seed=seed)
    found = compute_cue_findings(trials)
    assert make_cue_warnings(found) == ()
    exact = compute_cue_findings(deliver_exactly(trials, 0.1))
    assert exact[0].people[0].lower_db == pytest.approx(exact[0].people[0].upper_db) == pytest.approx(0.1)
    assert make_cue_warnings(exact) == ()


def deliver_exactly(trials, difference_db):
    return [
        replace(trial, delivered_mps2=4.0 * trial.level_n * 10 ** ((trial.direction_shown == 1) * difference_db / 20))
        for trial in trials
    ]


def test_friction_that_eats_weak_forces_is_no_spread_and_no_difference(simulate_study):
    trials = [
        replace(trial, delivered_mps2=4.0 * trial.level_n * 10 ** (-3.0 * (1.0 - np.log10(trial.level_n)) / 20))
        for trial in simulate_study(3, ABLE_N, 8)
    ]
    for each in compute_cue_findings(trials):
        if each.cue is Cue.INTENSITY:
            assert each.spread_db == pytest.approx(0.0, abs=1e-9)
            assert each.difference_db == pytest.approx(0.0, abs=1e-9)


def test_swapped_labels_do_not_cancel_a_difference_of_the_device(simulate_study):
    """For every second participant direction 1 is at -45 degrees; the device is stronger at +45 degrees."""
    trials = []
    for trial in simulate_study(4, ABLE_N, 3):
        swapped = int(trial.subject[1:]) % 2 == 0
        plus = (trial.direction_shown == 1) != swapped
        strength = 4.0 * trial.level_n * (2.0 if plus else 1.0)
        trials.append(replace(trial, angle_deg=45.0 if plus else -45.0, delivered_mps2=strength))
    found = compute_cue_findings(trials)
    first = next(each for each in found if each.cue is Cue.INTENSITY)
    assert [each.difference_db for each in first.people] == pytest.approx([-20 * np.log10(2.0)] * 4)
    # The stronger one is direction 1 of the protocol: the page must say what is subtracted from what.
    (section,) = make_cue_sections(found, (), PUBLISHED)
    assert section.tables[0].notes[0].startswith("Difference: direction at the smaller angle minus that at the larger")
    assert "Positive: more of the cue with answers of the direction at the smaller angle" in section.tables[1].notes[0]


def test_labels_may_be_the_other_way_round_in_a_second_session_of_the_same_person(simulate_study):
    trials = []
    for trial in simulate_study(2, ABLE_N, 3):
        swapped = trial.subject == "s02"
        plus = (trial.direction_shown == 1) != swapped
        strength = 4.0 * trial.level_n * (2.0 if plus else 1.0)
        angle = 45.0 if plus else -45.0
        trials.append(replace(trial, subject="s01", session=trial.subject, angle_deg=angle, delivered_mps2=strength))
    first = next(each for each in compute_cue_findings(trials) if each.cue is Cue.INTENSITY)
    assert [each.difference_db for each in first.people] == pytest.approx([-20 * np.log10(2.0)])


def test_a_session_with_a_single_direction_is_turned_by_the_angles_of_the_others(simulate_study):
    trials = []
    for trial in simulate_study(3, ABLE_N, 3):
        plus = (trial.direction_shown == 1) != (trial.subject == "s02")
        if plus or trial.subject == "s01":
            trials.append(replace(trial, angle_deg=45.0 if plus else -45.0, delivered_mps2=4.0 * trial.level_n))
    for group in select_delivered_trials(trials):
        shown = {name: set(group.side[group.person == place]) for place, name in enumerate(group.subjects)}
        assert shown == {"s01": {1.0, -1.0}, "s02": {-1.0}, "s03": {-1.0}}
    # Without the other angle the label is all that is known.
    alone = [replace(trial, angle_deg=45.0) for trial in trials if trial.subject == "s02"]
    assert {side for group in select_delivered_trials(alone) for side in group.side} == {-1.0}


def test_directions_that_were_played_at_levels_of_their_own_have_no_difference():
    """Three trials, the other direction once, louder: level or direction, the data do not say which."""
    assert (
        fit_same_level_difference(np.array([0.0, 0.1, 6.0]), np.array([0.0, 0.0, 4.0]), np.array([1.0, 1.0, -1.0]))
        is None
    )
    # As many levels, but one of them in both directions.
    values, level, side = np.array([0.0, 3.0, 0.2, 3.3, 6.0]), np.array([0.0, 0.0, 0.0, 0.0, 4.0]), [1, -1, 1, -1, -1]
    fit = fit_same_level_difference(values, level, np.array(side, dtype=float))
    assert fit.difference_db == pytest.approx(-3.05) and fit.df == 2


def test_without_measurements_nothing_is_said(simulate_study):
    assert compute_cue_findings([replace(trial, delivered_mps2=None) for trial in simulate_study(2, ABLE_N, 1)]) == ()


@pytest.mark.slow
def test_trials_without_harmonics_are_counted_and_the_others_are_judged(simulate_study, protocol):
    whole = deliver(simulate_study(4, ABLE_N, 1), 3.0, Cue.SPECTRUM, seed=6)
    at_25 = [number for number, trial in enumerate(whole) if trial.frequency_hz == 25.0]
    some = list(whole)
    for number in at_25[::20]:
        some[number] = replace(some[number], harmonics_mps2=None)
    for number, trial in enumerate(some):
        if trial.frequency_hz == 45.0:
            some[number] = replace(trial, off_axis_mps2=None)
    gaps = {(gap.frequency_hz, gap.cue): (gap.missing, gap.trials) for gap in find_cue_gaps(some)}
    lost, slow = len(at_25[::20]), sum(trial.frequency_hz == 45.0 for trial in some)
    assert gaps == {(25.0, Cue.SPECTRUM): (lost, len(at_25)), (45.0, Cue.COUPLING): (slow, slow)}
    analysis = analyse_study(some, protocol)
    (named,) = (each for each in analysis.cues if each.noticed_by)
    assert (named.cue, named.frequency_hz, len(named.noticed_by)) == (Cue.SPECTRUM, 25.0, 4)
    assert sum(each.trials for each in named.people) == named.answers.trials == len(at_25) - lost
    other = {(each.frequency_hz, each.cue): each for each in compute_cue_findings(whole)}
    for each in analysis.cues:  # nothing else changes but Holm's correction, which has a test less
        if each is not named:
            assert replace(each, p_holm=None) == replace(other[each.frequency_hz, each.cue], p_holm=None)
    said = f"spectrum at 25 Hz in {lost} of {len(at_25)} trials"
    assert [said in warning and "45 Hz" not in warning for warning in analysis.warnings].count(True) == 1
    page = render_study_report(analysis, (), {}, "today")
    assert page.count(said) == 2 and f"{said} and coupling at 45 Hz in any trial" in page
    assert {"frequency_hz": 25.0, "cue": "spectrum", "missing": lost, "trials": len(at_25)} in make_anova_document(
        analysis
    )["cue_gaps"]


@pytest.mark.slow
def test_the_report_and_the_document_name_the_planted_mismatch(simulate_study, protocol):
    trials = simulate_study(4, ABLE_N, 1)
    pages = {}
    for planted_db in (3.0, 0.1):
        analysis = analyse_study(deliver(trials, planted_db, seed=6), protocol)
        pages[planted_db] = render_study_report(analysis, (), {}, "today")
        assert len(make_anova_document(analysis)["cues"]) == 15
    assert all("Was direction the cue?" in page for page in pages.values())
    said = "The two directions differed in more than their direction"
    assert pages[3.0].count(said) == 2 and "intensity at 25 Hz" in pages[3.0]
    assert said not in pages[0.1]
    assert "these data cannot test whether answers depend on the delivery" in pages[0.1]


def test_a_level_that_is_not_positive_has_no_decibels():
    assert np.array_equal(_convert_to_db([1.0, -0.4, 0.0, np.nan]), [0.0, np.nan, np.nan, np.nan], equal_nan=True)
