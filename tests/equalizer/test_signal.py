import numpy as np
import pandas as pd
import pytest

from equalizer.signals.signal import Signal


def signal(quantity="acceleration", unit="m/s^2", channels=("ax", "ay")):
    return Signal(np.arange(6.0).reshape(3, 2), 1000.0, quantity, unit, channels)


def test_one_word_serves_all_channels():
    assert signal().quantities == ("acceleration", "acceleration")
    assert signal().units == ("m/s^2", "m/s^2")


def test_equal_words_per_channel_are_folded_into_one():
    assert signal(quantity=("force", "force"), unit=("N", "N")).quantity == "force"


def test_channels_may_differ_in_quantity_and_unit():
    mixed = signal(quantity=("position", "angle"), unit=("m", "rad"))
    assert mixed.units == ("m", "rad")
    assert mixed.select_samples(0, 1).quantity == ("position", "angle")


def test_a_list_of_the_wrong_length_is_refused():
    with pytest.raises(ValueError, match="3 entries of unit for 2 channels; give one for all, or one per channel"):
        signal(unit=("m", "m", "rad"))


def test_samples_cannot_be_changed_and_do_not_follow_their_source():
    source = np.zeros((3, 2))
    made = Signal(source, 1000.0, "force", "N", ("fx", "fy"))
    source[0, 0] = 1.0
    assert made.samples[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        made.samples[0, 0] = 1.0


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan, np.inf])
def test_a_rate_that_is_no_rate_is_refused(rate):
    with pytest.raises(ValueError, match="sample_rate_hz must be a positive number"):
        Signal(np.zeros((3, 1)), rate, "force", "N", ("fx",))


def test_picked_channels_keep_their_words_in_the_order_asked_for():
    signal = Signal(np.arange(6.0).reshape(2, 3), 10.0, ("force", "angle", "force"), ("N", "rad", "N"), ("a", "b", "c"))
    mixed, plain = signal.select_channels((1, 0)), signal.select_channels((2, 0))
    assert (mixed.channels, mixed.quantity, mixed.unit) == (("b", "a"), ("angle", "force"), ("rad", "N"))
    assert mixed.samples.tolist() == [[1.0, 0.0], [4.0, 3.0]]
    assert (plain.quantity, plain.unit) == ("force", "N")


@pytest.mark.parametrize("channels", [["fx"], "fx"])
def test_channel_names_become_a_tuple(channels):
    assert Signal(np.zeros((3, 1)), 1000.0, "force", "N", channels).channels == ("fx",)


def test_a_unit_that_is_not_stated_is_refused_by_name():
    with pytest.raises(ValueError, match="0 entries of unit for 2 channels"):
        signal(unit=None)


@pytest.mark.parametrize("unit", [["N", "N m"], np.array(["N", "N m"]), pd.Index(["N", "N m"])])
def test_units_may_be_any_sequence(unit):
    assert signal(unit=unit).units == ("N", "N m")


def test_a_masked_sample_is_missing():
    masked = np.ma.array([[1], [2], [3]], mask=[[0], [1], [0]])
    assert np.isnan(Signal(masked, 1000.0, "force", "N", ("fx",)).samples).tolist() == [[False], [True], [False]]


def hide(source):
    return np.lib.stride_tricks.as_strided(source, writeable=False)


@pytest.mark.parametrize("view", [hide, lambda source: pd.DataFrame(source, copy=False)])
def test_samples_do_not_follow_the_memory_that_they_were_given_in(view):
    """A view that cannot be written itself may still change with the array that it shows."""
    source = np.zeros((3, 1))
    made = Signal(view(source), 1000.0, "force", "N", ("fx",))
    source[0] = 1.0
    assert made.samples[0, 0] == 0.0


def test_samples_that_cannot_change_are_shared():
    made = signal()
    assert np.shares_memory(made.select_samples(1, 3).samples, made.samples)
