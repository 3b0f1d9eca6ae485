"""Which samples count for what."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.observed import (
    Span,
    compute_error_units,
    find_moving_spans,
    split_samples,
    stack_measured_signals,
)
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.limits import MODEL_FLOOR
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal


def make_segment(start, stop, role="fit", level=1.0, kind="multisine"):
    return Segment(start, stop, kind, level, 0, role)


def sample_counts(segments, length=1000, tested=False):
    return tuple(int(mask.sum()) for mask in split_samples(tuple(segments), length, tested))


def make_recording(response, position=None):
    n = len(response)
    moved = None if position is None else Signal(position, 1000.0, "position", "m", tuple("xyz"[: position.shape[1]]))
    return Recording(
        "small",
        Signal(np.zeros((n, 2)), 1000.0, "force", "N", ("fx", "fy")),
        Signal(response, 1000.0, "acceleration", "m/s^2", ("ax", "ay")),
        moved,
    )


def test_no_sample_counts_twice():
    for segments in (
        [],
        [make_segment(0, 500)],
        [make_segment(0, 500), make_segment(600, 900, "test")],
        [make_segment(0, 1000, "")],
    ):
        fit, choose, test = split_samples(tuple(segments), 1000)
        assert not (fit & choose).any() and not (fit & test).any() and not (choose & test).any()


def test_without_segments_the_end_is_sealed_and_what_is_before_it_is_split():
    fit, choose, test = split_samples((), 1000)
    assert np.flatnonzero(test)[[0, -1]].tolist() == [750, 999]
    assert np.flatnonzero(choose)[[0, -1]].tolist() == [562, 749]
    assert fit.sum() == 562


def test_the_last_quarter_of_each_part_s_motion_is_sealed():
    time_s = np.arange(1000) / 100
    response = np.where(time_s < 4, np.sin(9 * time_s), 0.0)[:, None]
    response[600:] = np.sin(time_s[600:])[:, None]
    response[600:603] = np.nan
    spans = find_moving_spans(response, [(0, 600), (600, 1000)])
    assert spans == (Span(0, pytest.approx(400, abs=2), 600), Span(600, 1000, 1000))
    fit, choose, test = split_samples((), 1000, spans=spans)
    assert np.flatnonzero(test)[0] == pytest.approx(300, abs=2)
    assert test[302:398].all() and not test[402:900].any() and test[900:].all()
    assert fit[402:600].all()
    assert choose[230:298].all() and choose[830:900].all() and fit[:220].all() and fit[600:820].all()


@pytest.mark.parametrize("tested", [True, False])
def test_gaps_between_parts_and_their_order_are_nothing_to_the_roles(tested):
    fit, choose, test = split_samples((), 1000, tested, (Span(600, 700, 800), Span(0, 200, 200)))
    counted = [[int(mask[part].sum()) for mask in (fit, choose, test)] for part in (slice(0, 200), slice(600, 800))]
    assert counted == ([[150, 50, 0], [150, 50, 0]] if tested else [[112, 38, 50], [156, 19, 25]])
    assert not (fit | choose | test)[200:600].any() and not (fit | choose | test)[800:].any()


def test_what_hardly_moves_is_split_as_if_it_moved_for_half_of_the_time():
    assert find_moving_spans(np.ones((100, 1)), [(0, 100)]) == (Span(0, 100, 100),)
    settles = np.minimum(np.arange(100.0), 10)[:, None]
    assert find_moving_spans(settles, [(0, 100)]) == (Span(0, 50, 100),)
    unread = np.hstack([settles, np.full((100, 1), np.nan)])
    assert find_moving_spans(unread, [(0, 100)]) == (Span(0, 50, 100),)


def test_segments_without_roles_are_treated_alike_and_the_pauses_count_for_nothing():
    fit, choose, test = split_samples((make_segment(0, 400, ""), make_segment(500, 900, "")), 1000)
    assert not (fit | choose | test)[400:500].any() and not (fit | choose | test)[900:].any()
    assert test.sum() == 200 and test[700:900].all()


def test_what_is_marked_as_test_stays_sealed():
    fit, choose, test = split_samples((make_segment(0, 600), make_segment(700, 1000, "test")), 1000)
    assert np.flatnonzero(test)[[0, -1]].tolist() == [700, 999]
    assert fit.sum() == 450 and choose[450:600].all()


def test_the_middle_of_three_levels_is_kept_back_to_choose_by():
    levels = [
        make_segment(0, 100, level=0.5),
        make_segment(200, 300, level=1.5),
        make_segment(400, 500, level=3.0),
        make_segment(600, 700, "test", 1.5),
    ]
    fit, choose, test = split_samples(tuple(levels), 1000)
    assert np.flatnonzero(choose)[[0, -1]].tolist() == [200, 299]
    assert fit.sum() == 200 and test.sum() == 100


def test_each_level_is_fitted_to_and_tested_by_where_nothing_is_marked():
    levels = [make_segment(0, 400, "", 0.5), make_segment(400, 800, "", 1.5), make_segment(800, 1200, "", 3.0)]
    fit, choose, test = split_samples(tuple(levels), 1200)
    assert [int(test[k : k + 400].sum()) for k in (0, 400, 800)] == [100, 100, 100]
    assert [int(fit[k : k + 400].sum()) for k in (0, 400, 800)] == [300, 0, 300]
    assert choose[400:700].all()


def test_of_what_repeats_whole_periods_are_tested_by():
    for periods, tested in ((5, 1), (4, 1), (8, 2), (2, 1)):
        long = 100 * periods
        levels = [Segment(k * long, (k + 1) * long, "multisine", 1.0 + k, 100) for k in range(2)]
        _, _, test = split_samples(tuple(levels), 2 * long)
        assert [int(test[k * long : (k + 1) * long].sum()) for k in range(2)] == [100 * tested, 100 * tested]
        assert test[long - 100 * tested : long].all()


def test_of_two_levels_none_is_kept_back():
    assert sample_counts(
        [make_segment(0, 400, level=1.0), make_segment(400, 800, level=2.0), make_segment(900, 1000, "test")]
    ) == (600, 200, 100)


def test_a_level_that_is_only_tested_is_none_to_choose_by():
    segments = [
        make_segment(0, 400, level=1.0),
        make_segment(400, 800, level=2.0),
        make_segment(900, 1000, "test", 3.0),
    ]
    assert sample_counts(segments) == (600, 200, 100)


def test_rest_is_neither_fitted_nor_tested():
    fit, choose, test = split_samples((make_segment(0, 500), make_segment(500, 1000, "", kind="rest")), 1000)
    assert not (fit | choose | test)[500:].any()


def test_where_another_recording_is_there_to_test_by_none_of_this_one_is_sealed():
    assert sample_counts([], tested=True) == (750, 250, 0)
    assert sample_counts([make_segment(0, 800)], tested=True) == (600, 200, 0)


def test_a_recording_that_is_all_test_is_not_fitted():
    assert sample_counts([make_segment(0, 1000, "test")]) == (0, 0, 1000)


def test_lost_samples_count_for_nothing():
    samples = np.ones((1000, 2))
    samples[100:200, 1] = np.nan
    seen = observe_parts([make_recording(samples)], 2)[0]
    assert not (seen.fit | seen.choose | seen.test)[100:200].any()
    assert (seen.fit | seen.choose | seen.test).sum() == 900


def test_positions_are_compared_where_they_belong_to_the_outputs():
    samples = np.ones((50, 2))
    assert stack_measured_signals(make_recording(samples, 2 * samples), 2)[0].shape == (50, 4)
    assert stack_measured_signals(make_recording(samples, np.ones((50, 3))), 2)[0].shape == (50, 2)
    assert stack_measured_signals(make_recording(samples), 2)[0].shape == (50, 2)


def test_decisions_do_not_reach_the_sealed_samples():
    seen = observe_parts([make_recording(np.ones((1000, 2)))], 2)[0]
    short = seen.shorten()
    assert len(short.command) == len(short.measured) == 750
    assert not short.test.any()
    assert (short.fit.sum(), short.choose.sum()) == (seen.fit.sum(), seen.choose.sum())


def test_errors_are_counted_in_noise_and_in_a_share_of_the_signal():
    loud = np.full((100, 1), 10.0)
    assert compute_error_units(loud, np.array([1.0])) == pytest.approx(np.hypot(1.0, 10 * MODEL_FLOOR))
    assert compute_error_units(loud, np.array([0.0])) == pytest.approx(10 * MODEL_FLOOR)


def test_what_was_chosen_by_other_means_is_fitted_to_all_but_the_held_out_samples():
    segments = (make_segment(0, 600), make_segment(600, 1000, "test"))
    (observed,) = observe_parts([replace(make_recording(np.zeros((1000, 2))), segments=segments)], 2)
    whole = observed.join_fit_and_choose()
    assert (whole.fit == (observed.fit | observed.choose)).all()
    assert whole.fit[:600].all()
    assert (whole.choose == whole.fit).all()
    assert (whole.test == observed.test).all()
    assert not (whole.fit & whole.test).any()
