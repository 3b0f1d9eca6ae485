"""A map and files become a recording: samples stay, units become SI, what is wrong is named."""

from pathlib import Path

import numpy as np
import pytest

from equalizer.signals.recording import Hold
from study.importing.build_recording import build_recording
from study.importing.map_format.map_toml import parse_map
from tests.recording_maps import N, U, Y, built, map_text, refusal


def test_samples_stay_as_they_are_and_units_become_si(files):
    found = built(map_text(), files()).recording
    np.testing.assert_array_equal(found.command.samples[:, 0], U)
    np.testing.assert_allclose(found.response.samples[:, 0], 9.80665 * Y)
    assert (found.device, found.sample_rate_hz, found.hold) == ("rig", 1000.0, Hold.ZERO_ORDER)
    assert (found.command.quantity, found.response.unit, found.response.channels) == ("force", "m/s^2", ("ax",))


def test_nothing_is_reported_where_nothing_was_done(files):
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
        ({"value": "u[0:2] + y"}, "shapes (2,) and (400,) cannot be combined"),
        ({"value": "1 / (u - u)"}, "Channel 'fx': 1 / (u - u) holds infinite values; a missing sample is NaN"),
        ({"value": "1 / 0"}, "Channel 'fx': 1 / 0 holds infinite values; a missing sample is NaN"),
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


def test_progress_grows_to_the_whole(files):
    seen: list[float] = []
    build_recording(parse_map(map_text(), Path("m.toml")), [files("a.npz"), files("b.npz")], seen.append)
    assert seen == [0.25, 0.5, 0.75, 1.0]


def test_a_channel_that_is_evaluated_for_the_number_of_samples_is_named(files):
    """The single number before it is repeated as often as the other channel has samples."""
    text = map_text().replace('value = "u"', 'value = "0"').replace('value = "y"', 'value = "yy"')
    assert "Channel 'ax': there is no array 'yy'" in refusal(text, files())


@pytest.mark.parametrize("name", ["u [N]", "u (N)", "u [m/s^2]"])
def test_a_name_with_its_unit_that_is_not_in_the_file_is_named_as_a_whole(files, name):
    text = map_text().replace('value = "u"', f'value = "{name}"')
    sentence = f"Channel 'fx': there is no array '{name}' in a.npz"
    assert sentence in refusal(text, files(**{"u [kN]": U, "y": Y}))
    with_index = built(map_text().replace('value = "u"', 'value = "u[m]"'), files(u=np.stack([U, Y]), y=Y, m=1.0))
    np.testing.assert_array_equal(with_index.recording.command.samples[:, 0], Y)


@pytest.mark.parametrize("value", ["volts - 2 * mean(volts)", "u[0] + 2 * (volts)", "2 * u[Sec]"])
def test_an_array_that_is_named_as_a_unit_may_stand_in_brackets_at_the_end(files, value):
    found = built(
        map_text().replace('value = "u"', f'value = "{value}"'),
        files(u=np.stack([U, Y]), y=Y, volts=U, Sec=1.0),
    ).recording.command.samples[:, 0]
    wanted = {"v": U - 2 * U.mean(), "u": 3 * U, "2": 2 * Y}[value[0]]
    np.testing.assert_allclose(found, wanted)


def test_what_all_parts_contradict_is_reported_once(files):
    paths = [files(name, **{"u [kN]": U, "y": Y}) for name in ("a.npz", "b.npz")]
    notes = build_recording(parse_map(map_text(), Path("m.toml")), paths).notes
    assert [note for note in notes if "kN" in note] == ["'u [kN]' states kN, but the map N; the map was followed."]
