"""Parts of recordings as they are compared."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.observed_parts import count_fit_samples, observe_parts
from equalizer.signals.recording import Recording, Segment, list_segments
from equalizer.signals.signal import Signal

RATE_HZ, LONG = 1000.0, 1000
LEVELS_N = (0.5, 1.5, 3.0)


def record_three_levels() -> Recording:
    random = np.random.default_rng(1)
    samples = random.standard_normal((len(LEVELS_N) * LONG, 1))
    segments = tuple(
        Segment(k * LONG, (k + 1) * LONG, "noise", level, 0, "") for k, level in enumerate(LEVELS_N)
    )  # fmt: skip
    return Recording(
        "three levels",
        Signal(samples, RATE_HZ, "force", "N", ("fx",)),
        Signal(4 * samples, RATE_HZ, "acceleration", "m/s^2", ("ax",)),
        segments=segments,
    )


def test_the_middle_level_is_chosen_by_and_every_level_is_tested_by():
    (one,) = observe_parts([record_three_levels()], 1)
    assert np.flatnonzero(one.choose)[[0, -1]].tolist() == [LONG, LONG + 3 * LONG // 4 - 1]
    assert [int(one.test[k * LONG : (k + 1) * LONG].sum()) for k in range(3)] == [LONG // 4] * 3
    assert one.fit[:LONG].any() and one.fit[2 * LONG :].any()


def test_where_the_middle_level_was_lost_some_of_what_is_left_is_chosen_by():
    whole = record_three_levels()
    lost = whole.response.samples.copy()
    lost[LONG : 2 * LONG] = np.nan
    recording = replace(whole, response=replace(whole.response, samples=lost))
    (one,) = observe_parts([recording], 1)
    assert one.choose.any() and one.fit.any() and one.test.any()
    assert np.isfinite(lost[one.fit | one.choose | one.test]).all()
    assert count_fit_samples([recording]) == one.fit.sum()


def test_each_part_is_one_segment_where_none_is_stated():
    parts = [{"start": 0, "stop": 500}, {"start": 500, "stop": 1200}, {"start": 1200, "stop": 3000}]
    recording = replace(record_three_levels(), segments=(), meta={"parts": parts})
    segments = [list_segments(part.recording) for part in observe_parts([recording], 1)]
    assert segments == [(Segment(0, length, "noise"),) for length in (500, 700, 1800)]
