from dataclasses import replace
from importlib.resources import files

import pytest

from protocols.document.loading import load_protocol
from study.session.views.handle_notice import format_recording_notice


def shipped(name: str):
    return load_protocol(files("protocols").joinpath(f"{name}.toml").read_text("utf-8"), name)


def test_without_a_hand_the_notice_asks_to_keep_hands_off():
    said = format_recording_notice(shipped("sweep_band"), "omega.3", 298.0)
    assert said.startswith("No person may hold the handle: 'omega.3' is going to move by itself for about 5 min")
    assert "up to 3 N" in said


def test_in_a_hand_the_hand_is_asked_for():
    said = format_recording_notice(shipped("sweep_hand"), "omega.3", 269.0)
    assert "hold the handle of 'omega.3' now" in said
    assert "up to 1.5 N" in said
    assert "No person" not in said


@pytest.mark.parametrize(("total_s", "words"), [(0.2, "about 1 s"), (59.0, "about 59 s"), (60.0, "about 1 min")])
def test_short_recordings_are_told_in_seconds(total_s, words):
    assert words in format_recording_notice(replace(shipped("sweep"), hand="none"), "omega.3", total_s)
