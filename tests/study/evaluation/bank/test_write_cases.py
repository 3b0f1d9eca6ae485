"""The truth of a case, as it is sealed."""

from dataclasses import replace

import pytest

from study.evaluation.bank.seal_cases import concealed_effects_json
from study.evaluation.challenge.draw_case import Truth, draw_case


@pytest.fixture(scope="module")
def case():
    return draw_case(11, ["force_gain"], strength=0.5, name="bench case-11")


@pytest.mark.slow
def test_nothing_missing_is_an_empty_list(case):
    assert concealed_effects_json(replace(case, truth=())) == []


def test_what_the_vocabulary_has_no_name_for_stands_apart(case):
    truth = Truth("end_stop", "mechanism", "x", {"position": 0.01}, {"sides": 1.0})
    (entry,) = concealed_effects_json(replace(case, truth=(truth,)))
    assert entry["unseen"] == {"sides": 1.0}
