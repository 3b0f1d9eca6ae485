"""When no model is made, and what the text says would do."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.state_space.identify import identify
from equalizer.identification.state_space.refusals import IdentificationError
from equalizer.identification.state_space.settings import IdentificationSettings

SETTINGS = IdentificationSettings(order=6, draws=0, longer_horizons=(0,))


@pytest.fixture(scope="module")
def good(plants, measuring):
    return measuring.noisy(measuring.small_plant(plants), np.arange(4.6, 38, 0.2), 0.3, 1)


def refusal(response, settings=SETTINGS) -> str:
    with pytest.raises(IdentificationError) as refused:
        identify(response, settings)
    return str(refused.value)


def test_good_data_are_not_refused(good):
    assert identify(good, SETTINGS).lines == len(good.select_band(5.0, 35.0))


@pytest.mark.parametrize("told", [True, False])
def test_pure_noise_is_refused_whether_or_not_its_size_is_told(measuring, told):
    frequency = np.arange(4.6, 38, 0.1)
    real, imaginary = np.random.default_rng(2).standard_normal((2, len(frequency), 3, 3))
    noise = measuring.response_of(frequency, real + 1j * imaginary, 2.0 if told else np.nan)
    assert "contains only noise" in refusal(noise)


def test_no_response_at_all(good):
    assert "estimate one from a recorded sweep" in refusal(())


def test_a_band_that_was_never_excited(good):
    text = refusal(good, replace(SETTINGS, band_hz=(100.0, 200.0)))
    assert "no line was excited there" in text
    assert "record a sweep from 90.9 to 212 Hz" in text


def test_a_band_without_a_reliable_line_tells_the_estimates_own_reasons(good):
    bad = replace(good, reliable=np.zeros(len(good), bool), remarks=("below the spring's frequency",))
    assert "none of its lines is reliable (below the spring's frequency)" in refusal(bad)


def test_a_band_that_is_wider_than_the_sweep(good):
    text = refusal(good, replace(SETTINGS, band_hz=(5.0, 60.0)))
    assert "between 37.8 and 60 Hz no line can be used" in text
    assert "(5 to 37.8 Hz)" in text


def test_a_hole_in_the_band(good):
    hole = (good.frequency_hz < 12) | (good.frequency_hz > 18)
    text = refusal(good.select_lines(hole))
    assert "between 11.8 and 18 Hz no line can be used" in text
    assert "a band that the lines cover (5 to 11.8 Hz)" in text


def test_a_single_line(good):
    assert "no line can be used" in refusal(good.select_band(20.0, 20.1))


def test_an_input_that_no_experiment_drove(good):
    values = good.response.copy()
    values[:, :, 2] = np.nan
    text = refusal(replace(good, response=values))
    assert "the response to z is not determined" in text
    assert "record one sweep per input" in text


def test_an_output_that_no_line_has(good):
    silent = replace(good, response=good.response * np.array([1.0, 0.0, 1.0])[:, None])
    assert f"there is no signal from {good.output_channels[1]}, not even noise" in refusal(silent)


def test_an_order_beyond_what_the_lines_carry(plants, measuring):
    few = measuring.exact(measuring.small_plant(plants), np.arange(4.6, 38, 1.0), 1e-3)
    text = refusal(few, replace(SETTINGS, order=60))
    assert "order 60 has 369 unknowns" in text
    assert "choose a lower order, or record longer periods (now 1 s)" in text


def test_an_order_whose_subspace_cannot_be_told_apart(plants, measuring):
    many = measuring.exact(measuring.small_plant(plants), np.arange(4.6, 38, 0.2), 1e-3)
    text = refusal(many, replace(SETTINGS, order=200))
    assert "order 200 has more parameters than the 167 lines in the band can determine" in text
    assert "choose a lower order, such as 100" in text


def test_a_band_above_half_the_rate(good):
    assert "nothing is known from 500 Hz on" in refusal(good, replace(SETTINGS, band_hz=(5.0, 600.0)))


def test_estimates_of_different_things(good):
    assert "differ in output_channels" in refusal((good, replace(good, output_channels=("a", "b", "c"))))


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"band_hz": (35.0, 5.0)}, "band_hz is 35 to 5"),
        ({"order": 25}, "order is 25; it must be even"),
        ({"longest_decay_s": 0.0}, "longest_decay_s is 0"),
        ({"longer_horizons": ()}, "longer_horizons is ()"),
        ({"draws": -1}, "draws -1"),
    ],
)
def test_settings_that_mean_nothing(changes, text):
    with pytest.raises(ValueError) as refused:
        replace(SETTINGS, **changes)
    assert text in str(refused.value)
