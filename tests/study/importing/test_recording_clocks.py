"""Time of a recording: stamps, gaps, uneven rows, resampling."""

import numpy as np
import pytest

from tests.recording_maps import N, U, Y, built, map_text, refusal


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda t: t.__setitem__(7, np.nan), "Clock 'clock': t is no number at sample 7; time is never missing."),
        (lambda t: t.__setitem__(7, t[5]),
         "Clock 'clock': t runs backwards at sample 7, from 6 to 5 s; put the "
         "rows in order, or cut the file there into several, which are imported together."),
        (lambda t: t.__setitem__(7, t[6]),
         "Clock 'clock': t stands still at sample 7, at 6 s; where the sampling was even "
         "and only the stamps are coarse, state the rate in place of `time` in the map's [[clock]], as in "
         "rate_hz = 1; where a sample was logged twice with other values, remove either of the two."),
    ],
)  # fmt: skip
def test_time_that_is_none_is_refused(files, spoil, sentence):
    stamps = np.arange(float(N))
    spoil(stamps)
    assert refusal(map_text('time = "t"\ntime_unit = "s"'), files(u=U, y=Y, t=stamps)) == sentence


@pytest.mark.parametrize(
    ("clock", "sentence"),
    [
        ('time = "t"\ntime_unit = "m"', "Clock 'clock': time_unit is 'm', which is no unit of time."),
        ('time = "t"\ntime_unit = "sec"', "Clock 'clock': time_unit: 'sec' is not a unit known here"),
        ('time = "t[0]"\ntime_unit = "s"', "t[0] has the shape (); stamps are one row of two or more"),
        ('rate = "u"', "'u' has the shape (400,); it must be one finite number"),
        ('rate = "-fs"', "Clock 'clock': its rate, -fs, is -1000; it must be above 0."),
    ],
)
def test_a_clock_that_is_not_understood_is_named(files, clock, sentence):
    assert sentence in refusal(map_text(clock), files(u=U, y=Y, t=np.arange(N) / 1000, fs=1000.0))


@pytest.mark.parametrize(("rate_hz", "digits"), [(800, 3), (130, 3), (7, 1), (400, 3), (100, 4)])
def test_stamps_within_the_rounding_of_their_last_decimal_are_even(files, rate_hz, digits):
    stamps = np.round(12.34567 + np.arange(N) / rate_hz, digits)
    made = built(map_text('time = "t"\ntime_unit = "s"'), files(u=U, y=Y, t=stamps))
    assert made.recording.sample_rate_hz == pytest.approx(rate_hz, rel=1e-3)
    np.testing.assert_array_equal(made.recording.command.samples[:, 0], U)
    assert any("uniform apart from the rounding of their last decimal" in note for note in made.notes) == (
        rate_hz != 100
    )


def test_stamps_that_wander_by_their_last_decimal_are_even_and_that_is_said(files):
    steps = np.full(N - 1, 0.01)
    steps[40:75], steps[300:310] = 0.0099, 0.0101
    made = built(map_text('time = "t"\ntime_unit = "s"'), files(u=U, y=Y, t=np.round(np.cumsum([0, *steps]), 4)))
    assert made.recording.sample_rate_hz == 100
    assert "they lie up to 0.0035 s from a uniform grid." in " ".join(made.notes)


@pytest.mark.parametrize(
    "stamps",
    [
        np.delete(np.arange(41), 17) / 10,
        np.array([0.0, 1, 2, 3, 5]),
        np.round(np.cumsum([0, *[0.0100] * 90, *[0.0101] * 90]), 4),
    ],
    ids=["a row is missing", "a row of five is missing", "the rate changes"],
)
def test_missing_rows_and_changes_of_rate_are_no_rounding(files, stamps):
    count = len(stamps)
    path = files(u=U[:count], y=Y[:count], t=stamps)
    assert "has uneven stamps" in refusal(map_text('time = "t"\ntime_unit = "s"'), path)


def test_a_round_rate_is_taken_only_where_it_fits_as_the_mean_rate_does(files):
    stamps = np.round(np.arange(12) / 7.3, 1)
    made = built(map_text('time = "t"\ntime_unit = "s"'), files(u=U[:12], y=Y[:12], t=stamps))
    assert made.recording.sample_rate_hz == pytest.approx(7.3, abs=0.15)


@pytest.mark.parametrize("spread", [1.2, 3.0])
def test_stamps_that_jitter_by_more_than_their_last_decimal_are_uneven(files, spread):
    jitter = np.random.default_rng(3).uniform(-spread, spread, N)
    stamps = np.round(10 * np.arange(N) + jitter)
    assert "has uneven stamps" in refusal(map_text('time = "t"\ntime_unit = "ms"'), files(u=U, y=Y, t=stamps))


