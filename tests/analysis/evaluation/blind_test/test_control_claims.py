"""Claims about the answers of controls."""

import pytest

from analysis.diagnosis.document import Diagnosis, Errors, Estimate, Fit, Mismatch, NamedEffect
from analysis.evaluation.blind_test.control_claims import CLAIMS, judge_control

CELL = Mismatch("ax", "fx", (1.0, 5.0), None, None, 0.5, 0.001)
ERRORS = Errors(0.5, 0.3, 0.1, 0.1)


def diagnosis_of_push(force, axis="x", probability=0.9):
    effect = NamedEffect("constant_force", "mechanism", axis, 0.9, probability, {"force": Estimate(force, "N")})
    return Diagnosis("explained", (CELL,), (effect,), {}, (), Fit(ERRORS, ERRORS), "free simulation", None)


def diagnosis_without_effect(verdict):
    return Diagnosis(verdict, (CELL,), (), {}, (), Fit(ERRORS, ERRORS), "free simulation", None)


@pytest.mark.parametrize(
    ("claim", "answers", "held"),
    [
        ("no name", [diagnosis_without_effect("unexplained")], True),
        ("no name", [None], True),
        ("no name", [diagnosis_of_push(1.0)], False),
        ("no name", [diagnosis_of_push(1.0, probability=0.3)], True),
        ("not explained", [diagnosis_without_effect("unexplained")], True),
        ("not explained", [diagnosis_of_push(1.0)], False),
        ("nothing", [diagnosis_without_effect("parameters")], True),
        ("nothing", [diagnosis_without_effect("unexplained")], False),
        ("nothing", [None], False),
        ("same", [diagnosis_of_push(1.0), diagnosis_of_push(1.1)], True),
        ("same", [diagnosis_of_push(1.0), diagnosis_of_push(1.0, "y")], False),
        ("same", [diagnosis_without_effect("unexplained"), diagnosis_without_effect("unexplained")], False),
        ("same", [diagnosis_of_push(1.0), None], False),
        ("same but axes", [diagnosis_of_push(1.0), diagnosis_of_push(1.0, "q0")], True),
        ("axis exchanged", [diagnosis_of_push(1.0), diagnosis_of_push(1.0, "y")], True),
        ("axis exchanged", [diagnosis_of_push(1.0), diagnosis_of_push(1.0)], False),
        ("axis exchanged", [diagnosis_of_push(1.0, None), diagnosis_of_push(1.0, "y")], False),
        ("axis exchanged", [diagnosis_of_push(1.0), diagnosis_without_effect("unexplained")], False),
        ("opposite", [diagnosis_of_push(1.0), diagnosis_of_push(-1.001)], True),
        ("opposite", [diagnosis_of_push(1.0), diagnosis_of_push(1.0)], False),
        ("opposite", [diagnosis_of_push(1.0), diagnosis_without_effect("unexplained")], False),
    ],
)
def test_a_claim_of_a_control_holds_for_the_expected_answers_alone(claim, answers, held):
    assert judge_control("a control", claim, answers).held is held


def test_answers_are_said_in_words():
    said = judge_control("a control", "same", [diagnosis_of_push(1.0), None]).said
    assert said == ("explained: constant_force of x", "no answer")


def test_every_claim_of_a_control_is_known():
    from study.evaluation.challenge.controls import CONTROLS

    assert {control.claim for control in CONTROLS} == set(CLAIMS)
