from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.population import Population, split_by_population
from protocols.trial import TrialStatus


@pytest.fixture
def rows(simulate):
    return simulate(1.0, np.random.default_rng(3), felt=True)[:4]


def test_the_three_kinds_are_kept_apart(rows):
    rehearsal = [replace(row, session="2", felt=False) for row in rows]
    simulated = [replace(row, session="3", felt=None) for row in rows]
    parts = split_by_population([*simulated, *rows, *rehearsal])
    assert parts == {
        Population.PEOPLE: tuple(rows),
        Population.SIMULATED: tuple(simulated),
        Population.NOT_FELT: tuple(rehearsal),
    }


def test_a_kind_that_does_not_occur_is_not_there(rows):
    assert list(split_by_population(rows)) == [Population.PEOPLE]
    assert split_by_population([]) == {}


def test_an_unanswered_trial_follows_its_session(rows):
    opened = replace(rows[-1], trial=5, answer=None, correct=None, felt=None, status=TrialStatus.OPEN)
    assert split_by_population([*rows, opened]) == {Population.PEOPLE: (*rows, opened)}


def test_a_session_of_two_kinds_is_refused_by_name(rows):
    rows[2] = replace(rows[2], felt=False)
    with pytest.raises(ValueError, match="session 1 of s01 mixes trials of people and people who felt nothing"):
        split_by_population(rows)
