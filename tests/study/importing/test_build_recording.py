"""Files and maps to recordings: what comes out is compared with what was put in."""

from pathlib import Path

import numpy as np
import pytest
from scipy import signal as sg

from equalizer.signals.recording import Hold
from study.importing.build_recording import build_recording
from study.importing.map_format.map_errors import ImportRefusedError
from study.importing.map_format.map_toml import parse_map

N = 400
U = np.random.default_rng(1).standard_normal(N)
Y = np.cumsum(U) / 50

ONE = """
device = "rig"
[[clock]]
{clock}
[[channel]]
role = "command"
name = "fx"
value = "u"
unit = "N"
{command}
[[channel]]
role = "response"
name = "ax"
value = "y"
unit = "g"
{response}
"""


def map_text(clock="rate_hz = 1000", command="", response="", top="", end=""):
    return top + ONE.format(clock=clock, command=command, response=response) + end


@pytest.fixture
def files(tmp_path):
    def write(name="a.npz", **arrays):
        np.savez(tmp_path / name, **(arrays or {"u": U, "y": Y}))
        return tmp_path / name

    return write


def built(text, *paths):
    return build_recording(parse_map(text, Path("m.toml")), paths)


def refusal(text, *paths):
    with pytest.raises(ImportRefusedError) as refused:
        built(text, *paths)
    assert refused.value.saved == "Nothing was written."
    assert refused.value.title.endswith("cannot be imported")
    return refused.value.happened


def test_samples_stay_as_they_are_and_units_become_si(files):
    found = built(map_text(), files()).recording
    np.testing.assert_array_equal(found.command.samples[:, 0], U)
    np.testing.assert_allclose(found.response.samples[:, 0], 9.80665 * Y)
    assert (found.device, found.sample_rate_hz, found.hold) == ("rig", 1000.0, Hold.ZERO_ORDER)
    assert (found.command.quantity, found.response.unit, found.response.channels) == ("force", "m/s^2", ("ax",))


def test_nothing_is_said_where_nothing_was_done(files):
    assert built(map_text(), files()).notes == ()


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"unit": "Newton"}, "Channel 'fx': 'Newton' is not a unit known here"),
        ({"quantity": "voltage"}, "Channel 'fx': the quantity 'voltage' cannot be in N; it is in V"),
        (
            {"value": "uu"},
            "Channel 'fx': there is no array 'uu' in a.npz; did you mean 'u'; there are u (400), y",
        ),
        ({"value": "u[:10]"}, "Channel 'ax': y has 400 samples, but clock 'clock' has 10."),
        ({"value": "u[0:2] + y"}, "shapes (2,) and (400,) do not go together"),
        ({"value": "1 / (u - u)"}, "Channel 'fx': 1 / (u - u) holds infinite values; a missing sample is NaN"),
        (
            {"value": "log(0) * (u + 3)"},
            "Channel 'fx': log(0) * (u + 3) holds infinite values; a missing sample is NaN",
        ),
    ],
)
def test_a_channel_that_is_not_understood_is_named(files, change, sentence):
    text = map_text()
    if "unit" in change:
        text = text.replace('unit = "N"', f'unit = "{change["unit"]}"')
    if "quantity" in change:
        text = text.replace('unit = "N"', f'unit = "N"\nquantity = "{change["quantity"]}"')
    if "value" in change:
        text = text.replace('value = "u"', f'value = "{change["value"]}"')
    assert sentence in refusal(text, files())


def test_a_table_needs_one_of_its_rows(files):
    path = files(u=U, y=np.stack([Y, Y]))
    assert "Channel 'ax': y has the shape (2, 400); take one row or column, as in y[0]" in refusal(map_text(), path)


