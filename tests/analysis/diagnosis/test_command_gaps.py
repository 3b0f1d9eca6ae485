"""A command that a logger lost in places: bridged where it moves slowly, else cut, left where little stays."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.prepare_recordings import bridge_gaps
from equalizer.signals.recording import Recording, find_parts
from equalizer.signals.signal import Signal

RATE_HZ = 500.0
SAMPLES = 5000


def make_recording(command) -> Recording:
    samples = np.asarray(command, dtype=np.float64)[:, None]
    return Recording(
        "bench",
        Signal(samples, RATE_HZ, "force", "N", ("fx",)),
        Signal(np.random.default_rng(1).standard_normal((len(samples), 1)), RATE_HZ, "position", "m", ("x",)),
    )


def slow_sine():
    return np.sin(2 * np.pi * 2 * np.arange(SAMPLES) / RATE_HZ)


def white_noise():
    return np.random.default_rng(0).standard_normal(SAMPLES)


def lose_samples(command, *stretches):
    found = np.array(command)
    for start, stop in stretches:
        found[start:stop] = np.nan
    return found


def test_short_gaps_of_a_slow_command_are_bridged_within_the_share_that_is_asked_for():
    (found,), (said,) = bridge_gaps([make_recording(lose_samples(slow_sine(), (1000, 1003), (3000, 3001)))], ["a"])
    assert np.abs(found.command.samples[:, 0] - slow_sine()).max() < 0.02
    assert find_parts(found) == ((0, SAMPLES),)
    assert "2 gaps (4 samples) interpolated" in said


def test_gaps_of_a_fast_command_are_cut_out_and_what_is_known_stays():
    command = white_noise()
    (found,), (said,) = bridge_gaps([make_recording(lose_samples(command, (1000, 1003), (3000, 3001)))], ["a"])
    assert find_parts(found) == ((0, 1000), (1003, 3000), (3001, SAMPLES))
    assert all(np.array_equal(found.command.samples[a:b, 0], command[a:b]) for a, b in find_parts(found))
    assert "2 gaps (4 samples) cut out, so that 3 parts" in said


def test_a_long_gap_of_a_slow_command_is_cut_within_the_parts_that_were_known():
    parts = [{"start": 0, "stop": 1500}, {"start": 1500, "stop": SAMPLES}]
    known = replace(make_recording(lose_samples(slow_sine(), (1200, 1600))), meta={"parts": parts})
    (found,), _ = bridge_gaps([known], ["a"])
    assert find_parts(found) == ((0, 1200), (1600, SAMPLES))


def test_a_whole_command_is_not_touched_and_nothing_is_reported():
    whole = make_recording(white_noise())
    found, said = bridge_gaps([whole], ["a"])
    assert found[0] is whole
    assert said == ()


def test_what_gaps_leave_little_of_stays_as_it_is_to_be_refused():
    torn = make_recording(lose_samples(white_noise(), *((k, k + 1) for k in range(0, SAMPLES, 20))))
    found, said = bridge_gaps([torn], ["a"])
    assert found[0] is torn
    assert said == ()
