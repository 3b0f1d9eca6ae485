import pytest

from equalizer.identification.frequency_response.frequency_bands import compute_frequency_bands


def edges(*arguments):
    return [(band.name, band.low_hz, band.high_hz) for band in compute_frequency_bands(*arguments)]


def test_all_axes_are_equalized_from_the_onset_of_coupling_to_the_limit_of_direction():
    assert edges(10.5) == [("low", 1.0, 10.5), ("middle", 10.5, 35.0), ("high", 35.0, 500.0)]


def test_the_study_sets_the_limit():
    assert edges(10.5, 60.0)[1] == ("middle", 10.5, 60.0)


@pytest.mark.parametrize("onset_hz", [35.0, 80.0, None])
def test_no_band_needs_all_axes_where_coupling_begins_above_the_limit(onset_hz):
    assert edges(onset_hz) == [("low", 1.0, 35.0), ("high", 35.0, 500.0)]


def test_a_device_that_couples_everywhere_has_no_low_band():
    assert edges(0.5) == [("middle", 1.0, 35.0), ("high", 35.0, 500.0)]


def test_bands_follow_each_other_and_say_why():
    bands = compute_frequency_bands(10.5)
    assert [band.high_hz for band in bands[:-1]] == [band.low_hz for band in bands[1:]]
    assert all(band.method and band.reason.endswith(".") for band in bands)


def test_a_limit_outside_the_range_is_refused():
    with pytest.raises(ValueError, match="direction_limit_hz is 600; it must lie between 1 and 500 Hz"):
        compute_frequency_bands(10.0, 600.0)
