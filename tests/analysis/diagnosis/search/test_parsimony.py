"""Which of nearly equal explanations is preferred, over invented errors."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.search.parsimony import (
    are_inseparable,
    compute_excess,
    is_equal_rival,
    is_refined_candidate,
    move_preferred_first,
)


def plainest_effect(*fitted_candidates):
    ranked = sorted(fitted_candidates, key=lambda fitted_candidate: fitted_candidate.score.mean_log_error)
    return move_preferred_first(ranked)[0].fitted.hypothesis.claims[-1].effect.name


def test_of_no_candidates_none_is_preferred():
    assert move_preferred_first(()) == ()


def test_the_better_one_of_two_unlike_laws_stands_first(make_candidate):
    assert plainest_effect(make_candidate(1.5, "coulomb_friction"), make_candidate(1.2, "hardening_stiffness")) == (
        "hardening_stiffness"
    )


def test_a_refined_law_must_bring_more_than_a_trifle(make_candidate):
    plain, refined = make_candidate(1.0010, "coulomb_friction"), make_candidate(1.0002, "stribeck_friction")
    assert plainest_effect(plain, refined) == "coulomb_friction"


def test_a_refined_law_that_halves_what_is_left_is_preferred(make_candidate):
    plain, refined = make_candidate(1.5, "coulomb_friction"), make_candidate(1.02, "stribeck_friction")
    assert plainest_effect(plain, refined) == "stribeck_friction"


def test_where_both_are_wrong_the_richer_law_errs_less_without_being_right(make_candidate):
    plain, refined = make_candidate(3.0, "coulomb_friction"), make_candidate(2.6, "stribeck_friction")
    assert plainest_effect(plain, refined) == "coulomb_friction"


def test_half_of_the_power_outweighs_any_plainness(make_candidate):
    plain, refined = make_candidate(100.0, "coulomb_friction"), make_candidate(60.0, "stribeck_friction")
    assert plainest_effect(plain, refined) == "stribeck_friction"


def test_what_rings_on_one_axis_is_a_mode_and_what_is_damped_more_than_a_mode_can_be_a_body(make_candidate):
    mode = make_candidate(1.0010, "extra_mode")
    assert plainest_effect(mode, make_candidate(1.0008, "body_on_actuator")) == "extra_mode"
    assert not is_equal_rival(mode, make_candidate(1.0008, "body_on_actuator"))
    assert (
        plainest_effect(make_candidate(3.0, "extra_mode"), make_candidate(1.02, "body_on_actuator"))
        == "body_on_actuator"
    )


def test_a_law_refines_another_at_its_own_place_only(make_candidate):
    plain = make_candidate(1.5, "coulomb_friction")
    assert is_refined_candidate(make_candidate(1.5, "stribeck_friction"), plain)
    assert not is_refined_candidate(make_candidate(1.5, "stribeck_friction", sites=(1,)), plain)
    assert not is_refined_candidate(plain, make_candidate(1.5, "stribeck_friction"))


def test_of_two_that_are_as_good_the_one_with_fewer_numbers_is_preferred(make_candidate):
    few, many = make_candidate(1.0004, "coulomb_friction"), make_candidate(1.0001, "extra_mode")
    assert len(few.fitted.hypothesis.point) < len(many.fitted.hypothesis.point)
    assert plainest_effect(few, many) == "coulomb_friction"


def test_the_order_of_the_others_stays(make_candidate):
    ranked = [make_candidate(1.0 + k / 10, "force_gain") for k in range(4)]
    assert move_preferred_first(ranked) == tuple(ranked)


def test_near_the_noise_a_small_difference_tells(make_candidate):
    assert are_inseparable(make_candidate(1.0, "force_gain"), make_candidate(1.0003, "sensor_gain"))
    assert not are_inseparable(make_candidate(1.0, "force_gain"), make_candidate(1.002, "sensor_gain"))


def test_far_above_the_noise_only_a_share_of_it_tells(make_candidate):
    assert are_inseparable(make_candidate(3.0, "force_gain"), make_candidate(3.3, "sensor_gain"))
    assert not are_inseparable(make_candidate(3.0, "force_gain"), make_candidate(4.0, "sensor_gain"))


def test_a_candidate_that_fits_better_is_inseparable_from_a_worse_one(make_candidate):
    assert are_inseparable(make_candidate(2.0, "force_gain"), make_candidate(1.0, "sensor_gain"))


def test_noise_has_no_excess(make_candidate):
    assert compute_excess(make_candidate(1.0)) == 0.0
    assert compute_excess(make_candidate(0.9)) == 0.0
    assert compute_excess(make_candidate(2.0)) == pytest.approx(2 * 0.693, abs=0.02)


def test_a_refined_law_is_not_preferred_for_sparing_the_calibration(make_candidate):
    plain, refined = make_candidate(1.02, "added_mass"), make_candidate(1.02, "hand_impedance")
    strained = replace(plain, fitted=replace(plain.fitted, deviations=np.array([3.5])))
    assert plainest_effect(strained, refined) == plainest_effect(refined, strained) == "added_mass"
    assert plainest_effect(strained, make_candidate(1.02, "force_gain")) == "force_gain"


def test_a_refinement_that_brings_nothing_is_no_second_answer(make_candidate):
    plain, refined = make_candidate(1.001, "coulomb_friction"), make_candidate(1.001, "stribeck_friction")
    assert are_inseparable(plain, refined)
    assert not is_equal_rival(plain, refined)
    assert is_equal_rival(plain, make_candidate(1.001, "amplifier_lag"))
