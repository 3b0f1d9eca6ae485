"""What is said of a model before what it predicts of itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.plant.model_quality import (
    NOT_STORED,
    ModelQuality,
    find_worst_quality,
    summarise_quality,
    write_quality_brief,
    write_quality_sentence,
)

ERRORS = st.floats(0.0, 2.0)


@given(misfit=ERRORS, scatter=st.none() | ERRORS, held_out=st.none() | ERRORS)
@settings(max_examples=200, deadline=None)
def test_the_expected_error_is_below_nothing_that_was_seen(misfit, scatter, held_out):
    found = summarise_quality(misfit, scatter, None if held_out is None else (held_out, None, 10.0))
    assert found.expected_error >= max(misfit, scatter or 0.0, held_out or 0.0)
    assert found.expected_error <= max(np.hypot(misfit, scatter or 0.0), held_out or 0.0)


def test_a_model_that_was_not_tested_says_so_and_gives_its_misfit():
    said = write_quality_sentence(summarise_quality(0.08, 0.002, None))
    assert said.startswith("No recording was held out for a test") and "misfit 8.00 %" in said
    assert write_quality_brief(summarise_quality(0.08, 0.002, None)) == "not tested, misfit 8 %"


def test_an_old_model_says_that_its_quality_is_not_stored():
    assert write_quality_sentence(None) == NOT_STORED
    assert write_quality_brief(None) == "quality not stored"
    assert find_worst_quality((ModelQuality(0.1, 0.1), None)) is None


@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_figures_that_cannot_be_are_refused(value):
    with pytest.raises(ValueError, match="held_out_error is"):
        ModelQuality(0.1, 0.1, held_out_error=value)
