"""Where no time is known, no sentence, figure or table speaks of seconds or hertz."""

import re

import numpy as np
import pytest
from matplotlib.text import Text

from analysis.figures.look_pictures import make_look_pictures
from analysis.look.clock import CLOCK
from analysis.look.overview import make_overview
from analysis.reports.look_report import render_look_report, summarise_overview
from analysis.wording import replace_time_units
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

TIMED = re.compile(r"\bHz\b|\(s\)|\d s\b")


def make_untimed_recording(meta) -> Recording:
    random = np.random.default_rng(1)
    command = np.tile(random.standard_normal(200), 10)[:, None]
    response = np.cumsum(command, axis=0) + 0.01 * random.standard_normal((2000, 1))
    force, position = Signal(command, 1.0, "force", "N", ("f",)), Signal(response, 1.0, "position", "m", ("x",))
    return Recording("rig", force, position, meta=meta)


def report_texts(meta) -> list[str]:
    found = make_overview("rig", make_untimed_recording(meta))
    pictures = make_look_pictures(found, 1)
    texts = [text.get_text() for each in pictures for text in each.figure.findobj(Text)]
    checks = [f"{check.finding} {check.advice}" for check in found.checks if check.name != CLOCK]
    return [summarise_overview(found), *checks, *texts, *(f"{each.caption} {each.alternative}" for each in pictures)]


def test_an_untimed_recording_is_described_in_samples():
    assert [text for text in report_texts({"time": "unknown"}) if TIMED.search(text)] == []


def test_a_recording_with_known_time_keeps_its_seconds():
    assert any(TIMED.search(text) for text in report_texts({}))


@pytest.mark.slow
def test_its_page_counts_samples():
    found = make_overview("rig", make_untimed_recording({"time": "unknown"}))
    page = render_look_report([found], [make_look_pictures(found, 1)], {}, "now")
    assert "Start (samples)" in page and "Start (s)" not in page


@pytest.mark.parametrize(
    ("text", "wanted"),
    [("from 0.1 to 0.5 Hz", "from 0.1 to 0.5 cycles per sample"), ("Time (s)", "Time (samples)"),
     ("12 s at 4 N", "12 samples at 4 N"),
     ("unit per √Hz", "unit per √(cycle per sample)"), ("3 steps", "3 steps")],
)  # fmt: skip
def test_units_of_time_are_replaced_alone(text, wanted):
    assert replace_time_units(text) == wanted
