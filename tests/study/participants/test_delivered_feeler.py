"""A participant who feels what was delivered: coupling, strength, harmonics and numbing matter as they are said to."""

from dataclasses import replace

import pytest

from protocols.trial import Phase
from study.participants.delivered_feeler import DeliveredFeeler
from study.participants.observer import PerceivedStimulus
from study.participants.observer_catalogue import find_observer
from study.participants.population import TYPICAL_THRESHOLDS_N, draw_person, make_member
from study.session.stimulus.delivered import DeliveredMotion

TARGET = 0.5 ** (1 / 3)
PER_NEWTON = 2.7
THRESHOLD_N = dict(TYPICAL_THRESHOLDS_N)[15.0]


@pytest.fixture
def observer():
    return find_observer("delivered", 0)


def felt(level_n=THRESHOLD_N, along=1.0, across=0.0, harmonics=0.0, trial=0):
    """At 15 Hz; along: as a share of what a flawless device delivers, across and harmonics as shares of that."""
    mps2 = PER_NEWTON * level_n * along
    delivered = DeliveredMotion(mps2, across * mps2, 0.1, harmonics * mps2)
    return PerceivedStimulus(0, trial, 0, Phase.TEST, 15.0, level_n, 1, trial, delivered=delivered)


def test_a_flawless_delivery_is_felt_as_commanded(observer):
    assert observer.compute_proportion_correct(felt()) == pytest.approx(TARGET)
    answers = [observer.reply(replace(felt(), trial=0, run=run), 7) for run in range(50)]
    plain = [observer.feeler.reply(replace(felt(), trial=0, run=run), 7) for run in range(50)]
    assert answers == plain


def test_half_the_strength_needs_twice_the_level(observer):
    assert observer.compute_proportion_correct(felt(along=0.5)) < 0.65
    assert observer.compute_proportion_correct(felt(2 * THRESHOLD_N, along=0.5)) == pytest.approx(TARGET)


def test_motion_across_takes_the_direction_away_and_a_circle_has_none(observer):
    shares = [
        observer.compute_proportion_correct(felt(3.0, across=across)) for across in (0.0, 0.5, 0.9, 0.99, 1.0, 1.5)
    ]
    assert shares[0] > 0.999 and shares == sorted(shares, reverse=True)
    assert shares[-2:] == [0.5, 0.5]


def test_harmonics_as_strong_as_the_threshold_raise_it_by_3_db(observer):
    """Independent noises add in squares: sqrt(2)."""
    raised = felt(THRESHOLD_N * 2**0.5, harmonics=0.5**0.5)
    assert observer.compute_proportion_correct(raised) == pytest.approx(TARGET)
    deaf = replace(observer, masking=0.0)
    assert deaf.compute_proportion_correct(felt(harmonics=3.0)) == pytest.approx(TARGET)


def test_a_long_run_numbs_by_a_decibel_and_a_new_one_begins_afresh(observer):
    late = felt(THRESHOLD_N * 10 ** (1 / 20), trial=2000)
    assert observer.compute_proportion_correct(replace(late, trials_before=0)) == pytest.approx(TARGET, abs=1e-6)
    assert observer.compute_proportion_correct(replace(felt(trial=0), trials_before=300)) == pytest.approx(TARGET)


def test_the_delivered_population_has_the_thresholds_of_the_population(observer):
    found = make_member("delivered", 3, 5)
    assert isinstance(found, DeliveredFeeler)
    assert (found.feeler, found.name) == (draw_person(3, 5), "delivered_3_seed_5")
    assert find_observer("delivered_3_seed_5", 0) == found


def test_detection_and_what_was_not_measured_go_by_the_command(observer):
    assert observer.compute_equivalent_force_n(replace(felt(1.2, along=0.1), delivered=None)) == 1.2
    assert observer.compute_equivalent_force_n(replace(felt(1.2, along=0.1), phase=Phase.DETECTION)) == 1.2
