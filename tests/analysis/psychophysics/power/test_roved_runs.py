"""Roved levels in simulated studies: played around the staircase's level, felt and analysed as played."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.hierarchy.curve import NEPER_PER_DB, T_AT_THRESHOLD, Family
from analysis.psychophysics.power.compare_rules import (
    SimulatedPerson,
    answer_trials,
    compare_rules,
    list_compared_rules,
)
from analysis.psychophysics.power.felt_delivery import tabulate_felt_delivery
from analysis.psychophysics.power.simulated_study import FAMILIES, Crowd, _apply_delivery, simulate_study
from analysis.psychophysics.power.staircase_kernel import MOST_TRIALS, Participant, Track, pack_rule, simulate_staircase
from protocols.procedure.staircase import begin_staircase, is_finished, step, to_db
from tests.analysis.conftest import PUBLISHED
from tests.analysis.psychophysics.power.test_felt_delivery import FLAWLESS, HZ, ROUGH, reference_run

ROVE_DB = 6.0
RULE = replace(PUBLISHED, cap_n=2.12)
SEEDS = range(12)


def play_compiled(who, rule, rove_db, seed):
    track = Track(*(np.empty(MOST_TRIALS) for _ in range(3)), np.full(rule.reversals, np.nan))
    n, *_ = simulate_staircase(pack_rule(rule, rove_db), who, seed, track)
    return n, track


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("rove_db", [0.0, ROVE_DB])
def test_a_compiled_run_is_the_plain_one_trial_by_trial(family, rove_db):
    crowd = Crowd((HZ,), (0.7,), lapse=0.03, family=family, rove_db=rove_db)
    person = SimulatedPerson(to_db(0.7), 1.7, 0.2)
    who = Participant(T_AT_THRESHOLD[family], 1.7 * NEPER_PER_DB, to_db(0.7), 0.03, 0.2, FAMILIES.index(family))
    for seed in SEEDS:
        n, track = play_compiled(who, RULE, rove_db, seed)
        order = (1, 2, 0) if rove_db else (0, 1)  # the compiled run draws the amplitude first, and only where it roves
        draws = np.random.RandomState(seed).random_sample((MOST_TRIALS, len(order)))[:, order]
        plain, played_n = answer_trials(crowd, RULE, person, np.column_stack([draws, draws[:, 0]])[:, :3])
        assert plain.trials == n
        np.testing.assert_allclose(track.level_db[:n], [to_db(level_n) for level_n in played_n], atol=1e-9)
        np.testing.assert_allclose(track.reversal_db, plain.reversal_levels_db, atol=1e-9)


@pytest.mark.parametrize("delivery", [FLAWLESS, ROUGH])
@pytest.mark.parametrize("threshold_n", [0.3, 0.9, 2.2])
def test_a_roved_run_is_that_of_the_observer_of_sessions(delivery, threshold_n):
    t0, pace = T_AT_THRESHOLD[Family.WEIBULL], 1.7 * NEPER_PER_DB
    who = _apply_delivery(Participant(t0, pace, to_db(threshold_n), 0.03, 0.2, 0), delivery, 0)
    for seed in SEEDS:
        n, track = play_compiled(who, RULE, ROVE_DB, seed)
        slow = reference_run(delivery, threshold_n, seed, RULE, ROVE_DB)
        assert n == len(slow)
        np.testing.assert_allclose(track.level_db[:n], [level_db for level_db, _, _ in slow], atol=1e-9)
        assert [1 if side > 0 else 2 for side in track.side[:n]] == [direction for _, direction, _ in slow]
        assert track.correct[:n].astype(bool).tolist() == [bool(right) for _, _, right in slow]


def test_the_staircase_moves_its_own_level_and_amplitudes_are_even_around_it():
    who, off_db, sides = Participant(T_AT_THRESHOLD[Family.WEIBULL], 2.0 * NEPER_PER_DB, -3.0, 0.02, 0.0, 0), [], []
    for seed in SEEDS:
        n, track = play_compiled(who, RULE, ROVE_DB, seed)
        state = begin_staircase(RULE)
        for index in range(n):
            off_db.append(track.level_db[index] - state.level_db)
            sides.append(track.side[index])
            state = step(RULE, state, bool(track.correct[index]))
        assert is_finished(RULE, state)
        np.testing.assert_allclose(track.reversal_db, state.reversal_levels_db, atol=1e-9)
    assert -3.0 <= min(off_db) < -2.9 and 2.9 < max(off_db) <= 3.0
    assert np.std(off_db) == pytest.approx(ROVE_DB / np.sqrt(12), rel=0.1)
    assert abs(np.corrcoef(off_db, sides)[0, 1]) < 4 / np.sqrt(len(sides))


def test_answers_hold_the_levels_that_were_played_and_means_those_of_the_staircase():
    crowd = Crowd((5.0, HZ), (0.5, 0.7))
    plain, roved = (simulate_study(replace(crowd, rove_db=width), RULE, 3, (4,)) for width in (0.0, ROVE_DB))
    assert len(np.unique(plain.answers.level_db)) < 60
    assert len(roved.answers.level_db) == roved.trials  # no two trials alike
    on_grid = 10.0 * roved.threshold_db[roved.cap_reversals == 0]
    np.testing.assert_allclose(on_grid, np.round(on_grid), atol=1e-6)


@pytest.mark.slow
def test_rules_are_compared_as_they_are_played_and_psi_is_not_roved():
    crowd, rules = Crowd((5.0,), (0.6,)), list_compared_rules(RULE)
    plain, roved = (compare_rules(replace(crowd, rove_db=width), rules, 10, 3) for width in (0.0, ROVE_DB))
    assert all(a != b for a, b in zip(plain[:3], roved[:3], strict=True))
    assert plain[3:] == roved[3:]
    assert all(row.highest_n <= 2.12 * 10.0 ** (ROVE_DB / 40.0) for row in roved)


def test_what_a_device_delivers_is_told_by_the_levels_it_was_given(simulate_study):
    def measured(off_db):
        return [
            replace(trial, nominal_n=trial.level_n, level_n=level_n, delivered_mps2=2.0 * level_n,
                    off_axis_mps2=0.5 * level_n, harmonics_mps2=0.1 * level_n)
            for trial, shift_db in zip(study, off_db, strict=True)
            for level_n in [trial.level_n * 10.0 ** (shift_db / 20.0)]
        ]  # fmt: skip

    study = simulate_study(2, (0.4, 0.4, 0.4, 0.4, 0.4), 3)
    shifts_db = np.random.default_rng(2).uniform(-3.0, 3.0, len(study))
    plain, roved = (tabulate_felt_delivery(measured(off_db), (5.0,), (2.0,)) for off_db in (0.0 * shifts_db, shifts_db))
    for delivery in (plain, roved):
        for table in delivery.tables[0]:
            np.testing.assert_allclose([row[1:] for row in table], [(1.0, 0.25, 0.05)] * len(table), atol=1e-9)
    lowest = [min(row[0] for row in delivery.tables[0][0]) for delivery in (plain, roved)]
    assert lowest[1] < lowest[0]