@pytest.mark.parametrize("rounded", [5, 6, 9])
def test_stamps_that_were_rounded_give_a_plain_rate(files, rounded):
    stamps = np.round(12.3 + np.arange(N) / 800, rounded)
    found = built(map_text('time = "t"\ntime_unit = "s"'), files(u=U, y=Y, t=stamps)).recording
    assert found.sample_rate_hz == 800
    np.testing.assert_array_equal(found.command.samples[:, 0], U)


def test_rows_that_a_logger_left_out_are_missing_samples(files):
    there = np.r_[0:100, 103:N]
    found = built(map_text('time = "t"\ntime_unit = "ms"'), files(u=U[there], y=Y[there], t=there * 1.0))
    assert len(found.recording) == N
    assert list(np.flatnonzero(np.isnan(found.recording.command.samples[:, 0]))) == [100, 101, 102]
    assert found.notes[:2] == ("fx: 3 of 400 samples are missing.", "ax: 3 of 400 samples are missing.")
    assert found.notes[2].startswith("Clock 'clock' has 1 gap (the widest 0.004 s): their samples are missing.")


def test_missing_samples_of_the_file_stay_missing(files):
    spoiled = Y.copy()
    spoiled[5] = np.nan
    found = built(map_text(), files(u=U, y=spoiled))
    assert list(np.flatnonzero(np.isnan(found.recording.response.samples[:, 0]))) == [5]
    assert found.notes == ("ax: 1 of 400 samples are missing.",)


UNEVEN = np.cumsum(np.random.default_rng(2).choice([0.7, 1.05], size=N))


def test_uneven_stamps_need_a_rate_and_a_way(files):
    path = files(u=U, y=Y, t=UNEVEN)
    clock = 'time = "t"\ntime_unit = "ms"'
    assert "state the rate_hz of the recording, and resample (held, band-limited, linear)" in refusal(
        map_text(clock), path
    )
    assert "Channel 'fx' has to be resampled to 500 Hz; state how: resample = \"held\"" in refusal(
        map_text(clock, top="rate_hz = 500\n"), path
    )


def test_what_was_resampled_is_reported_with_its_way_and_its_band(files):
    stairs = np.repeat(U[: N // 8], 8)
    wave = np.sin(2 * np.pi * 0.02 * UNEVEN)
    text = map_text(
        'time = "t"\ntime_unit = "ms"',
        'resample = "held"',
        'resample = "band-limited"',
        top="rate_hz = 2000\n",
    )
    found = built(text, files(u=stairs, y=wave, t=UNEVEN))
    times_ms = UNEVEN[0] + np.arange(len(found.recording)) / 2
    np.testing.assert_allclose(
        found.recording.response.samples[:, 0] / 9.80665, np.sin(2 * np.pi * 0.02 * times_ms), atol=1e-6
    )
    np.testing.assert_array_equal(
        found.recording.command.samples[:, 0], stairs[np.searchsorted(UNEVEN, times_ms + 1e-6, "right") - 1]
    )
    (held, smooth) = found.notes
    assert held.startswith("fx: resampled from uneven stamps (about ")
    assert held.endswith("to 2000 Hz, held.")
    assert "band-limited, flat to" in smooth


def test_a_stamp_that_jumps_a_million_seconds_is_refused_before_the_memory_is_full(files):
    t = np.arange(N) / 1000 + 1e6 * (np.arange(N) >= 100)
    said = refusal(map_text("time = 't'\ntime_unit = 's'"), files(t=t, u=U, y=Y))
    assert "t jumps from 0.099 to 1000000.1 s at sample 100" in said
    assert "1e+09 samples long" in said


def test_a_stamp_beyond_the_range_of_integers_is_refused_as_a_jump(files):
    t = np.arange(N) / 1000 + 1e18 * (np.arange(N) >= N - 1)
    assert f"t jumps from 0.398 to 1e+18 s at sample {N - 1}" in refusal(
        map_text("time = 't'\ntime_unit = 's'"), files(t=t, u=U, y=Y)
    )


def test_a_rate_that_makes_more_samples_than_anyone_can_hold_is_refused(files):
    text = map_text("rate_hz = 1000", 'resample = "held"', 'resample = "linear"', "rate_hz = 1e12\n")
    assert "0.399 s at 1e+12 Hz are 3.99e+11 samples, more than 1e+08" in refusal(text, files())


def test_samples_without_time_are_numbered_and_meta_says_so(files):
    found = built(map_text(clock="unknown = true"), files())
    assert (found.recording.sample_rate_hz, found.recording.meta["time"]) == (1.0, "unknown")
    assert found.notes == ("No time is known: samples are numbered, at 1 Hz.",)
    assert "time" not in built(map_text(), files()).recording.meta
