"""Two loggers with clocks of their own become one recording."""

import numpy as np
import pytest
from scipy import signal as sg

from tests.recording_maps import built, refusal

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
        ('align = "u[:0]"\nalign_to = "y"', "Clock 'drive': u[:0] holds no samples"),
        ('align = "speeed"\nalign_to = "y"', "There is no array 'speeed' in drive.npz; did you mean 'speed'"),
    ],
)
def test_clocks_that_cannot_be_aligned_are_named(loggers, offset, sentence):
    assert sentence in refusal(TWO_LOGGERS.format(offset=offset), *loggers)


@pytest.mark.parametrize("missing", [slice(600, 602), slice(601, 606)])
def test_a_trigger_edge_with_missing_samples_is_refused(loggers, files, missing):
    daq = dict(np.load(loggers[0]))
    daq["trigger"][missing] = np.nan  # the edge is near sample 601
    offset = 'trigger = "sync"\ntrigger_level = 0.025\nreference_trigger = "trigger"\nreference_level = 0.0005'
    said = refusal(TWO_LOGGERS.format(offset=offset), files("daq.npz", **daq), loggers[1])
    assert "Clock 'daq': trigger passes the trigger level of 0.0005 where samples are missing, between" in said
    assert "state offset_s in place of the trigger" in said


def test_a_trigger_may_lack_samples_away_from_its_edge(loggers, files):
    daq = dict(np.load(loggers[0]))
    daq["trigger"][[300, 900]] = np.nan
    offset = 'trigger = "sync"\ntrigger_level = 0.025\nreference_trigger = "trigger"\nreference_level = 0.005'
    recording = built(TWO_LOGGERS.format(offset=offset), files("daq.npz", **daq), loggers[1]).recording
    assert recording.meta["parts"][0]["clock_offsets_s"]["drive"] == pytest.approx(OFFSET_S, abs=1e-6)


def test_a_logger_whose_file_is_not_given_is_named(loggers):
    assert "Clock 'drive' is in the file 'drive.npz', which fits 0 of daq.npz" in refusal(
        TWO_LOGGERS.format(offset=""), loggers[0]
    )


def test_a_file_of_no_logger_is_named_with_what_the_map_may_add(loggers, files):
    assert "No clock of the map takes the file spare.npz; leave it out, or add a [[clock]] with it" in refusal(
        TWO_LOGGERS.format(offset=""), *loggers, files("spare.npz", y=np.zeros(9))
    )
