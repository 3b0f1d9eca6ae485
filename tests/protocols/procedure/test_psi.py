"""Levels chosen by Psi: against a posterior by brute force, capped, deterministic, ended; thresholds recovered."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.definition.staircase_rule import BayesianPlacement
from protocols.procedure.psi import (
    LAPSE_RATE,
    SLOPES,
    choose_level_db,
    compute_posterior,
    estimate_threshold,
    list_levels_db,
    list_thresholds_db,
)
from protocols.procedure.staircase import begin_staircase, compute_level_n, is_complete, is_finished, step, to_db
from tests.analysis.conftest import PUBLISHED

CAP_DB = to_db(3.0)
RULE = replace(PUBLISHED, bayesian=BayesianPlacement(trials=40))


def chance_right(level_db: float, threshold_db: float, slope: float) -> float:
    """The curve written out anew: Weibull over newtons, 79.37 % of attentive answers right at the threshold."""
    scale_n = 10 ** (threshold_db / 20) / (-math.log(2 - 2 * 0.5 ** (1 / 3))) ** (1 / slope)
    attentive = 1 - 0.5 * math.exp(-((10 ** (level_db / 20) / scale_n) ** slope))
    return LAPSE_RATE * 0.5 + (1 - LAPSE_RATE) * attentive


def brute_force(answers) -> dict[tuple[float, float], float]:
    weight = {}
    for threshold_db in list_thresholds_db(CAP_DB):
        for slope in SLOPES:
            p = 1.0
            for level_db, right in answers:
                share = chance_right(level_db, threshold_db, slope)
                p *= share if right else 1 - share
            weight[threshold_db, slope] = p
    total = sum(weight.values())
    return {key: value / total for key, value in weight.items()}


ANSWERS = ((0.0, True), (-6.0, True), (-12.0, False), (-8.0, True), (-10.0, False), (CAP_DB, True), (-9.0, True))


def test_the_posterior_is_bayes_rule_by_brute_force():
    found, expected = compute_posterior(ANSWERS, CAP_DB), brute_force(ANSWERS)
    for i, threshold_db in enumerate(list_thresholds_db(CAP_DB)):
        for j, slope in enumerate(SLOPES):
            assert found[i, j] == pytest.approx(expected[threshold_db, slope], rel=1e-9, abs=1e-14)
    got = estimate_threshold(found, CAP_DB)
    mean = sum(key[0] * p for key, p in expected.items())
    assert got.mean_db == pytest.approx(mean)
    assert got.sd_db == pytest.approx(math.sqrt(sum((key[0] - mean) ** 2 * p for key, p in expected.items())))
    assert got.above_cap == pytest.approx(sum(p for key, p in expected.items() if key[0] > CAP_DB))


@pytest.mark.parametrize("count", [1, 4, 7])
def test_the_next_level_leaves_the_least_entropy_by_brute_force(count):
    before = brute_force(ANSWERS[:count])

    def expected_entropy(level_db: float) -> float:
        total = 0.0
        for right in (True, False):
            joint = [
                p * (c if right else 1 - c)
                for (threshold_db, slope), p in before.items()
                for c in [chance_right(level_db, threshold_db, slope)]
            ]
            chance = sum(joint)
            total -= sum(j * math.log(j / chance) for j in joint if j > 0)
        return total

    best = min(list_levels_db(CAP_DB), key=expected_entropy)
    chosen = choose_level_db(compute_posterior(ANSWERS[:count], CAP_DB), CAP_DB)
    assert expected_entropy(chosen) == pytest.approx(expected_entropy(best), abs=1e-8)


@pytest.mark.slow
@settings(deadline=None, max_examples=15)
@given(st.lists(st.booleans(), min_size=40, max_size=40), st.sampled_from([0.5, 1.7, 3.0]))
def test_no_answers_lead_above_the_cap_and_the_same_answers_lead_to_the_same_levels(answers, cap_n):
    rule = replace(RULE, cap_n=cap_n, start_n=min(1.0, cap_n))
    levels = []
    for _ in range(2):
        state, played = begin_staircase(rule), []
        for answer in answers:
            played.append(compute_level_n(rule, state))
            state = step(rule, state, answer)
        levels.append(played)
        assert is_finished(rule, state) and is_complete(rule, state)
    assert levels[0] == levels[1]
    assert max(levels[0]) <= cap_n and levels[0][0] == rule.start_n


def test_a_spread_without_trials_is_refused():
    with pytest.raises(ValueError, match=r"bayesian.spread_db"):
        replace(PUBLISHED, bayesian=BayesianPlacement(spread_db=1.0))


def test_off_is_the_published_rule_to_the_last_level():
    random = np.random.default_rng(1)
    a, b = begin_staircase(PUBLISHED), begin_staircase(replace(PUBLISHED, bayesian=BayesianPlacement()))
    while not is_finished(PUBLISHED, a):
        answer = bool(random.random() < 0.8)
        a, b = step(PUBLISHED, a, answer), step(PUBLISHED, b, answer)
    assert a == b and a.answered == ()
