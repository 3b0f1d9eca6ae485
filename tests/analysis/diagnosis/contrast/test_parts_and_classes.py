"""What the ends of parts weigh, and which faults make a class."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.contrast.autoregressive_base import AutoregressiveBase
from analysis.diagnosis.contrast.bases import build_bases
from analysis.diagnosis.contrast.choose_fault import choose_fault
from analysis.diagnosis.contrast.compared_base import REACH, ComparedBase, UndoneRows, compare_base
from analysis.diagnosis.contrast.recording_part import split_into_parts


@pytest.fixture(scope="module")
def compared_base(rig) -> ComparedBase:
    clean, other = split_into_parts([rig.record_rig(1)]), split_into_parts([rig.record_rig(2)])
    return compare_base(next(build_bases(clean, other))[0][0], clean, other)


@pytest.mark.slow
def test_the_ends_of_a_part_and_what_lies_beside_a_gap_do_not_count(rig):
    clean = split_into_parts([rig.record_rig(1)])
    gap = np.arange(rig.COUNT) == 2500
    with_gap = replace(clean[0], known=clean[0].known & ~gap)
    (mask,) = compare_base(next(build_bases(clean, ()))[0][0], (with_gap,), clean).clean.masks
    assert len(mask) == rig.COUNT
    assert not mask[:REACH].any() and not mask[-REACH:].any()
    assert not mask[2500 - REACH : 2501 + REACH].any()
    assert mask[2500 - 2 * REACH] and mask[2500 + 2 * REACH]


@pytest.mark.slow
@pytest.mark.parametrize("lost", ["every 30th", "a tenth"])
def test_sparse_losses_leave_most_rows_to_compare_by(lost, rig):
    """Before, each took 33 rows, and a comparison without rows ended the diagnosis."""
    random = np.random.default_rng(1)
    gone = np.arange(rig.COUNT) % 30 == 0 if lost == "every 30th" else random.random(rig.COUNT) < 0.1
    clean, other = split_into_parts([rig.record_rig(1)]), split_into_parts([rig.record_rig(2)])
    lossy = replace(other[0], known=other[0].known & ~gone)
    compared = compare_base(next(build_bases(clean, other))[0][0], clean, (lossy,))
    assert compared.faulty.valid_row_count > 0.8 * compared.clean.valid_row_count


@pytest.mark.slow
def test_a_side_with_too_few_rows_is_not_compared(rig):
    clean, other = split_into_parts([rig.record_rig(1)]), split_into_parts([rig.record_rig(2)])
    bare = replace(other[0], known=np.arange(rig.COUNT) < 60)
    with pytest.raises(ValueError, match="too few samples"):
        compare_base(next(build_bases(clean, other))[0][0], clean, (bare,))


@pytest.mark.parametrize("short", ["clean", "other"])
def test_a_side_of_takes_that_are_all_too_short_for_the_model_is_not_compared(short, rig):
    """An IndexError of a short clean side once ended the diagnosis."""
    takes = [{"start": start, "stop": start + 1000} for start in range(0, rig.COUNT - 999, 1000)]
    whole = split_into_parts([rig.record_rig(1)])
    in_takes = split_into_parts([replace(rig.record_rig(2), meta={"parts": takes})])
    slow_model = AutoregressiveBase(channel=0, order=24, step=20, response_count=1)
    with pytest.raises(ValueError, match="too few samples"):
        compare_base(slow_model, *((in_takes, whole) if short == "clean" else (whole, in_takes)))


def test_what_undoing_a_fault_loses_stays_as_it_was(compared_base):
    rows = tuple(np.zeros_like(part) for part in compared_base.faulty.rows)
    half = tuple(np.arange(len(part)) < len(part) // 2 for part in rows)
    blocks = compared_base.compute_grams(compared_base.faulty, [UndoneRows(rows, half)]).undo_fault(np.ones(1))
    plain = compared_base.compute_grams(compared_base.faulty, []).blocks
    assert np.allclose(blocks[:8], plain[:8])
    assert np.abs(blocks[-8:]).max() < 1e-3 * np.abs(plain[-8:]).max()


@pytest.mark.slow
@pytest.mark.parametrize(("times", "belongs"), [((0.99, 0.99), True), ((0.85, 1.15), False)])
def test_a_law_that_holds_the_named_one_is_of_its_class_where_it_leaves_less_everywhere(rig, times, belongs):
    found = rig.make_contrast("coulomb_friction", 0.6).comparison
    assert found is not None
    best = choose_fault(found, 1).named
    assert best is not None and best.fault.effect == "coulomb_friction"
    fault = replace(best.fault, effect="asymmetric_friction", simpler=("coulomb_friction",))
    finer = replace(best, fault=fault, block_squares=best.block_squares * np.resize(times, len(best.block_squares)))
    answer = choose_fault(replace(found, faults=(finer, best)), 1)
    assert answer.named is best
    assert ("asymmetric_friction" in answer.equivalents) == belongs


def test_what_is_as_good_but_not_sure_itself_is_of_the_class(rig):
    found = rig.make_contrast("coulomb_friction", 0.6).comparison
    assert found is not None
    best = choose_fault(found, 1).named
    assert best is not None
    none = {name: 0.0 for name in best.values}
    for low, belongs in ((0.05, True), (-0.05, False)):
        other = replace(
            best,
            fault=replace(best.fault, effect="cogging"),
            values=none,
            gain_low=low,
            block_squares=1.001 * best.block_squares,
        )
        assert ("cogging" in choose_fault(replace(found, faults=(best, other)), 1).equivalents) == belongs


def test_a_fault_that_makes_all_errors_of_its_set_larger_shows_in_its_gain(rig):
    found = rig.make_contrast("coulomb_friction", 0.6).comparison
    assert found is not None
    best = found.faults[0]
    assert best.gain_low > 0.1 > 1.6 * best.control_excess
    swallowed = replace(found, sample_count=int(found.block_squares.sum()))
    assert not swallowed.has_difference
    assert swallowed.has_difference_without(best)
    assert not swallowed.has_difference_without(replace(best, gain_low=0.01))


@pytest.mark.parametrize(("varies", "named"), [(False, True), (True, False)])
def test_what_changes_in_the_course_of_a_recording_does_not_count_for_gaining_everywhere(rig, varies, named):
    found = rig.make_contrast("coulomb_friction", 0.6).comparison
    assert found is not None
    best = found.faults[0]
    alike = replace(best, fault=replace(best.fault, varies=varies), control_excess=10.0, gain_low=0.9 * best.gain)
    assert not found.has_difference_without(alike)
    assert (choose_fault(replace(found, faults=(alike,)), 1).named is not None) == named
