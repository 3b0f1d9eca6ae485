"""What a message about a contradiction allows is taken, and it blames nothing that is not there."""

import pytest

from protocols.document.loading import ProtocolError, load_protocol


def test_the_time_to_keep_that_is_allowed_is_taken(threshold_text):
    """A period such as 1 / 0.7 s, rounded to the digits of the message, would be too short again."""
    slow = threshold_text.replace("[5.0, 15.0", "[0.7, 15.0")
    with pytest.raises(ProtocolError, match=r"measurement.keep_s is 1.0 s.* Allowed: at least 1.4286 s"):
        load_protocol(slow, "mine.toml")
    assert load_protocol(slow.replace("keep_s = 1.0", "keep_s = 1.4286"), "mine.toml").kind == "study"


def test_a_first_level_of_detection_is_refused_without_a_word_of_roving(small_text):
    low = small_text.replace("cap_n = 3.0\nup", "cap_n = 2.0\nup")
    with pytest.raises(ProtocolError, match="detection.start_n is 2.5 N above staircase.cap_n"):
        load_protocol(f"{low}\n[detection]\nfrequencies_hz = [25.0]\nstart_n = 2.5\n", "mine.toml")
