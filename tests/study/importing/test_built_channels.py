"""Channels and parts of a recording: units, computed values, conditions, files one after another."""

import numpy as np
import pytest

from tests.recording_maps import N, U, Y, built, map_text, refusal


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
        ("log(0)", "Computed channel 'x': log(0) holds infinite values."),
        ("loop", "Computed channel 'x': the definition of 'loop' refers to itself."),
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
    assert "no sample remains between 5 and 0.399 s" in refusal(map_text(end="[[part]]\nstart_s = 5.0\n"), files())


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


def test_a_channel_without_a_unit_keeps_its_numbers_and_reports_it(files):
    text = map_text().replace('unit = "N"', "").replace('unit = "g"', 'quantity = "position"')
    found = built(text, files())
    assert (found.recording.command.unit, found.recording.response.unit) == ("1", "1")
    assert (found.recording.command.quantity, found.recording.response.quantity) == ("1", "position")
    np.testing.assert_array_equal(found.recording.command.samples[:, 0], U)
    assert found.notes == (
        "No unit is stated for command 'fx', response 'ax': the numbers are kept as they are (unit 1).",
    )


def test_the_unit_of_a_computed_channel_is_reported(files):
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


TORQUE = '[[channel]]\nrole = "command"\nname = "tx"\nvalue = "200 * u"\nunit = "mN*m"\n[[segment]]\nkind = "noise"\n'


def test_amplitudes_of_commands_of_different_units_are_measured_in_si(files):
    found = built(map_text(end=TORQUE), files()).recording
    assert found.command.unit == ("N", "N m")
    assert found.segments[0].amplitude == pytest.approx(np.abs(U).max())
    assert "units of different size; leave amplitude out" in refusal(map_text(end=TORQUE + "amplitude = 2\n"), files())


@pytest.mark.parametrize("value", ["u[400:]", "empty"])
def test_a_channel_without_samples_is_named(files, value):
    text = map_text().replace('value = "u"', f'value = "{value}"')
    assert f"Channel 'fx': {value} holds no samples." in refusal(text, files(u=U, y=Y, empty=U[:0]))


def test_of_two_columns_that_differ_by_their_unit_none_is_taken_without_it(files):
    path = files(**{"u [N]": U, "u [mm]": Y, "y": Y})
    assert "Channel 'fx': there is no array 'u' in a.npz" in refusal(map_text(), path)
    found = built(map_text().replace('value = "u"', 'value = "u [N]"'), path).recording
    np.testing.assert_array_equal(found.command.samples[:, 0], U)


def test_a_unit_or_a_definition_that_the_file_contradicts_is_reported(files):
    path = files(**{"u [kN]": U, "y": Y, "t [ms]": np.arange(N)})
    found = built(map_text('time = "t"\ntime_unit = "s"', top='let = { y = "2 * y", gain = "3" }\n'), path)
    assert [note for note in found.notes if "rate" not in note] == [
        "[let] y is not used: the file has an array of this name, which has precedence.",
        "'t [ms]' states ms, but the map s; the map was followed.",
        "'u [kN]' states kN, but the map N; the map was followed.",
    ]
    text = map_text('time = "t"\ntime_unit = "ms"').replace('"N"', '"kN"')
    assert built(text, path).notes == ()


def test_a_segment_that_no_part_has_is_reported(files):
    end = '[[segment]]\nkind = "noise"\nfile = "rum.npz"\n[[segment]]\nkind = "rest"\nprefix = "a_"\n'
    assert built(map_text(end=end), files()).notes == (
        "segment[1] is not used: no part matches 'rum.npz'.", "segment[2] is not used: no part matches '* a_'.",
    )  # fmt: skip
    assert built(map_text(end=end, top="separate = true\n"), files()).notes == ()
