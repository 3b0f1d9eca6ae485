"""Participants who ask again when unsure, whose criterion drifts, and who go by a strength that is roved."""

from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest

from protocols.trial import Phase
from study.participants.direction_feeler import DirectionFeeler
from study.participants.observer import PerceivedStimulus
from study.participants.observer_catalogue import find_observer
from study.participants.population import MEMBER_KINDS, make_member
from study.participants.unsure_repeater import UnsureRepeater

N = 3000
NORMAL = NormalDist()
AT_THRESHOLD = PerceivedStimulus(0, 0, 0, Phase.TEST, 15.0, 0.6, 1, 0)
"""79.37 % right with one look: d' = 1.639."""


def trials(**changes):
    random = np.random.default_rng(3)
    return [replace(AT_THRESHOLD, trial=n, direction_shown=int(random.integers(1, 3)), **changes) for n in range(N)]


def four_errors(share):
    return 4 * np.sqrt(share * (1 - share) / N)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_unsure_ask_again_as_often_as_their_evidence_is_near_the_criterion(seed):
    observer = UnsureRepeater("unsure", DirectionFeeler("d", ((15.0, 0.6),)))
    asked = np.mean([observer.reply(felt, seed).ask_again for felt in trials()])
    expected = NORMAL.cdf(0.5 - 0.8195) - NORMAL.cdf(-0.5 - 0.8195)
    assert asked == pytest.approx(expected, abs=four_errors(expected))
    assert not any(observer.reply(felt, seed).ask_again for felt in trials(attempt=4)[:200])


@pytest.mark.parametrize("looks", [1, 2, pytest.param(4, marks=pytest.mark.slow)])
def test_looks_together_tell_as_much_as_their_number_says(looks):
    observer = UnsureRepeater("unsure", DirectionFeeler("d", ((15.0, 0.6),)))
    right = np.mean([observer.reply(felt, 5).answer == felt.direction_shown for felt in trials(attempt=looks - 1)])
    expected = NORMAL.cdf(0.8195 * looks**0.5)
    assert right == pytest.approx(expected, abs=four_errors(expected))


@pytest.mark.slow
def test_a_second_look_at_what_was_unsure_helps_and_the_sure_ask_for_none():
    observer = find_observer("repeating", 0)
    first = [(felt, observer.reply(felt, 5)) for felt in trials()]
    answers = [
        (observer.reply(replace(felt, attempt=1), 5) if reply.ask_again else reply).answer == felt.direction_shown
        for felt, reply in first
    ]
    assert np.mean(answers) > 0.7937 + 0.02
    assert not any(observer.reply(felt, 5).ask_again for felt in trials(level_n=3.0)[:300])


def test_a_drifting_criterion_is_none_at_first_and_shows_later():
    observer = find_observer("criterion_drift", 0)
    early, late = ([observer.reply(felt, 5).answer for felt in trials(trials_before=n)] for n in (0, 300))
    assert np.mean(np.array(early) == 2) == pytest.approx(0.5, abs=four_errors(0.5))
    expected = (NORMAL.cdf(0.8195 + 0.9) + NORMAL.cdf(-0.8195 + 0.9)) / 2
    assert np.mean(np.array(late) == 2) == pytest.approx(expected, abs=four_errors(expected))


@pytest.mark.parametrize(("rove_db", "expected"), [(0.0, 0.9331), (20.0, 0.575)])
def test_who_goes_by_strength_is_thrown_off_by_a_roved_level(rove_db, expected):
    """3 dB between the directions: perfect but for the noise without roving, 50 + 50 d / r % at most with it."""
    observer, random = find_observer("intensity_cue", 0), np.random.default_rng(4)
    roved = [
        replace(felt, nominal_n=2.0, level_n=2.0 * 10 ** (random.uniform(-0.5, 0.5) * rove_db / 20))
        for felt in trials()
    ]
    right = np.mean([observer.reply(felt, 5).answer == felt.direction_shown for felt in roved])
    assert right == pytest.approx(expected, abs=four_errors(0.5))


@pytest.mark.parametrize("kind", MEMBER_KINDS)
def test_a_member_can_be_made_again_from_its_name(kind):
    assert find_observer(f"{kind}_2_seed_9", 0) == make_member(kind, 2, 9)
    assert make_member(kind, 2, 9).name == f"{kind}_2_seed_9"


def test_a_population_of_an_unknown_kind_is_refused():
    with pytest.raises(ValueError, match="not of robots"):
        make_member("robots", 1, 1)
