from pathlib import Path

import pytest

from study.importing.map_format.import_map import ImportMap
from study.importing.map_format.map_toml import is_map, parse_map
from study.store.disk.file_errors import UnusableFileError

SOUND = """
device = "rig"

[[clock]]
rate_hz = 1000

[[channel]]
role = "command"
name = "fx"
value = "u"
unit = "N"

[[channel]]
role = "response"
name = "ax"
value = "y"
unit = "m/s^2"
"""


def problems(text):
    with pytest.raises(UnusableFileError) as refused:
        parse_map(text, Path("m.toml"))
    assert refused.value.title == "m.toml is not a usable import map"
    return refused.value.problems


def test_a_sound_map_is_read():
    found = parse_map(SOUND, Path("m.toml"))
    assert isinstance(found, ImportMap)
    assert [channel.name for channel in found.channel] == ["fx", "ax"]
    assert found.files == ("*",)


def test_a_map_is_known_by_its_channels():
    assert is_map({"channel": [{}]})
    assert not is_map({"model": {}})


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('value = "u"', 'valeu = "u"', "channel[1].valeu is no key of a map; did you mean value"),
        ('device = "rig"', 'device = "rig"\nzzz = 1', "zzz is no key of a map; keys here are channel, device"),
        ('name = "fx"\n', "", "channel[1].name is missing; it is text in quotes"),
        ('device = "rig"', 'device = ""', 'device is ""; it must be text in quotes, 1 to 200 characters long'),
        ('role = "command"', 'role = "input"', 'channel[1].role is "input"; it must be "command", "response"'),
        ("rate_hz = 1000", 'rate_hz = "fast"', 'clock[1].rate_hz is "fast"; it must be a number from 0, in hertz'),
        ('device = "rig"', 'device = "rig"\nlet = 3', "let is 3; it must be a table"),
        ('device = "rig"', 'device = "rig"\nlet = { a = 3 }', "let.a is 3; it must be text in quotes"),
        (
            'device = "rig"',
            'device = "rig"\nmeta = { a = nan }',
            "meta holds a number that is not finite; leave it out",
        ),
        ('device = "rig"', "device = ", "it is not TOML"),
        ('name = "ax"', 'name = "ax"\nclock = "daq"', "channel 'ax' is on the clock 'daq', but there are clock"),
        ("rate_hz = 1000", "", "clock 'clock' has no rate: give its rate_hz, its rate as an expression, or its time"),
        (
            "rate_hz = 1000",
            'rate_hz = 1000\nrate = "fs"',
            "states its time more than once; state one of time, rate_hz, rate",
        ),
        ("rate_hz = 1000", 'time = "t"', "clock 'clock' has no time_unit; stamps need their unit"),
        ("rate_hz = 1000", "rate_hz = 1000\noffset_s = 1.0", "is the first, to which the others are aligned"),
        ('role = "command"', 'role = "response"', "there is no channel with the role 'command'"),
        ('role = "response"', 'role = "helper"', "there is no channel with the role 'response'"),
        (
            'name = "fx"',
            'name = "fx"\nresample = "band-limited"',
            "command 'fx' is resampled band-limited, but the recording's hold is zero-order",
        ),
    ],
)
def test_what_is_wrong_with_a_map_is_reported_by_key(old, new, problem):
    assert any(problem in found for found in problems(SOUND.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("more", "problem"),
    [
        ('[[channel]]\nrole = "command"\nname = "fx"\nvalue = "u"\nunit = "N"', "command 'fx' is defined twice"),
        ("[[clock]]\nrate_hz = 3", "clock 'clock' is defined twice"),
        ('[[clock]]\nname = "b"\nrate_hz = 3\nalign = "y"', "clock 'b' needs both align and align_to, or neither"),
        ('[[clock]]\nname = "b"\nrate_hz = 3\ntrigger = "y"', "clock 'b' needs both trigger and reference_trigger"),
        (
            '[[clock]]\nname = "b"\nrate_hz = 3\nalign = "y"\nalign_to = "u"\ntrigger = "y"\nreference_trigger = "u"',
            "clock 'b' is aligned twice, by a trigger and by correlation; choose one of them",
        ),
        (
            '[[clock]]\nname = "b"\nrate_hz = 3\nfile = "b.csv"\n[[part]]\nfile = "a.csv"',
            "clocks with `file` put files side by side, [[part]] one after another; a map does one or the other",
        ),
        ('[[segment]]\nkind = "noise"\nsplit = { fitt = 1.0 }', "segment[1].split names fitt; roles are fit, test"),
        ('[[segment]]\nkind = "noise"\nsplit = { fit = 0.5 }', "segment[1].split must have shares that sum to 1"),
        (
            '[[segment]]\nkind = "noise"\nevery = 9\nsplit = { fit = 1.5, test = -0.5 }',
            "segment[1].split must have shares that sum to 1, none below 0",
        ),
        ('[[segment]]\nkind = "noise"\nstart = 1\nstart_s = 1.0', "segment[1] is stated in samples and in seconds"),
        ('[csv]\ndelimiter = "::"', "csv.delimiter is '::'; it must be a single character"),
        ('[meta]\ntitle = "a"', "meta.title is set by the import; write it at the top of the map"),
        ("[meta]\nparts = 3", "meta.parts is set by the import; give it another name"),
        ('[numbers]\nstart = "u[0]"', "numbers.start is set by the import; give it another name"),
        ('[[segment]]\nkind = "loud"', 'segment[1].kind is "loud"; it must be "multisine", "sweep"'),
    ],
)
def test_what_contradicts_itself_is_reported(more, problem):
    assert any(problem in found for found in problems(f"{SOUND}\n{more}\n"))
