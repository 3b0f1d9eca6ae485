"""People of the device-free path feel what was delivered, as those of a session do."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.hierarchy.curve import NEPER_PER_DB, T_AT_THRESHOLD, Family
from analysis.psychophysics.power.felt_delivery import FeltDelivery, tabulate_felt_delivery
from analysis.psychophysics.power.simulated_study import Crowd, _apply_delivery, simulate_study
from analysis.psychophysics.power.staircase_kernel import MOST_TRIALS, Participant, Track, pack_rule, simulate_staircase
from protocols.procedure.staircase import begin_staircase, is_finished, step
from protocols.trial import Phase
from study.participants.delivered_feeler import MPS2_PER_N, DeliveredFeeler
from study.participants.direction_feeler import DirectionFeeler
from study.participants.observer import PerceivedStimulus
from study.session.stimulus.delivered import DeliveredMotion
from tests.analysis.conftest import PUBLISHED

HZ = 25.0
PER_NEWTON = dict(MPS2_PER_N)[HZ]
FLAWLESS_TABLE = ((0.0, 1.0, 0.0, 0.0),)
FLAWLESS = FeltDelivery(((FLAWLESS_TABLE, FLAWLESS_TABLE),), adaptation_db=0.0)
RISING = ((-12.0, 0.3, 0.1, 0.2), (-6.0, 0.7, 0.2, 0.15), (0.0, 0.9, 0.3, 0.1))
"""As friction lets through."""
ROUGH = FeltDelivery(((RISING, ((-3.0, 1.1, 0.7, 0.6), (3.0, 1.2, 0.7, 0.1))),), 0.9, 1.5, 12.0)
CIRCLE = FeltDelivery(((RISING, ((0.0, 0.3, 1.2, 0.0),)),))


def reference_run(delivery, threshold_n, seed, rule=PUBLISHED, rove_db=0.0):
    """The observer of sessions and the rule of sessions, on the random numbers of the compiled run."""
    feeler = DirectionFeeler("slow", ((HZ, threshold_n),), slope=1.7, lapse=0.03, criterion=0.2)
    observer = DeliveredFeeler("slow", feeler, delivery.masking, delivery.adaptation_db, delivery.adaptation_trials)
    random, state, found = np.random.RandomState(seed), begin_staircase(rule), []
    while not is_finished(rule, state):
        level_db = state.level_db + (rove_db * (random.random_sample() - 0.5) if rove_db else 0.0)
        direction, trial = (1 if random.random_sample() < 0.5 else 2), len(found)
        level_n, table = 10.0 ** (level_db / 20.0), np.array(delivery.tables[0][direction - 1])
        along, across, harmonics = (np.interp(level_db, table[:, 0], table[:, place]) for place in (1, 2, 3))
        flawless = PER_NEWTON * level_n
        measured = DeliveredMotion(along * flawless, across * flawless, 0.1, harmonics * flawless)
        felt = PerceivedStimulus(0, trial, 0, Phase.TEST, HZ, level_n, direction, trial, delivered=measured)
        right = random.random_sample() < observer.compute_proportion_correct(felt)
        found.append((level_db, direction, right))
        state = step(rule, state, bool(right))
    return found


@pytest.mark.parametrize("delivery", [FLAWLESS, ROUGH, CIRCLE])
@pytest.mark.parametrize("threshold_n", [0.3, 0.9, 2.2])
def test_a_compiled_run_is_that_of_the_observer_of_sessions(delivery, threshold_n):
    t0, pace, threshold_db = T_AT_THRESHOLD[Family.WEIBULL], 1.7 * NEPER_PER_DB, 20 * np.log10(threshold_n)
    who = _apply_delivery(Participant(t0, pace, threshold_db, 0.03, 0.2, 0), delivery, 0)
    for seed in range(8):
        track = Track(*(np.empty(MOST_TRIALS) for _ in range(3)), np.full(PUBLISHED.reversals, np.nan))
        n, *_ = simulate_staircase(pack_rule(PUBLISHED), who, seed, track)
        slow = reference_run(delivery, threshold_n, seed)
        assert n == len(slow)
        np.testing.assert_allclose(track.level_db[:n], [level_db for level_db, _, _ in slow], atol=1e-9)
        assert [1 if side > 0 else 2 for side in track.side[:n]] == [direction for _, direction, _ in slow]
        assert track.correct[:n].astype(bool).tolist() == [bool(right) for _, _, right in slow]


def test_half_the_strength_is_twice_the_threshold():
    """sqrt(0.625^2 - 0.375^2) is a half."""
    half = FeltDelivery(((FLAWLESS_TABLE,) * 2, (((0.0, 0.625, 0.375, 0.0),),) * 2), adaptation_db=0.0)
    felt = simulate_study(Crowd((5.0, 25.0), (0.5, 0.5), delivery=half), PUBLISHED, 20, (3,))
    dull = simulate_study(Crowd((5.0, 25.0), (0.5, 1.0)), PUBLISHED, 20, (3,))
    np.testing.assert_allclose(felt.threshold_db, dull.threshold_db, atol=1e-9)


def test_a_flawless_delivery_changes_no_number():
    crowd = Crowd((HZ,), (0.5,))
    plain, felt = (
        simulate_study(replace(crowd, delivery=delivery), PUBLISHED, 5, (3,)) for delivery in (None, FLAWLESS)
    )
    np.testing.assert_array_equal(plain.threshold_db, felt.threshold_db)


def test_the_table_is_that_of_the_measured_trials_by_the_angle_of_the_direction(simulate_study):
    trials = []
    for trial in simulate_study(2, (0.4, 0.4, 0.4, 0.4, 0.4), 3):
        swapped = trial.subject.endswith("2")
        plus = (trial.direction_shown == 1) != swapped
        along = trial.level_n * (2.0 if plus else 3.0)
        trials.append(
            replace(
                trial, angle_deg=45.0 if plus else -45.0, delivered_mps2=along, off_axis_mps2=0.5 * along,
                harmonics_mps2=None if trial.frequency_hz == 45.0 else 0.1 * along,
            )
        )  # fmt: skip
    found = tabulate_felt_delivery(trials, (5.0, 45.0), (2.0, 4.0))
    # By angle, so that swapped labels do not mix the directions.
    for tables, flawless, share in zip(found.tables, (2.0, 4.0), (0.1, 0.0), strict=True):
        assert sorted({round(row[1] * flawless, 9) for table in tables for row in table}) == [2.0, 3.0]
        for table in tables:
            assert [row[0] for row in table] == sorted({row[0] for row in table})
            assert len({round(row[1], 9) for row in table}) == 1
            for _, along, across, harmonics in table:
                assert (across, harmonics) == (pytest.approx(along / 2), pytest.approx(share * along))
    with pytest.raises(ValueError, match=r"directions at 15 Hz"):
        tabulate_felt_delivery([trial for trial in trials if trial.frequency_hz != 15.0], (5.0, 15.0), (2.0, 4.0))


def test_trials_that_were_not_measured_for_a_cue_do_not_count_as_flawless(simulate_study):
    measured = [
        replace(trial, delivered_mps2=trial.level_n, off_axis_mps2=0.5 * trial.level_n,
                harmonics_mps2=0.1 * trial.level_n)
        for trial in simulate_study(2, (0.4, 0.4, 0.4, 0.4, 0.4), 3)
    ]  # fmt: skip
    unmeasured = [replace(trial, harmonics_mps2=None, off_axis_mps2=None) for trial in measured]
    alone = tabulate_felt_delivery(measured, (5.0, 45.0), (2.0, 4.0))
    assert alone.tables[0][0][0][3] > 0.0
    assert tabulate_felt_delivery([*measured, *unmeasured], (5.0, 45.0), (2.0, 4.0)) == alone
