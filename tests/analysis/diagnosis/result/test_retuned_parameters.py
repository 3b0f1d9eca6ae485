"""Sentences about parameters of the model that re-tuning moved beyond their tolerance."""

from dataclasses import replace

from analysis.diagnosis.result.retuned_parameters import MovedParameter, describe_retuning, doubtful_sentences

MOVED = MovedParameter("damping fx", 0.35, "N s/m", 2.1)


def test_numbers_of_the_model_that_moved_too_far_are_doubted():
    assert describe_retuning(()) == ""
    assert describe_retuning((MOVED,) * 6).endswith("(2.1 standard deviations) and 2 more.")
    assert doubtful_sentences((MOVED,)) == ()
    (far,) = doubtful_sentences((replace(MOVED, deviations=-3.4),))
    assert far.startswith("The damping fx was moved by 3.4 standard deviations of its calibration: either")
    (edge,) = doubtful_sentences((replace(MOVED, deviations=4.0),))
    assert "of its calibration, as far as it may: either" in edge


def test_a_model_that_was_fitted_here_has_no_calibration_to_leave():
    assert describe_retuning((MOVED,), fitted=True) == (
        "Fitted once more, these parameters of the first model moved by more than was left open at first: "
        "damping fx +0.350 N s/m."
    )
    assert doubtful_sentences((replace(MOVED, deviations=-3.4),), fitted=True) == ()
    (edge,) = doubtful_sentences((replace(MOVED, deviations=4.0),), fitted=True)
    assert "calibration" not in edge and edge.startswith("As far as they may")


def test_many_doubtful_numbers_are_counted_in_one_sentence():
    moved = (*(replace(MOVED, deviations=4.0) for _ in range(8)), *(replace(MOVED, deviations=-3.5) for _ in range(3)))
    (said,) = doubtful_sentences(moved)
    assert said.startswith("11 parameters were moved by 3 standard deviations of their calibration or more, 8 of them")


def test_a_relative_change_is_read_as_per_cent():
    assert MovedParameter("mass of the mode at 82 Hz", -0.021, "1", -2.1).text == (
        "mass of the mode at 82 Hz −2.1 % (2.1 standard deviations)"
    )