@pytest.mark.parametrize(
    ("array", "what"), [(np.array(["a"] * N), "text or objects"), (np.ones(N) * 1j, "complex numbers")]
)
def test_an_array_that_is_no_numbers_is_named(files, array, what):
    assert f"the array 'u' in a.npz holds {what}, not real numbers" in refusal(map_text(), files(u=array, y=Y))


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda t: t.__setitem__(7, np.nan), "Clock 'clock': t is no number at sample 7; time is never missing."),
        (lambda t: t.__setitem__(7, t[5]), "Clock 'clock': t runs backwards at sample 7, from 6 to 5 s."),
        (lambda t: t.__setitem__(7, t[6]), "Clock 'clock': t stands still at sample 7, at 6 s."),
    ],
)
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
        ('rate = "u"', "'u' has the shape (400,); it must be one number"),
        ('rate = "-fs"', "Clock 'clock': its rate, -fs, is -1000; it must be above 0."),
    ],
)
def test_a_clock_that_is_not_understood_is_named(files, clock, sentence):
    assert sentence in refusal(map_text(clock), files(u=U, y=Y, t=np.arange(N) / 1000, fs=1000.0))


def test_stamps_that_were_rounded_away_are_uneven(files):
    stamps = np.round(12.3 + np.arange(N) / 800, 3)
    text = map_text('time = "t"\ntime_unit = "s"')
    assert "has uneven stamps (steps of 1 to 2 ms)" in refusal(text, files(u=U, y=Y, t=stamps))


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
    assert found.notes == ("fx: 3 of 400 samples are missing.", "ax: 3 of 400 samples are missing.")


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


def test_what_was_resampled_is_said_with_its_way_and_its_band(files):
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


def test_a_computed_channel_is_computed_on_the_recordings_grid(files):
    text = map_text(
        end="""
[[computed]]
role = "position"
name = "x"
value = "1000 * integral(fx) + gain * sin(clock_s)"
unit = "mm"
""",
        top='let = { gain = "2 * g" }\n',
    )
    found = built(text, files(u=U, y=Y, g=3.0)).recording
    times_s = np.arange(N) / 1000
    truth = np.r_[0, np.cumsum((U[1:] + U[:-1]) / 2000)] * 1000 + 6 * np.sin(times_s)
    assert found.position is not None
    np.testing.assert_allclose(found.position.samples[:, 0], truth / 1000, atol=1e-12)


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        ("nothing + fx", "Computed channel 'x': there is no array 'nothing'"),
        ("fx[:7]", "Computed channel 'x': fx[:7] has the shape (7,), but the recording has 400 samples."),
        ("1e9 ** (50 + abs(fx))", "Computed channel 'x': 1e9 ** (50 + abs(fx)) holds infinite values."),
        ("loop", "Computed channel 'x': the definition of 'loop' needs itself."),
        ("integral(fx[:7])", "7 samples are not the recording's 400"),
    ],
)
def test_a_computed_channel_that_is_not_understood_is_named(files, value, sentence):
    end = f'[[computed]]\nrole = "position"\nname = "x"\nvalue = "{value}"\nunit = "m"\n'
    assert sentence in refusal(map_text(end=end, top='let = { loop = "loop + 1" }\n'), files())


def test_time_is_not_known_before_there_is_a_grid(files):
    text = map_text().replace('value = "u"', 'value = "u * clock_s"')
    assert "clock_s is known in [[computed]] channels only" in refusal(text, files())
    assert "there is no clock in this place yet" in refusal(map_text('rate = "mean(derivative(u))"'), files())


def test_files_become_parts_one_after_another(files):
    paths = (files("b.npz", u=U, y=Y), files("a.npz", u=2 * U, y=Y))
    found = built(map_text(end='[[segment]]\nkind = "noise"\nperiod = 100\n'), *paths).recording
    np.testing.assert_array_equal(found.command.samples[:, 0], np.r_[U, 2 * U])
    assert [(s.start, s.stop, s.period) for s in found.segments] == [(0, N, 100), (N, 2 * N, 100)]
    np.testing.assert_allclose([s.amplitude for s in found.segments], [np.abs(U).max(), 2 * np.abs(U).max()])
    assert [(part["file"], part["start"], part["stop"]) for part in found.meta["parts"]] == [
        ("b.npz", 0, N), ("a.npz", N, 2 * N),
    ]  # fmt: skip


def test_parts_of_one_file_by_their_prefix_with_numbers_of_their_own(files):
    path = files(one_u=U, one_y=Y, one_k=1.0, two_u=2 * U, two_y=Y, two_k=2.0)
    end = '[[part]]\nprefix = "two_"\nstart_s = 0.1\nstop_s = 0.2\n[[part]]\nprefix = "one_"\n'
    found = built(map_text(end=end, top='numbers = { gain = "10 * k" }\n'), path).recording
    np.testing.assert_array_equal(found.command.samples[:, 0], np.r_[2 * U[100:200], U])
    assert [part["gain"] for part in found.meta["parts"]] == [20.0, 10.0]
    assert "No array of a.npz begins with 'three_'" in refusal(map_text(end='[[part]]\nprefix = "three_"\n'), path)


