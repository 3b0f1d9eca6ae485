"""Simulated participants do what they are said to do: curves recovered from answers, controls at chance."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from protocols.definition.study_protocol import ScheduleSettings
from protocols.procedure.schedule import draw_trial
from protocols.trial import Phase
from study.errors import WrongUseError
from study.participants.detection_thresholds import TYPICAL_DETECTION_N
from study.participants.direction_feeler import DirectionFeeler
from study.participants.intensity_cue import IntensityCue
from study.participants.observer import Observer, PerceivedStimulus
from study.participants.observer_catalogue import OBSERVERS, find_observer
from study.participants.population import TYPICAL_THRESHOLDS_N
from tests.slow_instances import slow, slow_rows

FELT = PerceivedStimulus(
    run=0, trial=0, attempt=0, phase=Phase.TEST, frequency_hz=15.0, level_n=0.6, direction_shown=1, trials_before=0
)
N = 4000
FOUR_ERRORS = 4 * np.sqrt(0.25 / N)


def slow_but_first_and_last(rows) -> list:
    return [rows[0], *slow_rows(*rows[1:-1]), rows[-1]]


@cache
def shown(trial: int, seed: int = 1) -> int:
    return draw_trial(ScheduleSettings(), "random", seed, 0, trial, 0).direction


@cache
def trials(frequency_hz: float = 15.0, level_n: float = 0.6, seed: int = 1) -> list[PerceivedStimulus]:
    """N trials of one run, directions drawn as a session draws them."""
    return [
        replace(
            FELT,
            trial=trial,
            trials_before=trial,
            frequency_hz=frequency_hz,
            level_n=level_n,
            direction_shown=shown(trial, seed),
        )
        for trial in range(N)
    ]


def share_right(observer: Observer, felt: list[PerceivedStimulus], seed: int = 1) -> float:
    return float(np.mean([observer.reply(each, seed).answer == each.direction_shown for each in felt]))


def share_of_1(observer: Observer, felt: list[PerceivedStimulus], seed: int = 1) -> float:
    return float(np.mean([observer.reply(each, seed).answer == 1 for each in felt]))


@pytest.mark.parametrize(("frequency_hz", "threshold_n"), slow_but_first_and_last(TYPICAL_THRESHOLDS_N))
def test_the_ideal_observer_is_right_79_percent_of_the_time_at_threshold(frequency_hz, threshold_n):
    ideal = find_observer("ideal", 0)
    assert share_right(ideal, trials(frequency_hz, threshold_n)) == pytest.approx(0.5 ** (1 / 3), abs=FOUR_ERRORS)


@pytest.mark.parametrize("level_n", [0.1, 1.2, *slow(0.3, 0.6, 3.0)])
def test_the_ideal_observers_answers_follow_the_weibull_curve(level_n):
    """Textbook form: 0.5 + 0.5 (1 - exp(-(x/a)^b)), a put so that 0.6 N gives the cube root of one half."""
    a = 0.6 / (-np.log(2 - 2 * 0.5 ** (1 / 3))) ** (1 / 2)
    expected = 0.5 + 0.5 * (1 - np.exp(-((level_n / a) ** 2)))
    assert share_right(find_observer("ideal", 0), trials(level_n=level_n)) == pytest.approx(expected, abs=FOUR_ERRORS)


@pytest.mark.slow
def test_the_lapsing_observer_stays_below_certainty_where_the_ideal_one_is_certain():
    assert share_right(find_observer("lapsing", 0), trials(level_n=3.0)) == pytest.approx(0.95, abs=FOUR_ERRORS)
    assert share_right(find_observer("ideal", 0), trials(level_n=3.0)) == 1.0


@pytest.mark.parametrize(
    ("criterion", "expected"), [(1.0, 0.697), *slow_rows((0.0, 0.7937), (0.25, 0.786), (0.5, 0.766))]
)
def test_a_bias_to_one_answer_lowers_the_share_of_right_ones_as_detection_theory_says(criterion, expected):
    biased = DirectionFeeler("biased", TYPICAL_THRESHOLDS_N, criterion=criterion)
    both = [biased.compute_proportion_correct(replace(FELT, direction_shown=direction)) for direction in (1, 2)]
    assert np.mean(both) == pytest.approx(expected, abs=0.0006)
    assert share_right(biased, trials()) == pytest.approx(expected, abs=FOUR_ERRORS)


@pytest.mark.slow
def test_the_biased_observer_says_1_more_often_and_the_ideal_one_does_not():
    felt = trials(level_n=0.05)
    assert share_of_1(find_observer("biased", 0), felt) == pytest.approx(0.69, abs=FOUR_ERRORS + 0.005)
    assert share_of_1(find_observer("ideal", 0), felt) == pytest.approx(0.50, abs=FOUR_ERRORS)


@pytest.mark.parametrize("name", ["guesser", *slow("alternator", "always_1", "always_2")])
@pytest.mark.parametrize("seed", [1, *slow(2)])
def test_who_feels_nothing_is_at_chance_even_at_the_cap_and_with_the_sessions_seed(name, seed):
    felt = trials(level_n=3.0, seed=seed)
    assert share_right(find_observer(name, seed), felt, seed) == pytest.approx(0.5, abs=FOUR_ERRORS)


def test_the_alternator_alternates_over_the_whole_session():
    alternator = find_observer("alternator", 0)
    answers = [alternator.reply(replace(FELT, run=n // 3, trial=n % 3, trials_before=n), 1).answer for n in range(7)]
    assert answers == [1, 2, 1, 2, 1, 2, 1]


def test_the_constant_observers_are_constant():
    assert share_of_1(find_observer("always_1", 0), trials()) == 1.0
    assert share_of_1(find_observer("always_2", 0), trials()) == 0.0


def test_vibration_without_direction_above_its_frequency_and_full_sense_below():
    observer = find_observer("vibration_only", 0)
    assert share_right(observer, trials(25.0, 3.0)) == pytest.approx(0.5, abs=FOUR_ERRORS)
    assert share_right(observer, trials(15.0, 3.0)) == 1.0


@pytest.mark.parametrize(("level_n", "expected"), [(0.1, 0.8556), *slow_rows((3.0, 0.9331), (0.01, 0.5594))])
def test_the_intensity_cue_works_wherever_strength_can_be_judged(level_n, expected):
    """Phi(3 dB / (2 x 1 dB sqrt(1 + (0.1 N / level)^2)))."""
    assert share_right(find_observer("intensity_cue", 0), trials(level_n=level_n)) == pytest.approx(
        expected, abs=FOUR_ERRORS
    )


def test_without_a_difference_in_strength_the_intensity_cue_is_chance():
    assert share_right(IntensityCue("cue", difference_db=0.0), trials(level_n=3.0)) == pytest.approx(
        0.5, abs=FOUR_ERRORS
    )


def test_the_drifting_observers_threshold_rises_by_a_decibel_in_100_trials():
    drifting, ideal = find_observer("drifting", 0), find_observer("ideal", 0)
    assert isinstance(drifting, DirectionFeeler)
    assert isinstance(ideal, DirectionFeeler)
    late = replace(FELT, trials_before=300, level_n=0.6 * 10 ** (3 / 20))
    assert drifting.compute_proportion_correct(late) == pytest.approx(ideal.compute_proportion_correct(FELT))
    assert drifting.compute_proportion_correct(FELT) == ideal.compute_proportion_correct(FELT)


def test_between_frequencies_thresholds_lie_between_and_beyond_the_ends_they_stay():
    ideal = find_observer("ideal", 0)
    assert isinstance(ideal, DirectionFeeler)
    shares = [
        ideal.compute_proportion_correct(replace(FELT, frequency_hz=f)) for f in (1.0, 5.0, 10.0, 15.0, 45.0, 200.0)
    ]
    assert shares[0] == shares[1] > shares[2] > shares[3] > shares[4] == shares[5]


def detection(frequency_hz: float, level_n: float) -> list[PerceivedStimulus]:
    return [replace(felt, phase=Phase.DETECTION) for felt in trials(frequency_hz, level_n)]


@pytest.mark.parametrize(("frequency_hz", "threshold_n"), slow_but_first_and_last(TYPICAL_DETECTION_N))
def test_the_interval_is_found_79_percent_of_the_time_at_the_detection_threshold(frequency_hz, threshold_n):
    felt = detection(frequency_hz, threshold_n)
    assert share_right(find_observer("ideal", 0), felt) == pytest.approx(0.5 ** (1 / 3), abs=FOUR_ERRORS)


@pytest.mark.parametrize("level_n", [0.05, *slow(0.02, 0.1, 0.2)])
def test_finding_the_interval_follows_a_weibull_curve_of_its_own(level_n):
    """Textbook form, with slope 2.5 and a so that 0.08 N gives the cube root of one half."""
    a = 0.08 / (-np.log(2 - 2 * 0.5 ** (1 / 3))) ** (1 / 2.5)
    expected = 0.5 + 0.5 * (1 - np.exp(-((level_n / a) ** 2.5)))
    found = share_right(find_observer("ideal", 0), detection(15.0, level_n))
    assert found == pytest.approx(expected, abs=FOUR_ERRORS)


@pytest.mark.parametrize("name", ["vibration_only", *slow("ideal", "intensity_cue")])
def test_who_finds_no_direction_feels_the_vibration_all_the_same(name):
    observer = find_observer(name, 0)
    assert share_right(observer, detection(35.0, 0.5)) > 0.99
    assert share_right(observer, trials(35.0, 0.02)) < 0.7


def test_the_intensity_cue_finds_the_interval_79_percent_of_the_time_at_its_detection_level():
    cue = find_observer("intensity_cue", 0)
    assert share_right(cue, detection(25.0, 0.1)) == pytest.approx(0.5 ** (1 / 3), abs=FOUR_ERRORS)


@pytest.mark.parametrize("name", ["alternator", *slow("guesser", "always_1", "always_2")])
def test_who_feels_nothing_finds_no_interval(name):
    assert share_right(find_observer(name, 1), detection(15.0, 3.0)) == pytest.approx(0.5, abs=FOUR_ERRORS)


@pytest.mark.slow
def test_lapses_and_a_bias_to_1_show_in_detection_trials_too():
    assert share_right(find_observer("lapsing", 0), detection(15.0, 3.0)) == pytest.approx(0.95, abs=FOUR_ERRORS)
    liked = share_of_1(find_observer("biased", 0), detection(15.0, 0.005))
    assert liked == pytest.approx(0.69, abs=FOUR_ERRORS + 0.005)


def test_a_drift_raises_the_detection_threshold_too():
    drifting = find_observer("drifting", 0)
    assert isinstance(drifting, DirectionFeeler)
    early = replace(FELT, phase=Phase.DETECTION, level_n=0.08)
    late = replace(early, trials_before=300, level_n=0.08 * 10 ** (3 / 20))
    assert drifting.compute_proportion_correct(late) == pytest.approx(drifting.compute_proportion_correct(early))
    assert (
        drifting.compute_proportion_correct(replace(early, trials_before=300))
        < drifting.compute_proportion_correct(early) - 0.05
    )


@pytest.mark.parametrize("name", OBSERVERS)
def test_a_catch_trial_is_answered_as_any_other_trial_at_its_level(name):
    observer = find_observer(name, 1)
    felt = trials(level_n=3.0)[:200]
    caught = [observer.reply(replace(each, phase=Phase.CATCH), 1) for each in felt]
    assert caught == [observer.reply(each, 1) for each in felt]


def test_the_scripted_observer_looks_at_run_and_trial_alone():
    scripted = find_observer("scripted", 0)

    def right(direction: int, attempt: int, level_n: float, seed: int) -> list[bool]:
        felt = [
            replace(FELT, trial=t, attempt=attempt, level_n=level_n, direction_shown=direction, trials_before=9)
            for t in range(40)
        ]
        return [scripted.reply(each, seed).answer == direction for each in felt]

    script = [letter == "1" for letter in "1111110111011100111111011100111011101111"]
    assert right(1, 0, 1.0, 1) == script
    assert right(2, 3, 0.1, 99) == script


@pytest.mark.parametrize("name", OBSERVERS)
def test_the_same_trial_gets_the_same_reply_in_any_order_of_asking(name):
    felt = trials()[:200]
    forward = [find_observer(name, 5).reply(each, 5) for each in felt]
    backward = [find_observer(name, 5).reply(each, 5) for each in reversed(felt)]
    assert forward == backward[::-1]
    assert all(reply.answer in (1, 2) for reply in forward)


@pytest.mark.parametrize("change", [{"run": 1}, {"attempt": 1}])
def test_another_key_is_other_luck(change):
    guesser = find_observer("guesser", 0)
    here = [guesser.reply(trial, 1).answer for trial in trials()[:200]]
    there = [guesser.reply(replace(trial, **change), 1).answer for trial in trials()[:200]]
    assert abs(np.corrcoef(here, there)[0, 1]) < 4 / np.sqrt(200)
    assert here != [guesser.reply(trial, 2).answer for trial in trials()[:200]]


@pytest.mark.slow
def test_response_times_are_those_of_people_and_say_nothing_about_the_answer():
    replies = [find_observer("guesser", 0).reply(trial, 1) for trial in trials()]
    times_s = np.array([reply.response_time_s for reply in replies])
    assert np.mean((times_s > 1.2) & (times_s < 2.5)) == pytest.approx(0.95, abs=0.015)
    assert np.median(times_s) == pytest.approx(3**0.5, abs=0.03)
    assert abs(np.corrcoef(times_s, [reply.answer for reply in replies])[0, 1]) < 4 / np.sqrt(N)


@pytest.mark.parametrize("name", OBSERVERS)
def test_every_listed_name_is_an_observer(name):
    assert find_observer(name, 3).name == ("person_1_seed_3" if name == "person" else name)


def test_a_hyphen_does_for_an_underscore():
    assert find_observer("vibration-only", 0) == find_observer("vibration_only", 0)


def test_an_unknown_name_is_refused_with_the_names_there_are():
    with pytest.raises(WrongUseError) as caught:
        find_observer("gueser", 0)
    assert caught.value.happened == "No observer is called gueser. Did you mean guesser?"
    assert caught.value.do_now == f"Choose one of {', '.join(OBSERVERS)}."


def test_a_name_like_nothing_gets_no_guess():
    with pytest.raises(WrongUseError) as caught:
        find_observer("xyz", 0)
    assert caught.value.happened == "No observer is called xyz."
