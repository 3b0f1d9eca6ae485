"""The truth of a case, as it is sealed."""

from dataclasses import replace

import pytest

from study.evaluation.bank.seal_cases import list_concealed_effects
from study.evaluation.challenge.case_settings import CaseSettings
from study.evaluation.challenge.draw_case import Truth, draw_case


@pytest.fixture(scope="module")
def case():
    return draw_case(11, ["force_gain"], strength=0.5, name="bench case-11", settings=CaseSettings((0,), 500, 3))


@pytest.mark.slow
def test_nothing_missing_is_an_empty_list(case):
    assert list_concealed_effects(replace(case, truth=())) == []


def test_what_the_vocabulary_has_no_name_for_stands_apart(case):
    truth = Truth("end_stop", "mechanism", "x", {"position": 0.01}, {"sides": 1.0})
    (entry,) = list_concealed_effects(replace(case, truth=(truth,)))
    assert entry["unseen"] == {"sides": 1.0}
