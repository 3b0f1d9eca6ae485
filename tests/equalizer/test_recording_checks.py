from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.recording_checks import check_recording, list_recording_problems
from equalizer.signals.signal import Signal


def signal(n=100, channels=("x", "y"), rate_hz=1000.0, fill=0.0):
    return Signal(np.full((n, len(channels)), fill), rate_hz, "position", "m", channels)


@pytest.fixture
def recording():
    return Recording("bench", signal(), signal(), segments=(Segment(10, 50, "sine", 1.0, 20, "fit"),))


def the_problem(recording):
    (problem,) = check_recording(recording)
    return problem


def test_a_consistent_recording_has_no_problems(recording):
    assert check_recording(recording) == ()


def test_missing_samples_are_no_problem(recording):
    samples = np.zeros((100, 2))
    samples[7, 1] = np.nan
    gappy = replace(recording, response=Signal(samples, 1000.0, "position", "m", ("x", "y")))
    assert check_recording(gappy) == ()


def test_an_infinite_value_is_no_missing_sample(recording):
    wrong = replace(recording, response=signal(fill=np.inf))
    assert the_problem(wrong) == "response holds infinite values; a missing sample is NaN"


def test_signals_of_different_length_or_rate_are_named(recording):
    assert the_problem(replace(recording, position=signal(n=99))) == (
        "position has 99 samples, but response has 100; all must be equally long"
    )
    assert the_problem(replace(recording, position=signal(rate_hz=500.0))) == (
        "position is at 500 Hz, but response at 1000 Hz"
    )


def test_a_channel_named_twice_and_a_signal_without_channels_are_named(recording):
    assert the_problem(replace(recording, position=signal(channels=("x", "x")))) == (
        "position names a channel twice: x, x"
    )
    assert the_problem(replace(recording, position=signal(channels=()))) == "position has no channels"


def test_a_recording_without_samples_is_named():
    assert the_problem(Recording("bench", signal(n=0), signal(n=0))) == "response holds no samples"


def test_the_excitation_has_the_channels_of_the_command(recording):
    wrong = replace(recording, excitation=signal(channels=("x", "z")))
    assert the_problem(wrong).startswith("excitation has the channels x, z, but command has x, y")


@pytest.mark.parametrize(
    ("segment", "problem"),
    [
        (Segment(10, 10, "sine"), "goes from 10 to 10; start must be at least 0 and below stop"),
        (Segment(-1, 10, "sine"), "goes from -1 to 10; start must be at least 0 and below stop"),
        (Segment(10, 101, "sine"), "stops at 101, but the recording has 100 samples"),
        (Segment(10, 20, "wiggle"), "has the unknown kind 'wiggle'; allowed are multisine, sweep, sine"),
        (Segment(10, 20, "sine", role="train"), "has the unknown role 'train'; allowed are fit, test, or empty"),
        (Segment(10, 20, "sine", np.nan), "has the amplitude nan; it must be a number that is not negative"),
        (Segment(10, 20, "sine", 1.0, -3), "has the period -3; it counts samples, and 0 means not periodic"),
    ],
)
def test_an_impossible_segment_is_named_by_its_number(recording, segment, problem):
    assert the_problem(replace(recording, segments=(segment,))).startswith(f"segment 1 {problem}")


def test_overlapping_segments_are_named_in_any_order(recording):
    segments = (Segment(50, 90, "sine"), Segment(10, 51, "sweep"))
    assert the_problem(replace(recording, segments=segments)) == (
        "segments 2 and 1 overlap (one stops at 51, the other starts at 50)"
    )
    assert check_recording(replace(recording, segments=(segments[0], Segment(10, 50, "sweep")))) == ()


def test_each_segment_within_a_longer_earlier_one_overlaps_it(recording):
    segments = (Segment(0, 80, "sine"), Segment(10, 20, "sine"), Segment(30, 40, "sine"), Segment(90, 95, "sine"))
    assert check_recording(replace(recording, segments=segments)) == (
        "segments 1 and 2 overlap (one stops at 80, the other starts at 10)",
        "segments 1 and 3 overlap (one stops at 80, the other starts at 30)",
    )


@pytest.mark.parametrize(
    ("time_s", "problem"),
    [
        (np.arange(99.0), r"time_s has shape (99,), but must be (100,), one stamp per sample"),
        (np.full(100, np.nan), "time_s holds values that are not numbers"),
        (np.minimum(np.arange(100.0), 40.0), "time_s does not grow at sample 41"),
    ],
)
def test_impossible_time_stamps_are_named(recording, time_s, problem):
    assert the_problem(replace(recording, time_s=time_s)).startswith(problem)


def test_arrays_in_units_outside_si_are_a_problem_of_the_named_recording(recording):
    millimetres = replace(recording, response=replace(recording.response, unit="mm"))
    furlongs = replace(recording, command=replace(recording.command, unit=("furlong", "m")))
    assert list_recording_problems([recording]) == ()
    in_millimetres, unknown = list_recording_problems([millimetres, recording, furlongs], "abc")[1:]
    assert in_millimetres == "a: response y is in mm; convert its samples to SI, here m, and state that unit"
    assert unknown.startswith("c: command x: 'furlong' is not a unit known here")


def test_recordings_of_a_device_at_rest_may_be_alike(recording):
    moved = replace(recording, response=replace(recording.response, samples=np.arange(200.0).reshape(100, 2)))
    (problem,) = list_recording_problems([recording, recording, moved, replace(moved, device="copy")], "abcd")
    assert problem == "d holds the same samples as c, and a recording counts once: leave it out"


@pytest.mark.parametrize(("unit", "si"), [("counts", "1"), ("Nm", "N m")])
def test_a_unit_of_the_same_scale_needs_no_conversion(recording, unit, si):
    said, _ = list_recording_problems([replace(recording, command=replace(recording.command, unit=unit))])
    assert said.endswith(f"is in {unit}; state that unit as {si}")


def test_rates_that_differ_in_the_last_digits_are_stated_by_all_digits(recording):
    problem = the_problem(replace(recording, command=signal(rate_hz=1000.0 + 1e-6)))
    assert problem == "command is at 1000.000001 Hz, but response at 1000 Hz"


def test_indices_of_a_segment_are_whole_numbers(recording):
    half = replace(recording, segments=(Segment(0, 50, "sine", period=12.5),))
    assert the_problem(half) == "segment 1 has the start, stop or period 0, 50, 12.5; give whole numbers"
