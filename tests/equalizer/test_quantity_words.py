"""Words of a channel's name, and the quantity that they say."""

import unicodedata

import pytest

from equalizer.signals.quantity_words import QUANTITY_WORDS, detect_quantity, split_into_words


@pytest.mark.parametrize(
    ("name", "words"),
    [("Yaw_Rate", ["yaw", "rate"]), ("motorSpeed2", ["motor", "speed"]), ("ANGULO", ["angulo"]),
     ("load angle (raw)", ["load", "angle", "raw"]), ("POSICIÓN_eje", ["posición", "eje"]), ("x1", ["x"]), ("", [])],
)  # fmt: skip
def test_a_name_is_split_at_signs_digits_and_capitals(name, words):
    assert split_into_words(name) == words


@pytest.mark.parametrize(
    ("name", "quantity"),
    [("load angle", "angle"), ("angular_velocity", "velocity"), ("yaw rate", "velocity"), ("frame rate", ""),
     ("rate_of_angle", ""), ("theta_dot", ""), ("dThetaDot", ""), ("gyro_pitch", ""), ("acc pedal", ""),
     ("travel time", ""), ("gyro yaw rate", ""),
     ("force rate", ""), ("Lage", "position"), ("déplacement", "position"), ("Kraft", "force"),
     ("corriente", "current"), ("Spannung", "voltage"), ("tensión", "voltage"), ("tension", ""), ("displaced", ""),
     ("knob", "")],
)  # fmt: skip
def test_the_last_word_that_is_a_quantity_says_it(name, quantity):
    assert detect_quantity(name) == quantity


def test_an_accent_that_is_written_as_a_sign_of_its_own_is_understood():
    assert detect_quantity(unicodedata.normalize("NFD", "ángulo")) == "angle"


def test_each_word_is_found_and_stands_for_a_single_quantity():
    every = [(word, quantity) for quantity, words in QUANTITY_WORDS.items() for word in words.split()]
    assert len({word for word, _ in every}) == len(every)
    assert all(detect_quantity(word) == quantity for word, quantity in every)
