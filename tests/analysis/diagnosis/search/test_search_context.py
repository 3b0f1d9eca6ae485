"""A fit that ended at parameters which do almost the same begins again."""

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import Claim, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.errors.standard_errors import compute_full_sensitivity, compute_standard_errors
from analysis.diagnosis.search.compare_candidates import refine
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect

TRUE_N = 0.03


def make_deadband(**values):
    return (PlacedEffect(EFFECTS["force_deadband"], (0,), values),)


@pytest.fixture(scope="module")
def context(make_context):
    return make_context(make_deadband(width=TRUE_N, jump=0.0))


def refine_from(context, width, jump):
    start = make_claim_hypothesis(Claim(EFFECTS["force_deadband"], "one", (0,)), [{"width": width, "jump": jump}])
    here = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), start)
    return refine(context, here)


def test_a_wider_band_with_a_jump_is_found_to_be_a_plain_one(context):
    (placed,) = refine_from(context, TRUE_N / 0.65, 0.35).hypothesis.list_placed_effects()
    assert placed.values["width"] == pytest.approx(TRUE_N, rel=0.02)
    assert placed.values["jump"] == 0.0


def test_a_number_at_the_end_of_its_range_is_held_there_and_leaves_the_others_sure(context):
    fitted = refine_from(context, TRUE_N, 0.0)
    known = compute_full_sensitivity(context.measure, context.tuning, fitted.deviations, fitted.hypothesis)
    width, jump = compute_standard_errors(context.measure, fitted, known)[-2:]
    assert jump == 0.0
    assert 0.0 < width < 0.02  # of the logarithm


def test_a_band_that_does_jump_keeps_its_jump(make_context):
    jumping = make_context(make_deadband(width=0.1, jump=0.6))
    (placed,) = refine_from(jumping, 0.1, 0.6).hypothesis.list_placed_effects()
    assert placed.values["jump"] == pytest.approx(0.6, abs=0.1)
