"""Segments for recordings that have none: a period that is there is found, and none is invented."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data import find_segments as find_segments_module
from analysis.diagnosis.data.find_segments import find_exact_period, find_segments
from analysis.diagnosis.noise.noise_floor import estimate_noise_floor
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal


def tile_noise(period, times, seed=1):
    return np.tile(np.random.default_rng(seed).standard_normal(period), 12)[: int(times * period)]


def make_recording(command, response=None, **meta):
    count = len(command)
    response = command if response is None else response
    return Recording(
        "rig",
        Signal(command.reshape(count, -1), 1000.0, "force", "N", ("fx", "fy")[: command.size // count]),
        Signal(response.reshape(count, -1), 1000.0, "acceleration", "m/s^2", ("ax", "ay")[: response.size // count]),
        meta=meta,
    )


def make_parts(levels, period=500, times=5.0):
    pieces = [level * tile_noise(period, times) for level in levels]
    ends = np.cumsum([len(piece) for piece in pieces]).tolist()
    parts = [{"start": stop - len(piece), "stop": stop} for piece, stop in zip(pieces, ends, strict=True)]
    return np.concatenate(pieces), parts


def test_each_part_becomes_a_segment_with_its_period_and_level():
    command, parts = make_parts((0.5, 1.0, 2.0))
    found, said = find_segments(make_recording(command, parts=parts))
    top = np.abs(tile_noise(500, 1)).max()
    assert [(s.start, s.stop, s.kind, s.period, s.role) for s in found.segments] == [
        (0, 2500, "multisine", 500, ""), (2500, 5000, "multisine", 500, ""), (5000, 7500, "multisine", 500, "")
    ]  # fmt: skip
    assert [s.amplitude for s in found.segments] == pytest.approx([0.5 * top, top, 2 * top])
    assert said.startswith("The excitation repeats exactly, every 500 samples, 5 times or more in each part")


def test_noise_is_then_taken_from_the_repeats():
    command = tile_noise(500, 8)
    noisy = 3 * command + 0.2 * np.random.default_rng(5).standard_normal(len(command))
    found, _ = find_segments(make_recording(command, noisy))
    floor = estimate_noise_floor(found)
    assert floor.method == "repeats"
    assert floor.response_rms[0] == pytest.approx(0.2, rel=0.1)
    assert estimate_noise_floor(make_recording(command, noisy)).method != "repeats"


@pytest.mark.parametrize("digits", [3, 6, 16])
def test_numbers_that_were_rounded_repeat_as_well(digits):
    lines = np.arange(1, 60)
    time = np.arange(3000) / 1000
    phases = np.random.default_rng(2).uniform(0, 6, len(lines))
    command = np.cos(2 * np.pi * np.outer(time, 2 * lines) + phases).sum(axis=1)
    assert find_exact_period(np.round(command, digits)[:, None]) == 500


def test_of_a_short_period_an_odd_multiple_is_stated():
    command = np.sin(2 * np.pi * np.arange(8000) / 100)
    found, _ = find_segments(make_recording(command))
    assert [(s.kind, s.period) for s in found.segments] == [("sine", 1500)]


def _slow_sine():
    return np.sin(2 * np.pi * np.arange(4000) / 499.6)


@pytest.mark.parametrize(
    "command",
    [
        np.random.default_rng(1).standard_normal(4000),
        tile_noise(1000, 2.9),
        tile_noise(500, 8) + 1e-3 * np.random.default_rng(3).standard_normal(4000),
        tile_noise(500, 8) * np.linspace(1, 1.01, 4000),
        np.concatenate([tile_noise(500, 3), np.random.default_rng(4).standard_normal(2000)]),
        np.repeat(np.random.default_rng(0).integers(0, 2, 2000), 130).astype(float),
        np.where(np.arange(4000) == 1234, np.nan, tile_noise(500, 8)),
        _slow_sine(),
        np.ones(4000),
        np.sin(2 * np.pi * np.arange(900) / 30),
    ],
    ids=["noise", "two", "measured", "growing", "three among noise", "bits", "missing", "not whole", "constant",
         "short"],
)  # fmt: skip
def test_no_period_is_invented(command):
    before = make_recording(command)
    assert find_segments(before) == (before, "")


def test_levels_one_after_another_become_segments():
    """In one recording, with rest before, between and after, a sweep, and other waves of other periods."""
    sweep = np.sin(1e-5 * np.arange(3000) ** 2)
    pieces = [
        np.zeros(250), tile_noise(500, 7), 2 * tile_noise(500, 5), np.zeros(700), tile_noise(900, 4, seed=4), sweep,
        np.tile(tile_noise(100, 1, seed=5), 30), np.zeros(30),
    ]  # fmt: skip
    ends = np.cumsum([len(piece) for piece in pieces])
    found, said = find_segments(make_recording(np.concatenate(pieces)))
    assert [(s.start, s.stop, s.kind, s.period) for s in found.segments] == [
        (250, ends[1], "multisine", 500), (ends[1], ends[2], "multisine", 500), (ends[3], ends[4], "multisine", 900),
        (ends[4], ends[5], "noise", 0), (ends[5], ends[6], "multisine", 500),
    ]  # fmt: skip
    assert said.startswith("In 4 of 5 parts the excitation repeats exactly, every 500 and 900 samples")


def test_of_many_places_that_recur_few_samples_are_compared(monkeypatch):
    """Equal pulses at random times: each recurs at hundreds of places, and nowhere for three periods."""
    command, starts = np.zeros(200_000), np.random.default_rng(3).integers(0, 199_000, 300)
    for start in starts:
        command[start : start + 300] = np.hanning(300)
    compared = []
    count_equal = find_segments_module._count_equal

    def count(later, earlier, tolerance):
        compared.append(found := count_equal(later, earlier, tolerance))
        return found

    monkeypatch.setattr(find_segments_module, "_count_equal", count)
    assert find_segments(make_recording(command))[0].segments == ()
    assert len(compared) > 100 and sum(compared) < 20 * len(command)


def test_two_channels_repeat_only_together():
    both = np.column_stack([tile_noise(500, 8), tile_noise(700, 8, seed=2)[:4000]])
    assert find_segments(make_recording(both))[0].segments == ()
    steps = np.column_stack([tile_noise(500, 8), 3 * tile_noise(500, 8, seed=2)])
    found, _ = find_segments(make_recording(np.vstack([steps, 0.5 * steps])))
    assert [(s.start, s.stop, s.period) for s in found.segments] == [(0, 4000, 500), (4000, 8000, 500)]


def test_segments_of_its_own_stay():
    before = replace(make_recording(tile_noise(500, 8)), segments=(Segment(0, 4000, "noise", role="fit"),))
    assert find_segments(before) == (before, "")


def test_a_part_that_does_not_repeat_beside_one_that_does_is_not_taken_for_rest():
    command = np.concatenate([tile_noise(500, 5), np.random.default_rng(9).standard_normal(2000)])
    parts = [{"start": 0, "stop": 2500}, {"start": 2500, "stop": 4500}]
    found, said = find_segments(make_recording(command, parts=parts))
    assert [(s.kind, s.period) for s in found.segments] == [("multisine", 500), ("noise", 0)]
    assert said.startswith("In 1 of 2 parts the excitation repeats exactly")
