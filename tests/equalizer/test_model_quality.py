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


def test_an_error_that_transients_may_hide_is_not_stated_without_a_test():
    unknown = summarise_quality(0.01, 0.002, None, misfit_bound=None)
    assert unknown.expected_error is None
    assert "is not known (misfit 1.00 %" in write_quality_sentence(unknown)
    assert find_worst_quality((ModelQuality(0.5, 0.5), unknown)) is unknown
    assert summarise_quality(0.01, 0.002, (0.3, None, 2.0), misfit_bound=None).expected_error == 0.3


def test_a_model_without_a_stored_quality_says_so_and_not_how_old_it_is():
    assert "version" not in NOT_STORED
    assert write_quality_sentence(None) == NOT_STORED
    assert write_quality_brief(None) == "quality not stored"
    assert find_worst_quality((ModelQuality(0.1, 0.1), None)) is None


@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_figures_that_cannot_be_are_refused(value):
    with pytest.raises(ValueError, match="held_out_error is"):
        ModelQuality(0.1, 0.1, held_out_error=value)
