"""What a case's files say of how it was drawn."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from study.evaluation.bank.seal_cases import BankPlan, list_drawable_cases
from study.evaluation.challenge.draw_bank import generate_case

SEED = 881_203_452


@pytest.mark.slow
def test_two_names_give_one_device_that_bears_its_name_and_nothing_of_its_draw():
    drawn = list_drawable_cases(BankPlan(SEED, cases=1, brief=True))[0]
    first, second = (generate_case(drawn, name) for name in ("a1b2", "c3d4"))
    assert (first.recording.device, first.model.name) == ("a1b2", "a1b2")
    assert (second.recording.device, second.model.name) == ("c3d4", "c3d4")
    np.testing.assert_array_equal(second.recording.response.samples, first.recording.response.samples)
    np.testing.assert_equal(asdict(replace(second.model, name="a1b2")), asdict(first.model))
    assert second.truth == first.truth
    for told in (repr(dict(first.recording.meta)), repr(first.recording.segments), repr(first.model)):
        assert str(SEED) not in told and str(drawn.seed) not in told
