"""When data do not tell two explanations apart."""

import numpy as np

from analysis.diagnosis.errors.fit_score import FitScore
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import Fitted
from analysis.diagnosis.search.parsimony import are_inseparable
from analysis.diagnosis.search.search_context import FittedCandidate


def make_candidate(error: float, usual: float = 0.0) -> FittedCandidate:
    """error: in units of the noise."""
    at = np.array([error])
    return FittedCandidate(Fitted(NO_EFFECTS, np.zeros(0), (), 1.0), FitScore(at, at, at), usual)


def test_what_errs_by_next_to_nothing_more_is_as_good():
    assert are_inseparable(make_candidate(1.0), make_candidate(1.0005))
    assert not are_inseparable(make_candidate(1.0), make_candidate(1.01))


def test_far_above_the_noise_a_small_relative_difference_is_inseparable():
    assert are_inseparable(make_candidate(2.0), make_candidate(2.1))
    assert not are_inseparable(make_candidate(2.0), make_candidate(2.3))


def test_what_both_gain_on_a_sound_device_tells_nothing_here():
    assert are_inseparable(make_candidate(1.0, usual=0.05), make_candidate(1.02, usual=0.2))
    assert not are_inseparable(make_candidate(1.0, usual=0.05), make_candidate(1.05, usual=0.2))


def test_what_one_alone_gains_there_does_not_make_it_the_other():
    assert not are_inseparable(make_candidate(1.0, usual=0.0), make_candidate(1.02, usual=0.8))