def test_a_part_that_is_empty_is_refused(files):
    assert "nothing is left between 5 and 0.399 s" in refusal(map_text(end="[[part]]\nstart_s = 5.0\n"), files())


def test_parts_of_different_rates_are_refused(files):
    paths = files("a.npz", u=U, y=Y, fs=100.0), files("b.npz", u=U, y=Y, fs=200.0)
    assert refusal(map_text('rate = "fs"'), *paths) == (
        "B.npz is at 200 Hz, but a.npz at 100 Hz; state the rate_hz of the recording, and resample of each channel."
    )


def test_files_that_a_map_does_not_know_or_misses_are_named(files):
    one, two = files("a.npz"), files("b.npz")
    assert "b.npz is none of the files of this map (a*)" in refusal(map_text(top='files = ["a*"]\n'), one, two).lower()
    end = '[[part]]\nfile = "a.npz"\n'
    assert "No part of the map takes the file b.npz" in refusal(map_text(end=end), one, two)
    assert "No file given fits the part 'a.npz'; given are b.npz" in refusal(map_text(end=end), two)
    assert "The map makes one recording of each file; import a.npz, b.npz one by one" in refusal(
        map_text(top="separate = true\n"), one, two
    )


TWO_LOGGERS = """
device = "rig"
hold = "band-limited"
[[clock]]
name = "daq"
file = "daq.npz"
rate_hz = 2000
[[clock]]
name = "drive"
file = "drive.npz"
rate_hz = 1500
{offset}
[[channel]]
role = "response"
name = "ax"
value = "y"
unit = "m/s^2"
[[channel]]
role = "command"
name = "fx"
clock = "drive"
value = "u"
unit = "N"
resample = "band-limited"
"""
OFFSET_S = 0.01234
FINE_HZ = 60_000.0


@pytest.fixture(scope="module")
def motion():
    noise = np.random.default_rng(3).standard_normal(int(2 * FINE_HZ))
    fine = sg.sosfiltfilt(sg.butter(4, 50.0, fs=FINE_HZ, output="sos"), noise)
    return lambda times_s: np.interp(times_s, np.arange(len(fine)) / FINE_HZ, fine / fine.std())


@pytest.fixture
def loggers(files, motion):
    """Both see the same motion; the drive's logger began 12.34 ms after the other, and both saw a trigger at 0.3 s."""
    daq_s, drive_s = np.arange(0, 1.5, 1 / 2000), np.arange(0, 1.4, 1 / 1500) + OFFSET_S
    return (
        files("daq.npz", y=motion(daq_s), trigger=np.clip(daq_s - 0.3, 0, 0.01)),
        files("drive.npz", u=motion(drive_s), speed=2 * motion(drive_s), sync=5 * np.clip(drive_s - 0.3, 0, 0.01)),
    )


@pytest.mark.parametrize(
    ("offset", "said", "within_s"),
    [
        ("offset_s = 0.01234", "as the map states", 1e-12),
        (
            'align = "speed"\nalign_to = "y"\nalign_within_s = 0.1',
            "found by correlating speed with y (0.998 there)",
            2e-5,
        ),
        (
            'trigger = "sync"\ntrigger_level = 0.025\nreference_trigger = "trigger"\nreference_level = 0.005',
            "from the trigger in sync and trigger",
            1e-6,
        ),
    ],
)
def test_an_invented_offset_between_clocks_is_taken_out_and_said(loggers, offset, said, within_s):
    found = built(TWO_LOGGERS.format(offset=offset), *loggers)
    recording = found.recording
    assert recording.meta["parts"][0]["clock_offsets_s"]["drive"] == pytest.approx(OFFSET_S, abs=within_s)
    assert found.notes[0].startswith("Clock 'drive' is moved by 12.3")
    assert " ms to that of 'daq', " in found.notes[0]
    assert said in found.notes[0]
    assert recording.sample_rate_hz == 2000
    difference = recording.command.samples - recording.response.samples
    assert np.max(np.abs(difference[20:-20])) < 0.01


