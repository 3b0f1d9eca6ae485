"""Orders and draws: fair, keyed, and not shifted by anything that happened before."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from protocols.definition.preparation import PracticeSettings
from protocols.definition.session_settings import CatchSettings, DetectionSettings
from protocols.definition.study_protocol import ScheduleSettings
from protocols.procedure.schedule import (
    Draw,
    are_labels_swapped,
    draw_detection_direction,
    draw_trial,
    draw_words,
    is_catch_trial,
    label_direction,
    order_frequencies,
    schedule_runs,
)
from protocols.trial import Phase

FIVE = (5.0, 15.0, 25.0, 35.0, 45.0)
RANDOM, WILLIAMS = ScheduleSettings(), ScheduleSettings(order="williams")
BALANCED = ScheduleSettings(directions="balanced")


def directions(settings_: ScheduleSettings, trials: int, seed: int = 7, run: int = 0) -> np.ndarray:
    return np.array([draw_trial(settings_, "random", seed, run, trial, 0).direction for trial in range(trials)])


def neighbour_correlation(values: np.ndarray) -> float:
    return float(np.corrcoef(values[:-1], values[1:])[0, 1])


def test_training_comes_first_and_then_every_frequency_once(threshold):
    plan = schedule_runs(threshold, seed=3, participant_number=0)
    assert [run.index for run in plan] == list(range(10))
    assert [run.phase for run in plan] == [Phase.TRAINING] * 5 + [Phase.TEST] * 5
    assert [run.practice for run in plan] == [False] + [True] * 4 + [False] * 5
    assert [run.frequency_hz for run in plan[:5]] == list(FIVE)
    assert sorted(run.frequency_hz for run in plan[5:]) == list(FIVE)


def test_detection_runs_come_last(threshold):
    asked = replace(threshold, detection=DetectionSettings(frequencies_hz=(45.0, 35.0)))
    assert [(run.phase, run.frequency_hz) for run in schedule_runs(asked, seed=3, participant_number=0)[-2:]] == [
        (Phase.DETECTION, 45.0),
        (Phase.DETECTION, 35.0),
    ]


def test_one_trial_in_each_block_is_a_catch_trial_at_a_place_that_is_drawn():
    settings_ = CatchSettings(one_in=10)
    caught = [trial for trial in range(4000) if is_catch_trial(settings_, 5, 0, trial)]
    assert [trial // 10 for trial in caught] == list(range(400))
    places = np.bincount([trial % 10 for trial in caught], minlength=10)
    assert stats.chisquare(places).pvalue > 1e-3
    assert caught != [trial for trial in range(4000) if is_catch_trial(settings_, 6, 0, trial)]
    assert not any(is_catch_trial(CatchSettings(), 5, 0, trial) for trial in range(100))


def test_the_direction_of_a_detection_trial_tells_nothing_of_its_interval():
    intervals = np.array([draw_trial(RANDOM, "random", 7, 2, trial, 0).direction for trial in range(4000)])
    along = np.array([draw_detection_direction(7, 2, trial, 0) for trial in range(4000)])
    assert set(along) == {1, 2}
    assert abs(np.corrcoef(intervals, along)[0, 1]) < 0.06


def test_training_alone_has_no_test_run(threshold):
    alone = replace(threshold, stimulus=replace(threshold.stimulus, frequencies_hz=()), practice=PracticeSettings())
    assert [run.phase for run in schedule_runs(alone, seed=3, participant_number=0)] == [Phase.TRAINING]
    williams = replace(alone, schedule=ScheduleSettings(order="williams", labels="swapped_for_half"))
    assert len(schedule_runs(williams, seed=3, participant_number=0)) == 1
    assert are_labels_swapped(williams.schedule, 0, 1)


def test_the_listed_order_is_kept_where_it_is_asked_for():
    assert order_frequencies(ScheduleSettings(order="as_listed"), (25.0, 5.0), 1, 0) == (25.0, 5.0)


def test_random_orders_are_equally_likely():
    orders = Counter(order_frequencies(RANDOM, (1.0, 2.0, 3.0), seed, 0) for seed in range(3000))
    assert len(orders) == 6
    # Six standard deviations of a binomial count.
    assert all(abs(count - 500) < 6 * np.sqrt(3000 * 1 / 6 * 5 / 6) for count in orders.values())


def test_a_random_order_depends_on_the_seed_alone():
    assert order_frequencies(RANDOM, FIVE, 11, 0) == order_frequencies(RANDOM, FIVE, 11, 9)


@pytest.mark.parametrize("frequencies", [FIVE, FIVE[:4]])
def test_williams_orders_are_balanced_over_participants_for_any_seeds(frequencies):
    participants = 2 * len(frequencies)
    orders = [order_frequencies(WILLIAMS, frequencies, seed, seed) for seed in range(participants)]
    positions = Counter((position, value) for order in orders for position, value in enumerate(order))
    neighbours = Counter(pair for order in orders for pair in pairwise(order))
    assert set(positions.values()) == {2}
    assert set(neighbours.values()) == {2}


def test_labels_are_swapped_for_half_and_for_every_williams_row_alike():
    settings_ = ScheduleSettings(order="williams", labels="swapped_for_half")
    swapped = [are_labels_swapped(settings_, 5, number) for number in range(20)]
    assert sum(swapped[:10]) == 5
    assert all(swapped[row] != swapped[row + 10] for row in range(10))
    assert [are_labels_swapped(replace(settings_, order="random"), 5, n) for n in range(4)] == [
        False,
        True,
        False,
        True,
    ]
    assert not any(are_labels_swapped(WILLIAMS, 5, number) for number in range(20))


def test_swapped_labels_change_places_and_back():
    assert [label_direction(direction, True) for direction in (1, 2)] == [2, 1]
    assert [label_direction(direction, False) for direction in (1, 2)] == [1, 2]


@pytest.mark.slow
def test_independent_draws_are_fair_and_know_nothing_of_their_neighbours():
    drawn = [draw_trial(RANDOM, "random", 7, trial // 100, trial % 100, 0) for trial in range(10_000)]
    sides = np.array([draw.direction for draw in drawn])
    signs = np.array([draw.polarity for draw in drawn])
    # Four standard errors of 10 000 coin tosses.
    assert abs(np.mean(sides) - 1.5) < 0.02
    assert abs(np.mean(signs)) < 0.04
    assert abs(neighbour_correlation(sides)) < 0.04
    assert abs(np.corrcoef(sides, signs)[0, 1]) < 0.04


@pytest.mark.parametrize("vary", [pytest.param("seed", marks=pytest.mark.slow), "run", "attempt"])
def test_draws_of_neighbouring_keys_are_unrelated(vary):
    def drawn(value: int) -> np.ndarray:
        key = {"seed": 1, "run": 0, "attempt": 0} | {vary: value}
        return np.array(
            [draw_trial(RANDOM, "random", key["seed"], key["run"], t, key["attempt"]).direction for t in range(4000)]
        )

    assert abs(np.corrcoef(drawn(1), drawn(2))[0, 1]) < 4 / np.sqrt(4000)


def test_a_repeated_trial_shifts_no_later_draw():
    def drawn(repeats_at_10: int) -> list[Draw]:
        kept = []
        for trial in range(50):
            for attempt in range(1 + (repeats_at_10 if trial == 10 else 0)):
                last = draw_trial(RANDOM, "random", 5, 2, trial, attempt)
            kept.append(last)
        return kept

    assert drawn(0)[:10] == drawn(2)[:10]
    assert drawn(0)[11:] == drawn(2)[11:]


def test_one_generator_for_all_trials_would_be_shifted_by_a_repeat():
    def drawn(repeats_at_10: int) -> list[int]:
        rng = np.random.default_rng(5)
        kept = []
        for trial in range(50):
            for _ in range(1 + (repeats_at_10 if trial == 10 else 0)):
                last = int(rng.integers(2))
            kept.append(last)
        return kept

    assert drawn(0)[:10] == drawn(2)[:10]
    assert drawn(0)[11:] != drawn(2)[11:]


def test_balanced_draws_show_both_equally_often_in_every_block_of_eight():
    blocks = directions(BALANCED, 800).reshape(-1, 8)
    assert (np.sum(blocks == 1, axis=1) == 4).all()
    # 70 patterns are possible; a fixed one would be learned.
    assert len({tuple(block) for block in blocks}) > 40


def test_independent_draws_are_not_balanced_in_blocks():
    blocks = directions(RANDOM, 800).reshape(-1, 8)
    assert not (np.sum(blocks == 1, axis=1) == 4).all()


def test_a_balanced_trial_drawn_again_leaves_the_plan():
    planned = directions(BALANCED, 400)
    again = np.array([draw_trial(BALANCED, "random", 7, 0, trial, 1).direction for trial in range(400)])
    assert abs(np.corrcoef(planned, again)[0, 1]) < 4 / np.sqrt(400)


def test_polarity_can_be_held_positive():
    assert {draw_trial(RANDOM, "positive", 1, 0, trial, 0).polarity for trial in range(50)} == {1}


def test_draws_are_the_same_on_every_machine_and_for_all_time():
    """Sessions in the field are checked against these; numpy promises that SeedSequence does not change."""
    assert draw_words(1, (0, 0, 0), 1) == (12163234266317937517,)
    assert [draw_trial(RANDOM, "random", 1, 0, trial, 0) for trial in range(3)] == [
        Draw(direction=2, polarity=-1),
        Draw(direction=2, polarity=-1),
        Draw(direction=2, polarity=1),
    ]
    assert order_frequencies(RANDOM, FIVE, 1, 0) == (15.0, 25.0, 35.0, 5.0, 45.0)


@given(seed=st.integers(0, 2**63), run=st.integers(0, 30), trial=st.integers(0, 10_000), attempt=st.integers(0, 50))
@settings(max_examples=60, deadline=None)
def test_any_key_gives_the_same_possible_draw_twice(seed, run, trial, attempt):
    for settings_ in (RANDOM, BALANCED):
        draw = draw_trial(settings_, "random", seed, run, trial, attempt)
        assert draw == draw_trial(settings_, "random", seed, run, trial, attempt)
        assert draw in [Draw(direction, polarity) for direction in (1, 2) for polarity in (-1, 1)]
