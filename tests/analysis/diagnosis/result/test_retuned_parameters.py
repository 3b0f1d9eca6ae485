"""Sentences about parameters of the model that re-tuning moved beyond their tolerance."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.document import Errors
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.result.retuned_parameters import (
    MovedParameter,
    describe_doubtful_parameters,
    describe_raised_error,
    describe_retuning,
    list_parameters,
)
from equalizer.plant.mechanical_model import MechanicalModel

MOVED = MovedParameter("damping fx", 0.35, "N s/m", 2.1)


def test_numbers_of_the_model_that_moved_too_far_are_doubted():
    assert describe_retuning(()) == ""
    assert describe_retuning((MOVED,) * 6).endswith("(2.1 standard deviations) and 2 more.")
    assert describe_doubtful_parameters((MOVED,)) == ()
    (far,) = describe_doubtful_parameters((replace(MOVED, deviations=-3.4),))
    assert far.startswith("The damping fx was moved by 3.4 standard deviations of its calibration: either")
    (edge,) = describe_doubtful_parameters((replace(MOVED, deviations=4.0, at_bound=True),))
    assert "of its calibration, to the limit of its allowed range: either" in edge


def test_a_model_that_was_fitted_here_has_no_calibration_to_leave():
    assert describe_retuning((MOVED,), fitted=True) == (
        "In the final fit, these parameters of the first model changed by more than the tolerance of the first fit: "
        "damping fx +0.350 N s/m."
    )
    assert describe_doubtful_parameters((replace(MOVED, deviations=-3.4),), fitted=True) == ()
    (edge,) = describe_doubtful_parameters((replace(MOVED, deviations=4.0, at_bound=True),), fitted=True)
    assert "calibration" not in edge and edge.startswith("These parameters of the first model reached the limit")


def test_many_doubtful_numbers_are_counted_in_one_sentence():
    moved = (
        *(replace(MOVED, deviations=4.0, at_bound=True) for _ in range(8)),
        *(replace(MOVED, deviations=-3.5) for _ in range(3)),
    )
    (said,) = describe_doubtful_parameters(moved)
    assert said.startswith("11 parameters were moved by 3 standard deviations of their calibration or more, 8 of them")


def test_a_parameter_is_at_the_bound_of_its_own_search():
    eye = np.eye(1)
    tuning = make_tuning(MechanicalModel("m", "velocity", eye, eye, eye, eye, eye), ("fx",))
    deviations = np.zeros(len(tuning.names))
    deviations[0] = -tuning.bound
    assert [each.at_bound for each in list_parameters(tuning, deviations)][:2] == [True, False]
    wider = tuning.with_wider_bound()
    assert not any(each.at_bound for each in list_parameters(wider, deviations))
    deviations[0] = -wider.bound
    assert list_parameters(wider, deviations)[0].at_bound


def test_a_relative_change_is_read_as_per_cent():
    assert MovedParameter("mass of the mode at 82 Hz", -0.021, "1", -2.1).text == (
        "mass of the mode at 82 Hz −2.1 % (2.1 standard deviations)"
    )
    assert MovedParameter("damping of the mode at 13 Hz", -1.23, "1", -2.1).change_text == "−120 %"


def test_an_error_of_many_times_the_signal_is_read_as_a_plain_number():
    assert describe_raised_error(Errors(1453.4, 1861.0, None, None)).startswith(
        "Re-tuning raises the error on held-out data from 1450 times to 1860 times the signal: "
    )