def test_without_the_offset_the_two_do_not_agree(loggers):
    recording = built(TWO_LOGGERS.format(offset=""), *loggers).recording
    assert np.std(recording.command.samples - recording.response.samples) > 0.5


@pytest.mark.parametrize(
    ("offset", "sentence"),
    [
        ('align = "u * 0 + 1"\nalign_to = "y"', "Clock 'drive' cannot be aligned: the two signals agree nowhere"),
        ('trigger = "sync"\ntrigger_level = 9.0\nreference_trigger = "y"', "sync never passes the trigger level of 9"),
        ('align = "u[0]"\nalign_to = "y"', "Clock 'drive': u[0] has the shape (), not one row"),
        ('align = "speeed"\nalign_to = "y"', "There is no array 'speeed' in drive.npz; did you mean 'speed'"),
    ],
)
def test_clocks_that_cannot_be_aligned_are_named(loggers, offset, sentence):
    assert sentence in refusal(TWO_LOGGERS.format(offset=offset), *loggers)


def test_a_logger_whose_file_is_not_given_is_named(loggers):
    assert "Clock 'drive' is in the file 'drive.npz', which fits 0 of daq.npz" in refusal(
        TWO_LOGGERS.format(offset=""), loggers[0]
    )


def test_progress_grows_to_the_whole(files):
    seen: list[float] = []
    build_recording(parse_map(map_text(), Path("m.toml")), [files("a.npz"), files("b.npz")], seen.append)
    assert seen == [0.25, 0.5, 0.75, 1.0]


def test_a_stamp_that_jumps_a_million_seconds_is_refused_before_the_memory_is_full(files):
    t = np.arange(N) / 1000 + 1e6 * (np.arange(N) >= 100)
    said = refusal(map_text("time = 't'\ntime_unit = 's'"), files(t=t, u=U, y=Y))
    assert "t jumps from 0.099 to 1000000.1 s at sample 100" in said
    assert "1e+09 samples long" in said


def test_a_rate_that_makes_more_samples_than_anyone_can_hold_is_refused(files):
    text = map_text("rate_hz = 1000", 'resample = "held"', 'resample = "linear"', "rate_hz = 1e12\n")
    assert "0.399 s at 1e+12 Hz are 3.99e+11 samples, more than 1e+08" in refusal(text, files())


def test_a_channel_without_a_unit_keeps_its_numbers_and_says_so(files):
    text = map_text().replace('unit = "N"', "").replace('unit = "g"', 'quantity = "position"')
    found = built(text, files())
    assert (found.recording.command.unit, found.recording.response.unit) == ("1", "1")
    assert (found.recording.command.quantity, found.recording.response.quantity) == ("1", "position")
    np.testing.assert_array_equal(found.recording.command.samples[:, 0], U)
    assert found.notes == (
        "No unit is stated for command 'fx', response 'ax': the numbers are kept as they are (unit 1).",
    )


def test_the_unit_of_a_computed_channel_is_said(files):
    end = '[[computed]]\nrole = "position"\nname = "x"\nvalue = "integral(integral(ax))"\nunit = "in"\n'
    found = built(map_text(end=end), files())
    assert found.notes == ("Computed: position 'x' = integral(integral(ax)), in in.",)
    assert found.recording.position.unit == "m"


def test_a_condition_is_read_in_si_and_kept(files):
    end = '[[channel]]\nrole = "condition"\nname = "motor"\nvalue = "warm"\nunit = "degC"\n'
    found = built(map_text(end=end), files(u=U, y=Y, warm=np.full(N, 20.0))).recording
    assert (found.condition.quantity, found.condition.unit, found.condition.channels) == (
        "temperature",
        "K",
        ("motor",),
    )
    np.testing.assert_allclose(found.condition.samples, 293.15)


def test_samples_without_time_are_numbered_and_meta_says_so(files):
    found = built(map_text(clock="unknown = true"), files())
    assert (found.recording.sample_rate_hz, found.recording.meta["time"]) == (1.0, "unknown")
    assert found.notes == ("No time is known: samples are numbered, at 1 Hz.",)
    assert "time" not in built(map_text(), files()).recording.meta
